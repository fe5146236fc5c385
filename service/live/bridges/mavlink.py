"""MAVLink: ranges, odometry and positions in; position, occlusions, beacons and anchors out."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from pymavlink.dialects.v20 import all as dialect

from detection import RangingAnchor
from planning.watching import WatchedEpoch
from service.files.logs.form import StreamMap
from service.files.logs.known import known_map
from service.files.logs.mavlink_files import body_of
from service.files.logs.message_rows import Rows
from service.files.logs.messages import Message, Stream
from service.files.range_log import Row

from .bridge import Asked
from .mavlink_frames import Frames
from .mavlink_out import Outgoing
from .rounds import Rounds
from .true_north import TrueFrame, Unplaced

__all__ = ["Drones", "MavlinkCodec"]

MOST_SENDERS = 16
RANGES, ALTITUDES = "RANGING_BEACON", "DISTANCE_SENSOR"
INT32_MAX = 2147483647
MOVED_M = 0.5
WGS84, MSL = 0, 1


@dataclass(frozen=True, slots=True)
class Drones:
    """Anchors that move. systems: MAVLink system to the anchor that it carries; frame: of the anchors on Earth.

    above_sea_m: what to add to an altitude above mean sea level for one of the anchors'; geoid_m: the geoid there.
    """

    systems: Mapping[int, str] = field(default_factory=dict)
    frame: TrueFrame | Unplaced = Unplaced()  # noqa: RUF009 (it is frozen)
    above_sea_m: float = 0.0
    geoid_m: float = 0.0


class MavlinkCodec:
    """Takes messages of the vehicle and of its radios. ids: numbers of beacons to ids of anchors, where they differ."""

    def __init__(
        self,
        anchors: Sequence[RangingAnchor],
        rounds: Rounds,
        outgoing: Outgoing,
        ids: Mapping[str, str],
        drones: Drones,
    ) -> None:
        self._rounds, self._out, self._drones = rounds, outgoing, drones
        self._anchors = {anchor.id: anchor for anchor in anchors}
        self._rows = Rows({}, ids)
        self._ids = ids
        self._frames: dict[str, Frames] = {}
        self._forgotten_bad = 0
        self._ranks: dict[str, tuple[int, str]] = {}
        self._looked_at: set[str] = set()

    @property
    def bad(self) -> int:
        """Bytes that belong to no message."""
        return self._forgotten_bad + sum(frames.bad for frames in list(self._frames.values()))

    def received(self, source: str, data: bytes) -> Iterable[Asked]:
        """The epochs that end by what came; bytes that are no message are counted."""
        frames = self._frames.get(source)
        if frames is None:
            if len(self._frames) >= MOST_SENDERS:
                self._forgotten_bad += self._frames.pop(next(iter(self._frames))).bad
            frames = self._frames[source] = Frames()
        for message in frames.take(data, time.monotonic()):
            yield from self._heard(message)

    def idle(self) -> Iterable[Asked]:
        """The round that lasted long enough."""
        now_s = time.monotonic()
        for frames in self._frames.values():
            for message in frames.late(now_s):
                yield from self._heard(message)
        for epoch in self._rounds.late(now_s):
            yield Asked(epoch, epoch.time_s)

    def due(self) -> Iterable[bytes]:
        """Heartbeats, parameters, targets."""
        return self._out.due(time.monotonic())

    def answer(self, asked: Asked, watched: WatchedEpoch) -> list[bytes]:
        """The position, and what has become of anchors."""
        return self._out.answer(watched)

    def lost(self, asked: Asked) -> list[bytes]:
        """A text."""
        return self._out.text(dialect.MAV_SEVERITY_ERROR, "Too many ranges: an epoch was lost")

    def _heard(self, message: dialect.MAVLink_message) -> Iterator[Asked]:
        self._out.heard(message)
        yield from self._taken(message.get_type(), message)

    def _taken(self, name: str, message: dialect.MAVLink_message) -> Iterator[Asked]:
        drone = self._drones.systems.get(message.get_srcSystem())
        if drone is not None:
            if name == "GLOBAL_POSITION_INT":
                self._move(drone, 1e-7 * message.lon, 1e-7 * message.lat, 1e-3 * message.alt, MSL)
            return  # its own odometry is not the rover's
        if message.get_srcSystem() == self._out.system and message.get_srcComponent() == self._out.component:
            return  # our own, come back
        body = body_of(message)
        self._look_at(name, body)
        if name == RANGES and message.lat != INT32_MAX and message.lon != INT32_MAX and (message.lat or message.lon):
            written = str(message.beacon_id)
            self._move(
                self._ids.get(written, written), 1e-7 * message.lon, 1e-7 * message.lat, message.alt, message.alt_type
            )
        for row in self._rows.take(Message(name, time.time(), body)):
            for epoch in self._rounds.take(self._turned(row), time.monotonic()):
                yield Asked(epoch, epoch.time_s)

    def _turned(self, row: Row) -> Row:
        """With the heading from the north of the anchors, which may not be true north."""
        if row.motion is None or row.motion.heading_rad is None:
            return row
        heading_rad = row.motion.heading_rad - self._drones.frame.turn_rad()
        return replace(row, motion=replace(row.motion, heading_rad=heading_rad))

    def _look_at(self, name: str, body: dict[str, object]) -> None:
        """Of what is new: whether it is better than what ranges, motions or headings are taken from."""
        if name in self._looked_at:
            return
        known = known_map("mavlink", Stream(name, name, 1, body))
        if known is None and name == ALTITUDES:
            return  # another sensor may be a radio
        self._looked_at.add(name)
        if known is None:
            return
        rank, told = known
        before = self._ranks.get(told.role)
        if before is None or rank > before[0]:
            kept = {one: maps for one, maps in self._rows.maps.items() if before is None or one != before[1]}
            self._ranks[told.role] = rank, name
            self._rows.maps = {**kept, name: (_with_time(told, body),)}

    def _move(self, anchor_id: str, lon_deg: float, lat_deg: float, altitude_m: float, kind: int) -> None:
        anchor, frame = self._anchors.get(anchor_id), self._drones.frame
        if anchor is None or isinstance(frame, Unplaced) or not math.isfinite(altitude_m):
            return
        above_sea_m = altitude_m - (self._drones.geoid_m if kind == WGS84 else 0.0)
        place_m = frame.place(lon_deg, lat_deg, above_sea_m + self._drones.above_sea_m)
        if math.dist(place_m, (anchor.east_m, anchor.north_m, anchor.altitude_m)) > MOVED_M:
            self._anchors[anchor_id] = moved = RangingAnchor(anchor_id, *place_m, anchor.sigma_m)
            self._rounds.move(moved)
            self._out.moved(moved)


def _with_time(told: StreamMap, body: Mapping[str, object]) -> StreamMap:
    """By the sender's clock where it tells one."""
    for name, unit in (("time_usec", "us"), ("usec", "us"), ("time_boot_ms", "ms")):
        if body.get(name):
            fields, units = {**told.fields, "time_s": name}, {**told.units, "time_s": unit}
            return told.model_copy(update={"fields": fields, "units": units})
    return told
