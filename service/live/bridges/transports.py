"""Ways to the other end of a link: UDP, TCP, serial lines. Each is opened, polled, written; OSError tells of a cut."""

from __future__ import annotations

import select
import socket
from dataclasses import dataclass, field
from typing import Protocol

from service.errors import RequestError

__all__ = ["FORMS", "Transport", "transport_of"]

FORMS = (
    "udp:HOST:PORT (listen), udpout:HOST:PORT, tcp:HOST:PORT (connect), tcpin:HOST:PORT (listen), serial:DEVICE:BAUD"
)
MOST_BYTES = 65536
MOST_PEERS = 8
MOST_READS = 64  # of one poll
CONNECT_S = 3.0
WRITE_S = 1.0  # a peer that takes nothing for so long is gone

Received = list[tuple[str, bytes]]


class Transport(Protocol):
    """One way; what it receives comes with a name of who sent it. All methods raise OSError where the link is cut."""

    def open(self) -> None:
        """Begin, or begin again."""
        ...

    def close(self) -> None:
        """End; may be called twice."""
        ...

    def poll(self, wait_s: float) -> Received:
        """What came, waiting so long for the first of it."""
        ...

    def write(self, data: bytes) -> None:
        """Send to whoever is at the other end."""
        ...


@dataclass(slots=True)
class Udp:
    """Datagrams. Who listens answers those that it heard last; who calls sends to one."""

    host: str
    port: int
    listens: bool
    peers: dict[tuple[str, int], None] = field(default_factory=dict)
    line: socket.socket | None = None

    def open(self) -> None:
        """Bind, or take any port."""
        self.line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        if self.listens:
            self.line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.line.bind((self.host, self.port))
            self.port = self.line.getsockname()[1]
        else:
            self.peers[(self.host, self.port)] = None

    def close(self) -> None:
        """Close the socket."""
        if self.line is not None:
            self.line.close()
            self.line = None

    def poll(self, wait_s: float) -> Received:
        """Datagrams, each with the address of its sender."""
        assert self.line is not None
        found: Received = []
        ready = select.select([self.line], [], [], wait_s)[0]
        while ready and len(found) < MOST_READS:
            try:
                data, address = self.line.recvfrom(MOST_BYTES)
            except ConnectionRefusedError:
                continue  # nobody listened to what was sent before
            self.peers.pop(address, None)
            self.peers[address] = None
            if len(self.peers) > MOST_PEERS:
                self.peers.pop(next(iter(self.peers)))
            found.append((f"{address[0]}:{address[1]}", data))
            ready = select.select([self.line], [], [], 0.0)[0]
        return found

    def write(self, data: bytes) -> None:
        """A datagram to each peer."""
        assert self.line is not None
        for peer in self.peers:
            self.line.sendto(data, peer)


@dataclass(slots=True)
class TcpClient:
    """A connection to a listener."""

    host: str
    port: int
    line: socket.socket | None = None
    opened: int = 0

    def open(self) -> None:
        """Connect."""
        self.line = socket.create_connection((self.host, self.port), CONNECT_S)
        self.line.settimeout(WRITE_S)
        self.opened += 1

    def close(self) -> None:
        """Close the socket."""
        if self.line is not None:
            self.line.close()
            self.line = None

    def poll(self, wait_s: float) -> Received:
        """What came; the end of the stream is a cut."""
        assert self.line is not None
        if not select.select([self.line], [], [], wait_s)[0]:
            return []
        return [(f"connection {self.opened}", _read(self.line))]

    def write(self, data: bytes) -> None:
        """All of it."""
        assert self.line is not None
        self.line.sendall(data)


@dataclass(slots=True)
class TcpServer:
    """A listener with a few connections; one that breaks leaves the others."""

    host: str
    port: int
    listener: socket.socket | None = None
    lines: dict[socket.socket, str] = field(default_factory=dict)

    def open(self) -> None:
        """Listen."""
        self.listener = socket.create_server((self.host, self.port))
        self.port = self.listener.getsockname()[1]

    def close(self) -> None:
        """Close all sockets."""
        for line in [*self.lines, *([] if self.listener is None else [self.listener])]:
            line.close()
        self.lines.clear()
        self.listener = None

    def poll(self, wait_s: float) -> Received:
        """What came of each connection."""
        assert self.listener is not None
        found: Received = []
        for line in select.select([self.listener, *self.lines], [], [], wait_s)[0]:
            if line is self.listener:
                caller, address = line.accept()
                caller.settimeout(WRITE_S)
                self.lines[caller] = f"{address[0]}:{address[1]}"
                if len(self.lines) > MOST_PEERS:
                    self._drop(next(iter(self.lines)))
                continue
            try:
                found.append((self.lines[line], _read(line)))
            except OSError:
                self._drop(line)
        return found

    def write(self, data: bytes) -> None:
        """All of it to each connection."""
        for line in list(self.lines):
            try:
                line.sendall(data)
            except OSError:
                self._drop(line)

    def _drop(self, line: socket.socket) -> None:
        self.lines.pop(line, None)
        line.close()


class SerialLine:
    """A serial line, by pyserial."""

    def __init__(self, device: str, baud: int) -> None:
        self.device, self.baud = device, baud
        self._line: object | None = None

    def open(self) -> None:
        """Open the device."""
        from serial import Serial

        self._line = Serial(self.device, self.baud, timeout=0.01, write_timeout=WRITE_S)

    def close(self) -> None:
        """Close the device."""
        if self._line is not None:
            self._line.close()  # type: ignore[attr-defined] # pyserial is optional and ships no types
            self._line = None

    def poll(self, wait_s: float) -> Received:
        """What came."""
        assert self._line is not None
        self._line.timeout = wait_s  # type: ignore[attr-defined] # pyserial is optional and ships no types
        data = self._line.read(max(1, min(MOST_BYTES, self._line.in_waiting)))  # type: ignore[attr-defined] # pyserial is optional and ships no types
        return [(self.device, bytes(data))] if data else []

    def write(self, data: bytes) -> None:
        """All of it."""
        assert self._line is not None
        self._line.write(data)  # type: ignore[attr-defined] # pyserial is optional and ships no types


def _read(line: socket.socket) -> bytes:
    data = line.recv(MOST_BYTES)
    if not data:
        raise ConnectionError("the other end closed the connection")
    return data


def transport_of(address: str) -> Transport:
    """The way that an address names. Raises RequestError."""
    kind, _, rest = address.partition(":")
    place, _, number = rest.rpartition(":")
    if kind in ("udp", "udpout", "tcp", "tcpin", "serial") and place and number.isdecimal():
        if kind == "serial":
            try:
                import serial  # noqa: F401 - loads it to see that it is there
            except ImportError as error:
                raise RequestError("Serial lines need pyserial: pip install 'sightline[logs]'.") from error
            return SerialLine(place, int(number))
        if int(number) < 65536:
            if kind.startswith("udp"):
                return Udp(place, int(number), kind == "udp")
            return TcpClient(place, int(number)) if kind == "tcp" else TcpServer(place, int(number))
    raise RequestError(f"{address!r} is no address of a link: take {FORMS}.")
