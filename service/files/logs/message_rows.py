"""Messages as rows of a log: ranges, and motions between messages, as a mapping says where they stand."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from detection import OdometryIncrement, RangeMeasurement
from service.files.range_log import Row

from .form import LENGTHS_M, TIMES_S, StreamMap
from .messages import Message, listed, number_at, value_at

__all__ = ["Rows"]

ANGLES_DEG = {"deg": 1.0, "rad": math.degrees(1.0)}
POSITIONS = (("x_m", "y_m", "z_m"), ("east_m", "north_m", "up_m"))
ORIENTATION = ("x", "y", "z", "w")


@dataclass(slots=True)
class Rows:
    """Makes rows of messages one after the other. ids: names in the log to ids of anchors."""

    maps: Mapping[str, tuple[StreamMap, ...]]
    ids: Mapping[str, str] = field(default_factory=dict)
    heading_deg: float | None = None
    before: dict[str, tuple[float, tuple[float, ...]]] = field(default_factory=dict)

    @classmethod
    def of(cls, maps: tuple[StreamMap, ...], ids: Mapping[str, str]) -> Rows:
        """For messages of these streams."""
        by_name: dict[str, tuple[StreamMap, ...]] = {}
        for one in maps:
            by_name[one.stream] = (*by_name.get(one.stream, ()), one)
        return cls(by_name, ids)

    def take(self, message: Message) -> Iterator[Row]:
        """The rows that a message comes to; none for one that only sets the heading."""
        for told in self.maps.get(message.stream, ()):
            time_s = self._number(told, message, "time_s")
            at_s = message.time_s if time_s is None else time_s
            if told.role == "ranges":
                yield from self._ranges(told, message, at_s)
            elif told.role == "heading":
                self.heading_deg = self._heading_deg(told, message)
            elif (motion := self._motion(told, message, at_s)) is not None:
                yield Row(at_s, None, motion)

    def _number(self, told: StreamMap, message: Message, name: str) -> float | None:
        path = told.fields.get(name)
        number = None if path is None else number_at(message.body, path)
        return None if number is None else number * _factor(told, name)

    def _ranges(self, told: StreamMap, message: Message, at_s: float) -> Iterator[Row]:
        each = {name.partition(".")[2]: path for name, path in told.fields.items() if name.startswith("range_m.")}
        for written, path in each.items():
            value = number_at(message.body, path)
            if value is not None and value != told.missing:
                yield self._range(told, f"range_m.{written}", written, value, None, at_s)
        if each:
            return
        ids, values = self._listed(told, message, "anchor_id"), self._listed(told, message, "range_m")
        sigmas = self._listed(told, message, "sigma_m")
        named: list[object] = ids or list(range(len(values)))
        for number, (anchor, listed_value) in enumerate(zip(named, values, strict=False)):
            measured = number_at({"": listed_value}, "")
            if measured is None or measured == told.missing:
                continue
            sigma_m = number_at({"": sigmas[number]}, "") if number < len(sigmas) else None
            yield self._range(told, "range_m", _id(anchor), measured, sigma_m, at_s)

    def _listed(self, told: StreamMap, message: Message, name: str) -> list[object]:
        path = told.fields.get(name)
        if path is None:
            return []
        if path.startswith("="):
            return [path[1:]]
        if path == "@stream":
            parts = [part for part in message.stream.split("/") if part not in ("", "range", "distance", "ranging")]
            return [parts[-1] if parts else message.stream]
        value = value_at(message.body, path)
        each = listed(value)
        return each if each is not None else [] if value is None else [value]

    def _range(self, told: StreamMap, name: str, written: str, value: float, sigma: float | None, at_s: float) -> Row:
        sigma_m = None if sigma is None or sigma == told.missing else sigma * _factor(told, "sigma_m")
        measured = RangeMeasurement(
            self.ids.get(written, written),
            value * _factor(told, name),
            sigma_m if sigma_m is not None and math.isfinite(sigma_m) and sigma_m > 0.0 else None,
            None,
            at_s,
        )
        return Row(at_s, measured, None)

    def _heading_deg(self, told: StreamMap, message: Message) -> float | None:
        heading_deg = self._number(told, message, "heading_deg")
        if heading_deg is not None or "orientation" not in told.fields:
            return heading_deg
        path = told.fields["orientation"]
        parts = [number_at(message.body, f"{path}.{part}") for part in ORIENTATION]
        x, y, z, w = (math.nan if part is None else part for part in parts)
        # counter-clockwise from east in a frame of east, north, up
        yaw_rad = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return 90.0 - math.degrees(yaw_rad) if math.isfinite(yaw_rad) else None

    def _motion(self, told: StreamMap, message: Message, at_s: float) -> OdometryIncrement | None:
        names = set(told.fields)
        own = self._heading_deg(told, message)
        heading_deg = self.heading_deg if own is None else own
        if "forward_m" in names:
            return self._increment(told, message, at_s, heading_deg)
        if "speed_forward_m_per_s" in names:
            speeds = [self._number(told, message, name) for name in ("speed_forward_m_per_s", "speed_left_m_per_s")]
            since = self._since(told.stream, at_s, ())
            if since is None or speeds[0] is None:
                return None
            duration_s, _ = since
            return _level(duration_s, speeds[0] * duration_s, (speeds[1] or 0.0) * duration_s, heading_deg)
        if "travelled_m" in names:
            return self._between(told, message, at_s, ("travelled_m",), heading_deg)
        aligned = "east_m" in names
        if aligned and "down_m" in names:
            return self._between(told, message, at_s, ("east_m", "north_m", "down_m"), None, aligned)
        return self._between(told, message, at_s, POSITIONS[aligned], None if aligned else own, aligned)

    def _increment(
        self, told: StreamMap, message: Message, at_s: float, heading_deg: float | None
    ) -> OdometryIncrement | None:
        forward_m, left_m = (self._number(told, message, name) for name in ("forward_m", "left_m"))
        duration_s = self._number(told, message, "duration_s")
        if duration_s is None:
            since = self._since(told.stream, at_s, ())
            duration_s = None if since is None else since[0]
        if forward_m is None or duration_s is None or duration_s <= 0.0:
            return None
        return _level(duration_s, forward_m, left_m or 0.0, heading_deg)

    def _between(
        self,
        told: StreamMap,
        message: Message,
        at_s: float,
        names: tuple[str, ...],
        heading_deg: float | None,
        aligned: bool = False,
    ) -> OdometryIncrement | None:
        """From where the message before was to where this one is."""
        values = [self._number(told, message, name) for name in names]
        if any(value is None or not math.isfinite(value) for value in values[:2]):
            return None
        place = tuple(0.0 if value is None else value for value in values)
        since = self._since(told.stream, at_s, place)
        if since is None:
            return None
        duration_s, before = since
        moved = [now - then for now, then in zip(place, before, strict=True)]
        if len(moved) == 1:
            return _level(duration_s, moved[0], 0.0, heading_deg)
        if aligned:
            heading_deg = math.degrees(math.atan2(moved[0], moved[1])) if any(moved[:2]) else None
        # in a frame of its own: only lengths of wheel_m count, and they add up as vectors there
        heading_rad = None if heading_deg is None else math.radians(heading_deg)
        return OdometryIncrement(duration_s, (moved[0], moved[1]), None, heading_rad)

    def _since(self, stream: str, at_s: float, place: tuple[float, ...]) -> tuple[float, tuple[float, ...]] | None:
        before = self.before.get(stream)
        self.before[stream] = at_s, place
        if before is None or not at_s > before[0]:
            return None
        return at_s - before[0], before[1]


def _level(duration_s: float, forward_m: float, left_m: float, heading_deg: float | None) -> OdometryIncrement:
    """heading_deg: of the nose; where it led is the other way where it drove backwards."""
    if heading_deg is None:
        return OdometryIncrement(duration_s, (forward_m, left_m))
    led_rad = math.radians(heading_deg) - math.atan2(left_m, forward_m)
    return OdometryIncrement(duration_s, (forward_m, left_m), None, led_rad)


def _id(written: object) -> str:
    return str(int(written)) if isinstance(written, float) and written.is_integer() else str(written)


def _factor(told: StreamMap, name: str) -> float:
    """What a number of the file is to be multiplied with."""
    unit = told.units.get(name)
    if unit is None:
        return 1.0
    units: Mapping[str, float] = {"time_s": TIMES_S, "duration_s": TIMES_S, "heading_deg": ANGLES_DEG}.get(
        name, LENGTHS_M
    )
    return units[unit]
