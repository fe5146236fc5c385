"""The app, settings in and FastAPI application out; and serving it until it is told to stop."""

from __future__ import annotations

import asyncio
import gc
import importlib.metadata
import logging
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

import uvicorn
from fastapi import APIRouter, Depends, FastAPI
from fastapi.routing import APIRoute
from starlette.middleware.cors import CORSMiddleware
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from service.access.gate import Gate
from service.errors import AddressError, ServiceError
from service.jobs.folder import DataFolder
from service.jobs.store import Store
from service.jobs.store_place import StorePlace
from service.logs import set_up_logging
from service.machine.limits import this_machine
from service.products.registry import all_products
from service.settings import Settings

from .context import Service
from .dems import ground
from .dems import router as dems
from .detector_streams import router as detector_streams
from .detectors import detections, range_logs
from .detectors import router as detectors
from .guard.access import Access
from .guard.body_limit import BodyLimit, body_limits
from .guard.browsers import Browsers
from .guard.connections import Connections, Proxies
from .guard.leaving import Leave, Leaving
from .guard.pace import Pace
from .guard.prefix import Prefix
from .guard.protocols import GuardedConfig
from .guard.queries import refuse_unknown
from .health import router as health
from .health import sentence_of_memory
from .login import router as login
from .meta import describe, problem_routes, tags_of
from .missions.files import imports
from .missions.files import router as mission_files
from .missions.routes import router as missions
from .probes import router as probes
from .problems import answer_with_problems
from .products.resources import product_router
from .seeing.metrics import Metrics
from .seeing.metrics import router as metrics
from .seeing.requests import Seen
from .seeing.traces import Traces
from .web_page import install as install_web_page

__all__ = ["allow_head", "create_app", "serve"]

GRACE_S = 3
ACCEPTED_AT_ONCE = 16
WAITING_CONNECTIONS = 2048

logger = logging.getLogger("sightline.http")


def allow_head(router: APIRouter) -> None:
    """Answer HEAD on every route of the router that answers GET; the documentation stays as it is."""
    routes = [route for route in router.routes if isinstance(route, APIRoute)]
    # routers outlive the app that they are part of, and serve the next one too
    done = {route.path for route in routes if "HEAD" in (route.methods or ())}
    for route in routes:
        if "GET" not in (route.methods or ()) or route.path in done:
            continue
        router.add_api_route(
            route.path.removeprefix(router.prefix),
            route.endpoint,
            methods=["HEAD"],
            name=f"head_{route.name}",
            response_model=route.response_model,
            response_class=route.response_class,
            include_in_schema=False,
        )


def create_app(
    settings: Settings | None = None,
    folder: DataFolder | None = None,
    gate: Gate | None = None,
    store: Store | None = None,
) -> FastAPI:
    """The application; its workers start and stop with it.

    folder: an open data folder, which stays open; without one the app opens and closes that of the settings. gate: whom
    it lets in; without one whoever the settings say. store: an open one, which it closes. Raises KeysError, StartError.
    """
    chosen = Settings() if settings is None else settings
    products = all_products(chosen.more_products)
    gate = Gate(chosen) if gate is None else gate
    version = importlib.metadata.version("sightline")
    traces = Traces(chosen, version)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        opened = DataFolder.open(chosen.data_folder) if folder is None else folder
        try:
            app.state.service = service = Service.assemble(chosen, opened, store)
            app.state.metrics.watch(service)
            traces.watch(service)
            app.state.leave.listeners.append(service.supervisor.leaving.set)
            tasks: list[asyncio.Task[None]] = []
            try:
                service.pool.start()
                await service.supervisor.start()
                service.quarantined = opened.count_quarantined()
                await service.supervisor.in_store(service.detectors.restore, service.grid)
                supervisor = service.supervisor
                retained = supervisor.retention.keep_sweeping(supervisor.in_store, supervisor.space)
                warm_up = service.warm_up(app.state.document.made)
                upkeep = (service.watch_store(), retained, service.detectors.keep_sweeping(), warm_up)
                tasks += [asyncio.create_task(work) for work in upkeep]
                yield
            finally:
                for task in tasks:
                    task.cancel()
                await service.grounds.stop()
                await service.supervisor.stop()
                await service.pool.stop()
                service.detectors.close()
                service.store.close()
        finally:
            await asyncio.to_thread(traces.close)
            if folder is None:
                opened.close()

    app = FastAPI(
        title="Sightline",
        version=version,
        summary="Line-of-sight prediction for rovers that range to anchors over terrain.",
        openapi_tags=tags_of(products.values()),
        generate_unique_id_function=lambda route: route.name,
        lifespan=lifespan,
        docs_url=None,  # web_page has one that loads nothing from elsewhere
        redoc_url=None,
        openapi_url=None,  # meta has one that is written once
        telemetry=traces.config,
    )
    routers = [
        *(dems, ground, missions, mission_files, imports, probes),
        *(product_router(product) for product in products.values()),
        *(detections, detectors, range_logs, health, metrics, problem_routes),
    ]
    for router in routers:
        allow_head(router)
        app.include_router(router, dependencies=[Depends(refuse_unknown)])
    app.include_router(detector_streams)
    app.include_router(login)
    app.state.gate = gate
    install_web_page(app)
    answer_with_problems(app)
    long = [product.path for product in products.values() if product.long_body]
    app.add_middleware(BodyLimit, limits=body_limits(chosen, long), most_bytes=chosen.max_body_memory_bytes)
    app.add_middleware(Access, gate=gate)
    if chosen.allowed_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=chosen.allowed_origins,
            allow_methods=["GET", "HEAD", "POST", "PUT", "DELETE"],
            allow_headers=[
                "Authorization",
                "Content-Type",
                "If-Match",
                "If-None-Match",
                "Prefer",
                "Range",
                "X-Request-Id",
            ],
            expose_headers=["Content-Range", "ETag", "Location", "Preference-Applied", "Retry-After", "X-Request-Id"],
        )
    app.add_middleware(Browsers, settings=chosen)
    app.add_middleware(Pace)
    app.state.leave = Leave()
    app.add_middleware(Leaving, leave=app.state.leave)
    app.state.metrics = Metrics(app.version)
    traced = chosen.otlp_endpoint is not None
    app.add_middleware(Seen, metrics=app.state.metrics, access_log=chosen.access_log, traced=traced)
    app.state.document = describe(app, products.values())
    return app


def serve(settings: Settings) -> None:
    """Serve HTTP until SIGINT or SIGTERM. Raises AddressError, KeysError, DataFolderError, DataFolderInUseError."""
    set_up_logging(settings.log_format)
    with _listening(settings.host, settings.port) as listener:
        gate = Gate(settings)
        gate.check_off_loopback(listener.getsockname()[0], insecure=settings.insecure)
        folder = DataFolder.open(settings.data_folder)
        try:
            # a store that cannot be used ends here with one sentence, within the app with a traceback
            store = Store(StorePlace.of(settings, folder.root).open())
            fits, told = sentence_of_memory(settings, this_machine())
            logger.log(logging.INFO if fits else logging.WARNING, "%s", told)
            connections = Connections(settings)
            app = create_app(settings, folder, gate, store)
            app.state.metrics.connections = connections
            proxies = ProxyHeadersMiddleware(app, list(settings.trusted_proxies))  # type: ignore[arg-type] # the same ASGI
            config = GuardedConfig(
                Prefix(proxies, settings, Proxies(settings.trusted_proxies)),  # type: ignore[arg-type] # the same ASGI
                connections,
                settings,
                # one event loop everywhere, whatever else is installed
                loop="asyncio",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,  # Prefix has to see the proxy's own address
                timeout_graceful_shutdown=GRACE_S,
                # accepted at once; with more of them descriptors run out before any has been counted
                backlog=ACCEPTED_AT_ONCE,
                # beyond its limit a message is answered with a problem; only one far beyond it ends the stream
                ws_max_size=4 * settings.max_stream_message_bytes,
                # answers are small and want to be quick
                ws_per_message_deflate=False,
            )
            server = _Server(config, app.state.leave, _url(settings.host, listener), folder)
            with suppress(SystemExit):  # a code of uvicorn's own for a start that failed
                server.run(sockets=[listener])
            if not server.started:
                raise ServiceError("The service could not start; its log tells why.")
        finally:
            folder.close()


class _Server(uvicorn.Server):
    """Says on stdout where it listens, once it does."""

    def __init__(self, config: GuardedConfig, leave: Leave, url: str, folder: DataFolder) -> None:
        super().__init__(config)
        self._leave = leave
        self._connections = config.connections
        self._url = url
        self._folder = folder

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then tell."""
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(self._connections.on_fault)
        await super().startup(sockets)
        if not self.started:
            return
        for listener in sockets or ():
            listener.listen(WAITING_CONNECTIONS)  # the loop has set it to what it accepts at once
        # what has been loaded stays, and to look through all of it would stop everybody for a third of a second
        gc.freeze()
        gc.enable()
        print(f"Sightline listens on {self._url} (data in {self._folder.root})", flush=True)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Answer who waits, then end."""
        self._leave.begin()
        await super().shutdown(sockets)

    async def on_tick(self, counter: int) -> bool:
        """Ten times a second."""
        if counter % 10 == 0:
            self._connections.sweep(asyncio.get_running_loop().time())
        return await super().on_tick(counter)


def _listening(host: str, port: int) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(WAITING_CONNECTIONS)
        except OSError:
            listener.close()
            raise
    except OSError as error:
        raise AddressError(
            f"Sightline cannot listen on {host} port {port}: {error.strerror or error}; choose another port "
            "(SIGHTLINE_PORT, 0 picks a free one) or host (SIGHTLINE_HOST)."
        ) from error
    return listener


def _url(host: str, listener: socket.socket) -> str:
    port = listener.getsockname()[1]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
