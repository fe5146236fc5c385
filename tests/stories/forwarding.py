"""A small reverse proxy on a free loopback port: bytes through, with the first line and a header changed."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import httpx

__all__ = ["forwarding"]


@contextmanager
def forwarding(url: str, root: str, strips: bool) -> Iterator[int]:
    """A port behind which the service is found under ``root``. strips: whether the path is taken off, and told."""
    address = (httpx.URL(url).host, httpx.URL(url).port or 80)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=_accept, args=(listener, address, root, strips), daemon=True).start()
        yield int(listener.getsockname()[1])


def _accept(listener: socket.socket, address: tuple[str, int], root: str, strips: bool) -> None:
    with suppress(OSError):  # it is closed
        while True:
            client, _ = listener.accept()
            threading.Thread(target=_serve, args=(client, address, root, strips), daemon=True).start()


def _serve(client: socket.socket, address: tuple[str, int], root: str, strips: bool) -> None:
    """One request for each connection, as proxies without keep-alive have it; streams as they come."""
    with client, suppress(OSError):
        head = b""
        while b"\r\n\r\n" not in head:
            block = client.recv(65536)
            if not block:
                return
            head += block
        first, _, rest = head.partition(b"\r\n")
        method, path, version = first.split(b" ")
        assert path.startswith(root.encode()), path
        told = b"X-Forwarded-For: 192.0.2.7\r\nX-Forwarded-Proto: http\r\n"
        if strips:
            path = path[len(root) :] or b"/"
            told += b"X-Forwarded-Prefix: " + root.encode() + b"\r\n"
        if b"upgrade: websocket" not in rest.lower():
            told += b"Connection: close\r\n"
            rest = rest.replace(b"Connection: keep-alive\r\n", b"").replace(b"connection: keep-alive\r\n", b"")
        with socket.create_connection(address, 60.0) as service:
            service.sendall(b" ".join((method, path, version)) + b"\r\n" + told + rest)
            back = threading.Thread(target=_pass_on, args=(service, client), daemon=True)
            back.start()
            with suppress(OSError):
                _copy(client, service)
            back.join(60.0)


def _pass_on(source: socket.socket, sink: socket.socket) -> None:
    with suppress(OSError):
        _copy(source, sink)
        sink.shutdown(socket.SHUT_RDWR)


def _copy(source: socket.socket, sink: socket.socket) -> None:
    while block := source.recv(65536):
        sink.sendall(block)
