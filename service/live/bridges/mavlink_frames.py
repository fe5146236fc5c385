"""MAVLink messages among bytes: what only looks like one costs none of those that follow it.

pymavlink's own parser drops as many bytes as a false header asks for, and with them messages that are whole.
"""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import all as dialect

__all__ = ["Frames"]

V1, V2 = dialect.PROTOCOL_MARKER_V1, dialect.PROTOCOL_MARKER_V2
V1_HEADER, V2_HEADER = 6, 10  # bytes
CHECKSUM, SIGNATURE = 2, 13
SIGNED = 0x01  # the one incompatibility flag that is known
SILENCE_S = 0.1


class Frames:
    """Takes bytes of one sender. bad: of these, how many belong to no message of the dialect."""

    def __init__(self) -> None:
        self.bad = 0
        self._held = bytearray()  # begins with the mark of what may become a message
        self._heard_s = math.inf
        self._decoder = dialect.MAVLink(None)

    def take(self, data: bytes, now_s: float) -> list[dialect.MAVLink_message]:
        """The messages that are whole by what came now, by our clock."""
        self._held += data
        self._heard_s = now_s
        found: list[dialect.MAVLink_message] = []
        at = 0
        while True:
            begin, message = self._next(at, patient=True)
            self.bad += begin - at
            at = begin
            if message is None:
                break
            found.append(message)
            at += len(message.get_msgbuf())
        del self._held[:at]
        return found

    def late(self, now_s: float) -> list[dialect.MAVLink_message]:
        """After a silence: the messages behind one whose rest does not come, which is none where they are whole."""
        if now_s - self._heard_s < SILENCE_S:
            return []
        self._heard_s = math.inf
        begin, message = self._next(1, patient=False)
        if message is None:
            return []
        self.bad += begin
        del self._held[:begin]
        return self.take(b"", now_s)

    def _next(self, begin: int, patient: bool) -> tuple[int, dialect.MAVLink_message | None]:
        """(where the next message begins, the message); None, and where to go on, if it is not all here yet.

        patient: what is not all here is waited for, not passed over.
        """
        for at in range(begin, len(self._held)):
            if self._held[at] not in (V1, V2):
                continue
            end = at + _size(self._held[at : at + V2_HEADER])
            if end > len(self._held):
                if patient:
                    return at, None
            elif end > at:
                try:
                    return at, self._decoder.decode(self._held[at:end])
                except dialect.MAVError:
                    continue
        return len(self._held), None


def _size(header: bytearray) -> int:
    """Bytes of the message that a header, or what there is of it, begins; 0 = it begins none of the dialect."""
    if header[0] == V1:
        if len(header) < V1_HEADER:
            return V1_HEADER + CHECKSUM
        known = dialect.mavlink_map.get(header[5])
        # version 1 sends nothing that the dialect has not, nor leaves zeros out
        fits = known is not None and header[1] <= known.unpacker.size
        return V1_HEADER + header[1] + CHECKSUM if fits else 0
    if len(header) < V2_HEADER:
        return V2_HEADER + CHECKSUM
    if header[2] & ~SIGNED or int.from_bytes(header[7:10], "little") not in dialect.mavlink_map:
        return 0
    return V2_HEADER + header[1] + CHECKSUM + (SIGNATURE if header[2] & SIGNED else 0)
