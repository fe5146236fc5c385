"""What routes work with: one object per app, made when the app starts."""

from __future__ import annotations

import asyncio
import gc
import logging
import sqlite3
import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, ParamSpec, TypeVar

from fastapi import Depends, Request

from service.jobs.folder import DataFolder
from service.jobs.kept_files import load_grid
from service.jobs.pool import WorkerPool
from service.jobs.short_tasks import Checks, Drawings
from service.jobs.store import TROUBLE, Store
from service.jobs.store_place import StorePlace
from service.jobs.supervisor import Supervisor
from service.live.registry import Detectors
from service.live.replay import rehearse
from service.live.watching import looked_at
from service.machine.limits import give_memory_back, resident_bytes
from service.missions.shelf import MissionShelf
from service.products import Product
from service.products.registry import all_products
from service.settings import Settings
from terrain import ElevationGrid

from .grounds import Grounds
from .guard.uploads import Uploads

__all__ = ["Service", "ServiceDep"]

logger = logging.getLogger("sightline.http")

STORE_CHECK_EVERY_S = 5.0
TRIM_BYTES = 16 * 1024 * 1024
P = ParamSpec("P")
R = TypeVar("R")


@dataclass(slots=True)
class Service:
    """The running service behind the routes."""

    settings: Settings
    folder: DataFolder
    store: Store
    missions: MissionShelf
    pool: WorkerPool
    supervisor: Supervisor
    drawings: Drawings
    checks: Checks
    detectors: Detectors
    products: Mapping[str, Product]
    uploads: Uploads
    grounds: Grounds
    started_at_s: float
    store_writable: bool = True
    warm: bool = False
    quarantined: int = 0

    @classmethod
    def assemble(cls, settings: Settings, folder: DataFolder, store: Store | None = None) -> Service:
        """Put the parts together; nothing runs yet. store: open, else that of the settings. Raises DataFolderError."""
        settings = settings.model_copy(update={"data_folder": folder.root})
        store = Store(StorePlace.of(settings).open()) if store is None else store
        missions = MissionShelf(store.transaction, settings.max_missions, settings.max_mission_versions)
        pool = WorkerPool(settings, folder)
        supervisor = Supervisor(settings, folder, store, pool)
        uploads = Uploads(settings)
        drawings, checks = Drawings(folder, supervisor), Checks(settings, supervisor)
        detectors = Detectors(settings, folder=folder.detectors)
        products = all_products(settings.more_products)
        parts = (settings, folder, store, missions, pool, supervisor, drawings, checks, detectors, products, uploads)
        return cls(*parts, Grounds(), time.monotonic())

    def grid(self, dem_id: str) -> ElevationGrid:
        """The ground of a DEM for a detector, its heights mapped from the file. Raises NotFoundError, OSError."""
        self.store.dem(dem_id)
        return looked_at(load_grid(self.folder.dem(dem_id)))

    async def look_up(self, work: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Read from the store beside whatever is written to it or to files; what was answered before is seen."""
        return await asyncio.to_thread(work, *args, **kwargs)

    async def warm_up(self, then: Callable[[], Awaitable[object]]) -> None:
        """Call what detectors call, beside the first requests; ``warm`` then. then: what is made after that."""
        if self.settings.rehearse == "everything":
            await asyncio.to_thread(rehearse)
        self.warm = True
        await self.pool.until_warm()  # what starts has the processors first
        await then()
        gc.freeze()  # it stays, too

    async def watch_store(self) -> None:
        """Keep ``store_writable`` and ``quarantined`` true to life, so that /health need not touch the disk.

        And hand memory back once it was needed: many bodies at once leave as much behind.
        """
        least_bytes = resident_bytes()
        while True:
            if resident_bytes() > least_bytes + TRIM_BYTES:
                await asyncio.to_thread(give_memory_back)
            least_bytes = min(least_bytes, resident_bytes())
            try:
                self.quarantined = await asyncio.to_thread(self.folder.count_quarantined)
                await asyncio.to_thread(self.supervisor.space.look)
                await asyncio.to_thread(self.folder.check_usable)
                await self.supervisor.in_store(self.store.check_writable)
                self.store_writable = True
            except (sqlite3.DatabaseError, *TROUBLE) as error:
                logger.error("the job store cannot be written: %s", error)
                self.store_writable = False
            await asyncio.sleep(STORE_CHECK_EVERY_S)


async def _service_of(request: Request) -> Service:
    service: Service = request.app.state.service
    return service


ServiceDep = Annotated[Service, Depends(_service_of)]
