"""``sightline serve``: the HTTP service; ``sightline warm-up``: what makes it quick."""

from __future__ import annotations

import gc
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from ..asking.options import GROUP, option, told

__all__ = ["serve", "warm_up"]

SWITCH_S = 0.001


@GROUP
@dataclass(frozen=True, slots=True)
class ServiceOptions:
    """Settings of the service that have options; what is not given the environment and the defaults say."""

    host: Annotated[str | None, option("Address to listen on. (default 127.0.0.1)")] = None
    port: Annotated[int | None, option("Port; 0 picks a free one. (default 8000)")] = None
    data_folder: Annotated[Path | None, option("Folder for DEMs, jobs and results.", "DIR", "--data")] = None
    insecure: Annotated[bool | None, option("Listen off loopback without keys, for everybody who reaches it.")] = None
    scheduler: Annotated[
        str | None, option("Calculate every job on the Dask cluster of this scheduler, tcp://HOST:8786.", "ADDRESS")
    ] = None
    workers: Annotated[int | None, option("Calculations at the same time. (default one per core)")] = None


def serve(*, options: ServiceOptions = ServiceOptions()) -> None:
    """Start the HTTP service. Every other setting comes from the environment, as SIGHTLINE_<NAME>."""
    # a request changes threads some times, and each time a thread that calculates would keep it waiting for 5 ms
    sys.setswitchinterval(SWITCH_S)
    gc.disable()  # until all is loaded, for all of that stays: looking through it meanwhile is a tenth of the start
    from service.http.app import serve as serve_until_stopped
    from service.settings import Settings

    given = told(options)
    if "scheduler" in given:
        given |= {"dask_scheduler": given.pop("scheduler"), "calculate_on": "cluster"}
    serve_until_stopped(Settings.model_validate(given))


def warm_up() -> None:
    """Compile every kernel into the cache, so that nothing waits for a compiler later."""
    from service.products.registry import all_products
    from service.settings import Settings
    from service.warm_up import warm_up_on_all_cores

    warm_up_on_all_cores(all_products(Settings().more_products))
