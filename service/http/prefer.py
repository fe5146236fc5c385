"""The Prefer header of RFC 7240: how long a client is willing to wait."""

from __future__ import annotations

import re
from typing import Annotated

from fastapi import Depends, Header

from .context import ServiceDep

__all__ = ["WaitDep"]

WAIT = re.compile(r"(?:^|[,;])\s*wait\s*=\s*\"?(\d{1,9})\"?\s*(?=$|[,;])", re.IGNORECASE)


def _wait_s(
    service: ServiceDep,
    prefer: Annotated[
        str | None,
        Header(
            description="`wait=SECONDS`: answer when the calculation is done, or with 202 after so many seconds "
            "(the setting SIGHTLINE_MAX_WAIT_S caps it). Without it the answer comes at once.",
            examples=["wait=10"],
        ),
    ] = None,
) -> float | None:
    """Seconds to wait, at most what the settings allow; None when no wait is wanted or none that is understood."""
    found = None if prefer is None else WAIT.search(prefer)
    return None if found is None else min(float(found[1]), service.settings.max_wait_s)


WaitDep = Annotated[float | None, Depends(_wait_s)]
