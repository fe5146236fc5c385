"""QGroundControl's .plan read: way-points, the way through them, fences and rally points, heights by their frames."""

from __future__ import annotations

import math
import sys
from codecs import BOM_UTF8
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

from pydantic_core import from_json
from pyproj import Geod

from service.errors import RequestError

from .features import Allowance, Feature, Foreign, counted, place_of

__all__ = ["read_plan"]

# MAV_CMD_NAV_… that go to a place
PLACES = {16: "way-point", 17: "loiter", 18: "loiter", 19: "loiter", 21: "landing", 22: "take-off", 31: "loiter"}
PLACES |= {82: "way-point", 84: "take-off", 85: "landing"}
# MAV_FRAME_GLOBAL…, each also with degrees as whole numbers
SEA_LEVEL, HOME, TERRAIN = {0, 5}, {3, 6}, {10, 11}
WGS84 = Geod(ellps="WGS84")
CORNERS = 72


def read_plan(data: bytes, allowance: Allowance) -> Foreign:
    """All places of a plan. Raises RequestError."""
    called = allowance.called
    try:
        plan = from_json(data.removeprefix(BOM_UTF8))
    except ValueError as error:
        raise RequestError(f"{called} is not JSON: {error}.") from error
    if not isinstance(plan, dict) or plan.get("fileType") != "Plan":
        raise RequestError(f"{called} is not a plan of QGroundControl (fileType Plan).")
    items, fence, rally = _list(_part(plan, "mission"), "items"), _part(plan, "geoFence"), _part(plan, "rallyPoints")
    fences, circles, rally_points = _list(fence, "polygons"), _list(fence, "circles"), _list(rally, "points")
    allowance.take(len(items) + sum(len(_list(one, "polygon")) for one in fences))
    allowance.take(CORNERS * len(circles) + len(rally_points))
    reading = _Reading(allowance, _part(plan, "mission"))
    for item in items:
        reading.item(item)
    features = [*reading.points, *reading.others]
    if len(reading.way) > 1:
        features.append(place_of("LineString", reading.way, "mission", {"what": "route"}))
    features += [_fence(number, one, called) for number, one in enumerate(fences, 1)]
    features += [_circle(number, one, called) for number, one in enumerate(circles, 1)]
    for number, point in enumerate(rally_points, 1):
        lat, lon, *rest = _numbers(point, called)
        height = reading.above_home(rest[0] if rest else math.nan)
        features.append(place_of("Point", [lon, lat], f"R{number}", {"what": "rally point", **height}))
    told = counted(reading.skipped, "not taken; it goes to no place.")
    if reading.no_home:
        names = ", ".join(reading.no_home[:5])
        told.append(
            f"Without a height: {names}; it counts from the place of take-off, whose own the plan does not tell."
        )
    return Foreign("QGroundControl plan", tuple(features), tuple(told))


class _Reading:
    """The items of a mission, one after the other."""

    def __init__(self, allowance: Allowance, mission: Mapping[str, Any]) -> None:
        self._allowance, self._called = allowance, allowance.called
        home = mission.get("plannedHomePosition")
        altitude_m = home[2] if isinstance(home, list) and len(home) > 2 else None
        self._home_m = float(altitude_m) if _is_number(altitude_m) else math.nan
        self.points: list[Feature] = []
        self.others: list[Feature] = []
        self.way: list[list[float]] = []
        self.skipped: list[str] = []
        self.no_home: list[str] = []

    def item(self, item: Any) -> None:
        """One item: a place to go to, a pattern, or something that is told."""
        if not isinstance(item, dict):
            raise RequestError(f"{self._called} has an item that is none.")
        if item.get("type") != "SimpleItem":
            self._pattern(item)
            return
        command, params = item.get("command"), item.get("params")
        if not isinstance(command, int) or command not in PLACES or not isinstance(params, list) or len(params) < 7:
            self.skipped.append(f"command {str(command)[:20]}")
            return
        lat, lon = params[4], params[5]
        if not _is_number(lat) or not _is_number(lon) or (lat == 0.0 and lon == 0.0):
            self.skipped.append(f"{PLACES[command]} without a place")
            return
        name = f"W{len(self.points) + 1}"
        height = self._height(name, item.get("frame"), params[6])
        self.points.append(place_of("Point", [lon, lat], name, {"what": PLACES[command], **height}))
        self.way.append([lon, lat])

    def above_home(self, up_m: float, name: str = "rally points") -> dict[str, object]:
        """Metres above the place of take-off as an altitude, when that is known."""
        if math.isfinite(self._home_m) and math.isfinite(up_m):
            return {"altitude_m": self._home_m + up_m, "altitude_datum": "msl"}
        if name not in self.no_home:
            self.no_home.append(name)
        return {}

    def _height(self, name: str, frame: object, up: object) -> dict[str, object]:
        if not _is_number(up):
            self.skipped.append("height that is no number")
            return {}
        up_m = float(str(up))
        frame = frame if isinstance(frame, int) else None
        if frame in SEA_LEVEL:
            return {"altitude_m": up_m, "altitude_datum": "msl"}
        if frame in TERRAIN:
            return {"above_ground_m": up_m}
        if frame in HOME:
            return self.above_home(up_m, name)
        self.skipped.append(f"height in frame {str(frame)[:20]}")
        return {}

    def _pattern(self, item: Mapping[str, Any]) -> None:
        kind = str(item.get("complexItemType", item.get("type")))[:40]
        for member, geometry in (("polygon", "Polygon"), ("polyline", "LineString")):
            if isinstance(item.get(member), list):
                self._allowance.take(len(item[member]))
                line = [[lon, lat] for lat, lon, *_ in (_numbers(one, self._called) for one in item[member])]
                coordinates: object = [_closed(line)] if geometry == "Polygon" else line
                self.others.append(place_of(geometry, coordinates, kind, {"what": kind}))
                return
        self.skipped.append(kind)


def _fence(number: int, polygon: Any, called: str) -> Feature:
    if not isinstance(polygon, dict):
        raise RequestError(f"{called} has a fence that is none.")
    ring = [[lon, lat] for lat, lon, *_ in (_numbers(one, called) for one in _list(polygon, "polygon"))]
    what = "keep-in" if polygon.get("inclusion") else "no-go"
    return place_of("Polygon", [_closed(ring)], f"fence {number}", {"what": what})


def _circle(number: int, circle: Any, called: str) -> Feature:
    """A fence round a place, as a polygon that lies round it."""
    round_it = circle.get("circle") if isinstance(circle, dict) else None
    if not isinstance(round_it, dict) or not _is_number(round_it.get("radius")):
        raise RequestError(f"{called} has a round fence without centre and radius.")
    lat, lon, *_ = _numbers(round_it.get("center"), called)
    outside_m = float(round_it["radius"]) / math.cos(math.pi / CORNERS)
    azimuths = [360.0 * corner / CORNERS for corner in range(CORNERS)]
    east, north, _ = WGS84.fwd([lon] * CORNERS, [lat] * CORNERS, azimuths, [outside_m] * CORNERS)
    ring = [[float(x), float(y)] for x, y in zip(east, north, strict=True)]
    what = "keep-in" if circle.get("inclusion") else "no-go"
    return place_of("Polygon", [_closed(ring)], f"round fence {number}", {"what": what})


def _closed(ring: list[list[float]]) -> list[list[float]]:
    return ring if ring and ring[0] == ring[-1] else [*ring, *ring[:1]]


def _part(document: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    part = document.get(name)
    return part if isinstance(part, dict) else {}


def _list(part: Any, name: str) -> Sequence[Any]:
    listed = part.get(name) if isinstance(part, dict) else None
    return listed if isinstance(listed, list) else ()


def _numbers(at: Any, called: str) -> list[float]:
    if not isinstance(at, list) or len(at) < 2 or not all(_is_number(one) for one in at[:2]):
        raise RequestError(f"{called} has a place that has not two coordinates: {str(at)[:60]}.")
    return [float(one) if _is_number(one) else math.nan for one in at]


def _is_number(value: object) -> TypeGuard[float]:
    # a comparison, for a whole number may be too large for isfinite
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
