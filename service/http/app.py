"""The app: settings in, FastAPI application out."""

from __future__ import annotations

import asyncio
import importlib.metadata
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI

from service.jobs.folder import DataFolder
from service.live.rehearsal import rehearse
from service.products.registry import all_products
from service.settings import Settings

from . import problems, web_page
from .body_limit import BodyLimit, body_limits
from .context import Service
from .head import allow_head
from .openapi import describe, tags_of
from .resources import product_router
from .routes import dems, detections, detector_streams, detectors, ground, health, probes, problem_list

__all__ = ["create_app"]


def create_app(settings: Settings | None = None, folder: DataFolder | None = None) -> FastAPI:
    """The application; its workers start and stop with it.

    folder: an open data folder, which stays open; without one the app opens and closes that of the settings.
    """
    chosen = Settings() if settings is None else settings
    products = all_products(chosen.more_products)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        opened = DataFolder.open(chosen.data_folder) if folder is None else folder
        try:
            app.state.service = service = Service.assemble(chosen, opened)
            service.pool.start()
            if chosen.rehearse == "everything":
                await asyncio.to_thread(rehearse)
            await service.supervisor.start()
            service.quarantined = opened.count_quarantined()
            tasks = [asyncio.create_task(work) for work in (service.watch_store(), service.detectors.keep_sweeping())]
            try:
                yield
            finally:
                for task in tasks:
                    task.cancel()
                await service.supervisor.stop()
                await service.pool.stop()
                service.detectors.bench.close()
                service.store.close()
        finally:
            if folder is None:
                opened.close()

    app = FastAPI(
        title="Sightline",
        version=importlib.metadata.version("sightline"),
        summary="Line-of-sight prediction for rovers that range to anchors over terrain.",
        openapi_tags=tags_of(products.values()),
        generate_unique_id_function=lambda route: route.name,
        lifespan=lifespan,
        docs_url=None,  # web_page has one that loads nothing from elsewhere
        redoc_url=None,
    )
    routers = [
        dems.router,
        ground.router,
        probes.router,
        *(product_router(product) for product in products.values()),
        *(part.router for part in (detections, detectors, health, problem_list)),
    ]
    for router in routers:
        allow_head(router)
        app.include_router(router)
    app.include_router(detector_streams.router)
    web_page.install(app)
    problems.install(app)
    long = [product.path for product in products.values() if product.long_body]
    app.add_middleware(BodyLimit, limits=body_limits(chosen, long))
    describe(app, [product.asked for product in products.values()])
    return app
