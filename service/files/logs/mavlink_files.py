"""ArduPilot's DataFlash logs and MAVLink telemetry (.tlog), read by pymavlink."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from pymavlink.DFReader import DFReader_binary, DFReader_text
from pymavlink.dialects.v20 import all as dialect

from .messages import Message, MessageLog, Stream
from .opening import DATAFLASH_TEXT, TELEMETRY, reading

__all__ = ["body_of", "opened"]

STAMP = struct.Struct(">Q")
# magic: bytes of a packet besides its payload
OVERHEAD = {0xFD: 12, 0xFE: 8}
SIGNED, SIGNATURE_BYTES = 1, 13
NOT_DATA = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "BAD_DATA"}


class _QuietReader(DFReader_binary):  # type: ignore[misc] # pymavlink ships no types
    """Reads without the compiled indexer, which writes a line on the terminal for each broken byte."""

    def __init__(self, filename: str) -> None:
        try:
            super().__init__(filename)
        except BaseException:
            self.close()
            raise

    def init_arrays_fast(self, progress_callback: Callable[[int], None] | None = None) -> None:
        """As where there is no such indexer."""
        self.init_arrays(progress_callback)


def opened(path: Path, kind: str) -> MessageLog:
    """The kinds of messages of a log."""
    if kind == TELEMETRY:
        return _log(path, kind, "mavlink", lambda: _telemetry(path))
    return _log(path, kind, "dataflash", lambda: _dataflash(path, kind))


def _log(path: Path, kind: str, family: str, messages: Callable[[], Iterator[Message]]) -> MessageLog:
    counts: dict[str, int] = {}
    firsts: dict[str, object] = {}
    for message in messages():
        counts[message.stream] = counts.get(message.stream, 0) + 1
        firsts.setdefault(message.stream, message.body)
    streams = tuple(Stream(name, name.partition("#")[0], counts[name], first) for name, first in firsts.items())

    def read(names: Collection[str]) -> Iterator[Message]:
        with reading(path, kind):
            yield from (message for message in messages() if message.stream in names)

    if not streams:
        raise ValueError("it holds no message")
    return MessageLog(family, kind, streams, read)


def _dataflash(path: Path, kind: str) -> Iterator[Message]:
    log = DFReader_text(str(path)) if kind == DATAFLASH_TEXT else _QuietReader(str(path))
    with log:
        while (message := log.recv_msg()) is not None:
            name = message.get_type()
            if name in NOT_DATA:
                continue
            body = message.to_dict()
            time_us = body.get("TimeUS")
            time_s = 1e-6 * time_us if isinstance(time_us, int | float) else float(message._timestamp)
            yield Message(name, time_s, body)


def _telemetry(path: Path) -> Iterator[Message]:
    """Each packet with the microseconds before it; what is none is passed over to the next that is."""
    data = path.read_bytes()
    link = dialect.MAVLink(None)
    first_system: dict[str, int] = {}
    at = 0
    while at + STAMP.size < len(data):
        packet = data[at + STAMP.size : at + STAMP.size + _length(data, at + STAMP.size)]
        try:
            message = link.decode(bytearray(packet)) if packet else None
        except dialect.MAVError:
            message = None
        if message is None:
            at += 1
            continue
        name, system = message.get_type(), message.get_srcSystem()
        stream = name if first_system.setdefault(name, system) == system else f"{name}#{system}"
        yield Message(stream, 1e-6 * STAMP.unpack_from(data, at)[0], body_of(message))
        at += STAMP.size + len(packet)


def _length(data: bytes, at: int) -> int:
    """Bytes of the packet that begins there; 0 where none does."""
    if data[at] not in OVERHEAD or at + 3 > len(data):
        return 0
    signature = SIGNATURE_BYTES if data[at] == 0xFD and data[at + 2] & SIGNED else 0
    return OVERHEAD[data[at]] + data[at + 1] + signature


def body_of(message: dialect.MAVLink_message) -> dict[str, object]:
    """The fields of a message; a list that counts its own entries has only those."""
    body: dict[str, object] = message.to_dict()
    count, listed = body.get("count"), body.get("distance")
    if isinstance(count, int) and isinstance(listed, list):
        body["distance"] = listed[:count]
    return body
