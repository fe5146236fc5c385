"""The files of planned flights: GeoJSON with altitudes, the air along them, a mission, pictures; the list of all."""

from __future__ import annotations

import math
from pathlib import Path

from service.files.geojson import write_collection
from service.files.layer import GEOJSON, PNG, Layer
from service.files.missions import MISSIONS, sea_level_m
from service.files.qgroundcontrol import COPTER, TAKE_OFF, WAYPOINT, PlanItem, plan_text
from service.files.tables import TableWriter
from service.products.flights.answer import AirPlaceOut
from service.products.flights.calculate import AIR_COLUMNS, FinishedFlight
from terrain import to_lon_lat

__all__ = ["LAYERS"]

Json = dict[str, object]
DECIMALS_DEG, DECIMALS_M = 8, 3
FOUND = "found"
(PLAN,) = MISSIONS["flight"]


def _write_geojson(finished: FinishedFlight, path: Path) -> None:
    """A FeatureCollection in longitude, latitude and altitude; without a CRS in the DEM's local metres, and says so."""
    answer = finished.answer
    if answer.totals is None:
        features = [
            _point(finished, place, {"what": what, "status": answer.status})
            for what, place in (("start", answer.start), ("goal", answer.goal))
        ]
    else:
        told = answer.model_dump(mode="json", include={"status", "sentence", "cost"})
        line = [_coordinates(finished, corner) for corner in answer.corners]
        features = [
            _feature("LineString", line, {"what": "flight", **told, **answer.totals.model_dump()}),
            *(
                # east and north are told by the geometry
                _point(
                    finished,
                    corner,
                    {"what": "corner", "number": number, **corner.model_dump(exclude={"east_m", "north_m"})},
                )
                for number, corner in enumerate(answer.corners)
            ),
        ]
    write_collection(finished.grid, features, path)


def _write_csv(finished: FinishedFlight, path: Path) -> None:
    """A row per step; an empty cell is no number: no morphing map, no ceiling."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = TableWriter(file)
        table.row(AIR_COLUMNS)
        for row in finished.air.tolist():
            table.row([round(value, DECIMALS_M) if math.isfinite(value) else "" for value in row])


def _write_plan(finished: FinishedFlight, path: Path) -> None:
    """Take-off to the first corner, then a way-point for each. Raises FrameError for a DEM without CRS."""
    items = []
    corners = finished.answer.corners
    at = ([corner.east_m for corner in corners], [corner.north_m for corner in corners])
    altitudes_m = sea_level_m(finished.grid, *at, [corner.altitude_m for corner in corners])
    for number, (corner, altitude_m) in enumerate(zip(corners, altitudes_m.round(DECIMALS_M).tolist(), strict=True)):
        lon_deg, lat_deg, _ = _coordinates(finished, corner)
        items.append(PlanItem(WAYPOINT if number else TAKE_OFF, lon_deg, lat_deg, altitude_m))
    speed_m_per_s = finished.parameters.speed_m_per_s
    text = plan_text(items, items[0], vehicle=COPTER, cruise_m_per_s=speed_m_per_s, hover_m_per_s=speed_m_per_s)
    path.write_text(text, encoding="utf-8")


def _coordinates(finished: FinishedFlight, at: AirPlaceOut) -> list[float]:
    altitude_m = round(at.altitude_m, DECIMALS_M)
    if finished.grid.crs is None:
        return [round(at.east_m, DECIMALS_M), round(at.north_m, DECIMALS_M), altitude_m]
    lon_deg, lat_deg = to_lon_lat(finished.grid, at.east_m, at.north_m)
    return [round(float(lon_deg), DECIMALS_DEG), round(float(lat_deg), DECIMALS_DEG), altitude_m]


def _point(finished: FinishedFlight, at: AirPlaceOut, properties: Json) -> Json:
    return _feature("Point", _coordinates(finished, at), properties)


def _feature(kind: str, coordinates: list[float] | list[list[float]], properties: Json) -> Json:
    return {"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties}


# matplotlib takes a second to load, and only a process that draws needs it


def _write_picture(finished: FinishedFlight, path: Path) -> None:
    from .picture import write_flight_picture

    write_flight_picture(finished, path)


def _write_profile(finished: FinishedFlight, path: Path) -> None:
    from .picture import write_flight_profile

    write_flight_profile(finished, path)


LAYERS = (
    Layer(
        "flight.geojson",
        GEOJSON,
        "The flight as a LineString with altitudes and totals, and each corner as a point; without a flight its ends.",
        _write_geojson,
    ),
    Layer(
        "flight.csv",
        "text/csv; charset=utf-8",
        "The air along the flight at fine steps, metres: flown, altitude, ground, floor, ceiling, distance to ground.",
        _write_csv,
        status=FOUND,
    ),
    Layer(
        "flight.plan",
        "application/json",
        "The corners of the flight as a QGroundControl mission for a drone. On Earth, above sea level.",
        _write_plan,
        status=FOUND,
        mission=PLAN,
    ),
    Layer("map.png", PNG, "The flight over shaded relief.", _write_picture),
    Layer(
        "profile.png",
        PNG,
        "Altitude over the ground, between the morphing map and the ceiling, and the distance to the ground.",
        _write_profile,
        status=FOUND,
    ),
)
