"""Serving: takes the data folder and the port, says where it listens, and runs until it is told to stop."""

from __future__ import annotations

import logging
import socket
import sys

import uvicorn

from service.errors import AddressError
from service.jobs.folder import DataFolder
from service.jobs.store import Store
from service.settings import Settings

from .app import create_app

__all__ = ["serve"]

GRACE_S = 3


def serve(settings: Settings) -> None:
    """Serve HTTP until SIGINT or SIGTERM. Raises AddressError, DataFolderError, DataFolderInUseError."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s %(message)s", stream=sys.stderr)
    with _listening(settings.host, settings.port) as listener:
        folder = DataFolder.open(settings.data_folder)
        try:
            # a store that cannot be used ends here with one sentence, within the app with a traceback
            Store(folder.database).close()
            config = uvicorn.Config(
                create_app(settings, folder),
                # one event loop everywhere, whatever else is installed
                loop="asyncio",
                log_config=None,
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=GRACE_S,
                ws="websockets-sansio",
                # beyond its limit a message is answered with a problem; only one far beyond it ends the stream
                ws_max_size=4 * settings.max_stream_message_bytes,
                # answers are small and want to be quick
                ws_per_message_deflate=False,
            )
            _Server(config, _url(settings.host, listener), folder).run(sockets=[listener])
        finally:
            folder.close()


class _Server(uvicorn.Server):
    """Says on stdout where it listens, once it does."""

    def __init__(self, config: uvicorn.Config, url: str, folder: DataFolder) -> None:
        super().__init__(config)
        self._url = url
        self._folder = folder

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then tell."""
        await super().startup(sockets)
        print(f"Sightline listens on {self._url} (data in {self._folder.root})", flush=True)


def _listening(host: str, port: int) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(2048)
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
