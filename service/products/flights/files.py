"""Planned flights as files: GeoJSON with altitudes, a table of the air along them, a QGroundControl mission."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from service.files.geojson import write_collection
from service.files.qgroundcontrol import COPTER, TAKE_OFF, WAYPOINT, PlanItem, plan_text
from service.files.tables import TableWriter
from service.products.flights.calculate import AIR_COLUMNS, FinishedFlight
from terrain import to_lon_lat

__all__ = ["write_csv", "write_geojson", "write_plan"]

DECIMALS_DEG, DECIMALS_M = 8, 3
PLACE = ("east_m", "north_m")


def write_geojson(finished: FinishedFlight, path: Path) -> None:
    """A FeatureCollection in longitude, latitude and altitude; without a CRS in the DEM's local metres, and says so."""
    answer = finished.answer
    if answer["totals"] is None:
        features = [_point(finished, answer[what], {"what": what, "status": answer["status"]}) for what in _ENDS]
    else:
        told = {key: answer[key] for key in ("status", "sentence", "cost")}
        line = [_coordinates(finished, corner) for corner in answer["corners"]]
        features = [
            _feature("LineString", line, {"what": "flight", **told, **answer["totals"]}),
            *(
                _point(finished, corner, {"what": "corner", "number": number, **_rest(corner)})
                for number, corner in enumerate(answer["corners"])
            ),
        ]
    write_collection(finished.grid, features, path)


def write_csv(finished: FinishedFlight, path: Path) -> None:
    """A row per step; an empty cell is no number: no morphing map, no ceiling."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = TableWriter(file)
        table.row(AIR_COLUMNS)
        for row in finished.air.tolist():
            table.row([round(value, DECIMALS_M) if math.isfinite(value) else "" for value in row])


def write_plan(finished: FinishedFlight, path: Path) -> None:
    """Take-off to the first corner, then a way-point for each. Raises FrameError for a DEM without CRS."""
    items = []
    for number, corner in enumerate(finished.answer["corners"]):
        lon_deg, lat_deg, altitude_m = _coordinates(finished, corner)
        items.append(PlanItem(WAYPOINT if number else TAKE_OFF, lon_deg, lat_deg, altitude_m))
    speed_m_per_s = finished.parameters.speed_m_per_s
    text = plan_text(items, items[0], vehicle=COPTER, cruise_m_per_s=speed_m_per_s, hover_m_per_s=speed_m_per_s)
    path.write_text(text, encoding="utf-8")


_ENDS = ("start", "goal")


def _coordinates(finished: FinishedFlight, at: dict[str, float]) -> list[float]:
    east_m, north_m, altitude_m = at["east_m"], at["north_m"], round(at["altitude_m"], DECIMALS_M)
    if finished.grid.crs is None:
        return [round(east_m, DECIMALS_M), round(north_m, DECIMALS_M), altitude_m]
    lon_deg, lat_deg = to_lon_lat(finished.grid, east_m, north_m)
    return [round(float(lon_deg), DECIMALS_DEG), round(float(lat_deg), DECIMALS_DEG), altitude_m]


def _rest(corner: dict[str, float]) -> dict[str, float]:
    """What the geometry does not tell."""
    return {key: value for key, value in corner.items() if key not in PLACE}


def _point(finished: FinishedFlight, at: dict[str, float], properties: dict[str, Any]) -> dict[str, Any]:
    return _feature("Point", _coordinates(finished, at), properties)


def _feature(kind: str, coordinates: Any, properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties}
