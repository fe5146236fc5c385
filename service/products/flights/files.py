"""The files of planned flights: GeoJSON with altitudes, the air along them, a mission, pictures; the list of all."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import shapely

from service.files.csv_table import TableWriter
from service.files.geojson import Feature, feature, place_of, write_collection
from service.files.layer import GEOJSON, KML, PNG, Layer
from service.files.mission_files import COPTER, MISSIONS, TAKE_OFF, WAYPOINT, PlanItem, plan_text, sea_level_m
from service.parts.map_facts import altitude_datum_of, dem_name
from service.products.flights.calculate import AIR_COLUMNS, AirPlaceOut, FinishedFlight
from service.products.in_common import Drawn

__all__ = ["LAYERS"]

DECIMALS_M = 3
FOUND = "found"
PLAN, KML_OF_FLIGHT = MISSIONS["flight"]


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
            feature("LineString", line, {"what": "flight", **told, **answer.totals.model_dump()}),
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
    """A row per step; an empty cell is no number: no morphing map, no ceiling. Altitudes name their datum."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table, datum = TableWriter(file), altitude_datum_of(finished.grid)
        table.row([*AIR_COLUMNS, *datum])
        for row in finished.air.tolist():
            numbers = [round(value, DECIMALS_M) if math.isfinite(value) else "" for value in row]
            table.row([*numbers, *datum.values()])


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


def _write_kml(finished: FinishedFlight, path: Path) -> None:
    """The flight and its corners, above mean sea level. Raises FrameError for a DEM without CRS."""
    from service.files.kml import Mark, write_kml  # its library takes a while to load

    grid, answer = finished.grid, finished.answer
    totals = {} if answer.totals is None else answer.totals.model_dump()
    told = {"status": answer.status.value, "sentence": answer.sentence, **totals}
    corners = [
        Mark(f"C{number}", shapely.Point(at_m), "altitude", {"time_s": round(corner.time_s, 1)})
        for number, (at_m, corner) in enumerate(zip(finished.corners_m, answer.corners, strict=True))
    ]
    flight = Mark("flight", shapely.LineString(finished.corners_m), "altitude", told)
    write_kml(grid, f"Flight over {dem_name(grid)}", {"Flight": [flight], "Corners": corners}, path)


def _coordinates(finished: FinishedFlight, at: AirPlaceOut) -> list[float]:
    return [*place_of(finished.grid, at.east_m, at.north_m), round(at.altitude_m, DECIMALS_M)]


def _point(finished: FinishedFlight, at: AirPlaceOut, properties: Mapping[str, object]) -> Feature:
    return feature("Point", _coordinates(finished, at), properties)


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
    Layer(
        "flight.kml",
        KML,
        "The flight and its corners as KML, above mean sea level; on Earth.",
        _write_kml,
        status=FOUND,
        mission=KML_OF_FLIGHT,
    ),
    Layer("map.png", PNG, "The flight over shaded relief.", Drawn("service.products.flights.picture:draw_flight")),
    Layer(
        "profile.png",
        PNG,
        "Altitude over ground, roofs and trees, under the ceiling and over the morphing map; distance to the ground.",
        Drawn("service.products.flights.picture:draw_flight_profile"),
        status=FOUND,
    ),
)
