"""The files of repositionings: moves as GeoJSON, CSV and QGroundControl plans, a picture; and the list of all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely

from planning.placement import flight_level_m
from service.files.csv_table import TableWriter
from service.files.geojson import coordinates_of, feature, write_collection
from service.files.layer import GEOJSON, KML, PNG, Layer
from service.files.mission_files import LOITER, MISSIONS, WAYPOINT, PlanItem, plan_text, sea_level_m, zip_plans
from service.parts.map_facts import altitude_datum_of, dem_name
from service.parts.positioning_answers import PlacedAnchor
from service.products.in_common import Drawn
from terrain import ElevationGrid, to_lon_lat

from .calculate import FinishedRepositioning, MoveOut

__all__ = ["LAYERS"]

AHEAD_COLOUR = "#2c5f9e"
COLUMNS = (
    *("anchor_id", "start_s", "end_s", "flight_m", "flight_s", "stretch"),
    *("from_east_m", "from_north_m", "from_altitude_m", "to_east_m", "to_north_m", "to_altitude_m"),
)
PLANS, KML_OF_MOVES = MISSIONS["repositioning"]


def _write_moves(finished: FinishedRepositioning, path: Path) -> None:
    """A FeatureCollection in longitude and latitude; without a CRS in the DEM's local metres, and says so."""
    grid = finished.grid
    features = []
    for move in finished.answer.moves:
        line = coordinates_of(grid, np.array([_place_m(move.from_)[:2], _place_m(move.to)[:2]]))
        heights = {"from_altitude_m": move.from_.altitude_m, "to_altitude_m": move.to.altitude_m}
        features.append(feature("LineString", line, move.model_dump(exclude={"from_", "to"}) | heights))
    write_collection(grid, features, path, indent=1)


def _write_schedule(finished: FinishedRepositioning, path: Path) -> None:
    """A row per move, by departure."""
    with path.open("w", encoding="utf-8", newline="") as file:
        moves = sorted(finished.answer.moves, key=lambda move: (move.start_s, move.anchor_id))
        ends = [_placed("from", move.from_) | _placed("to", move.to) for move in moves]
        datum = altitude_datum_of(finished.grid)
        rows = (move.model_dump() | at | datum for move, at in zip(moves, ends, strict=True))
        TableWriter(file).rows((*COLUMNS, *datum), rows)


def _placed(which: str, at: PlacedAnchor) -> dict[str, float]:
    return {f"{which}_east_m": at.east_m, f"{which}_north_m": at.north_m, f"{which}_altitude_m": at.altitude_m}


def _write_anchors_after(finished: FinishedRepositioning, path: Path) -> None:
    """id, east_m, north_m, altitude_m, ranging_sigma_m of every anchor, and what altitudes count from where known."""
    sigma_m = {anchor.id: anchor.ranging_sigma_m for anchor in finished.anchors}
    with path.open("w", encoding="utf-8", newline="") as file:
        datum = altitude_datum_of(finished.grid)
        names = ("id", "east_m", "north_m", "altitude_m", *datum, "ranging_sigma_m")
        rows = (one.model_dump() | datum | {"ranging_sigma_m": sigma_m[one.id]} for one in finished.answer.anchors)
        TableWriter(file).rows(names, rows)


def _plan_texts(finished: FinishedRepositioning) -> dict[str, str]:
    """The text of each moving drone's .plan by its file name. Raises FrameError for a DEM without CRS."""
    by_drone: dict[str, list[MoveOut]] = {}
    for move in finished.answer.moves:
        by_drone.setdefault(move.anchor_id, []).append(move)
    return {f"{drone}.plan": _plan(finished.grid, moves) for drone, moves in by_drone.items()}


def _write_plans(finished: FinishedRepositioning, path: Path) -> None:
    """All of them in a zip. Raises FrameError for a DEM without CRS."""
    zip_plans(_plan_texts(finished), path)


def _corners(move: MoveOut) -> list[tuple[PlacedAnchor, float]]:
    """Up to the level that clears the ground, across and down: over which end, how high in the DEM's datum."""
    start, end = move.from_, move.to
    level_m = flight_level_m(_place_m(start), _place_m(end), move.flight_m)
    return [(start, start.altitude_m), (start, level_m), (end, level_m), (end, end.altitude_m)]


def _write_kml(finished: FinishedRepositioning, path: Path) -> None:
    """The moves through the air, the anchors after them, and the path ahead. Raises FrameError."""
    from service.files.kml import ANCHORS, Mark, anchor_mark, write_kml  # its library takes a while to load

    grid, answer = finished.grid, finished.answer
    moves = []
    for move in answer.moves:
        way = shapely.LineString([(at.east_m, at.north_m, altitude_m) for at, altitude_m in _corners(move)])
        moves.append(Mark(move.anchor_id, way, "altitude", move.model_dump(exclude={"from_", "to"})))
    after = [
        anchor_mark(grid, one.id, (one.east_m, one.north_m, one.altitude_m), one.above_ground_m, {})
        for one in answer.anchors
    ]
    ahead = Mark("path ahead", shapely.LineString(finished.point_m[:, :2]), colour=AHEAD_COLOUR)
    folders = {"Moves": moves, ANCHORS: after, "Path ahead": [ahead]}
    write_kml(grid, f"Moves over {dem_name(grid)}", folders, path)


def _plan(grid: ElevationGrid, moves: list[MoveOut]) -> str:
    """Hold until it is time, climb to the level that clears the ground, fly across, descend; at the end, stay."""
    steps: list[tuple[PlacedAnchor, float, float]] = []  # where, how high in the DEM's datum, how long
    arrived_s = 0.0
    for move in moves:
        hold_s = max(0.0, round(move.start_s - arrived_s, 1))
        waits_s = (hold_s, 0.0, 0.0, 0.0)
        steps += [(*corner, wait_s) for corner, wait_s in zip(_corners(move), waits_s, strict=True)]
        arrived_s = move.end_s
    places = ([at.east_m for at, _, _ in steps], [at.north_m for at, _, _ in steps])
    lon_deg, lat_deg = to_lon_lat(grid, *places)
    up_m = sea_level_m(grid, *places, [altitude_m for _, altitude_m, _ in steps])
    rows = zip(lon_deg.tolist(), lat_deg.tolist(), up_m.tolist(), steps, strict=True)
    items = [PlanItem(WAYPOINT, lon, lat, altitude_m, step[2]) for lon, lat, altitude_m, step in rows]
    last = items[-1]
    items.append(PlanItem(LOITER, last.lon_deg, last.lat_deg, last.altitude_m))
    return plan_text(items, items[0])


def _place_m(at: PlacedAnchor) -> tuple[float, float, float]:
    return at.east_m, at.north_m, at.altitude_m


LAYERS = (
    Layer(
        "moves.geojson",
        GEOJSON,
        "Each move as a line from where the drone stood to where it goes, with metres, seconds and times.",
        _write_moves,
    ),
    Layer(
        "schedule.csv",
        "text/csv; charset=utf-8",
        "A row per move in the order of departure: who, from, to, when, how far.",
        _write_schedule,
    ),
    Layer(
        "anchors.csv",
        "text/csv; charset=utf-8",
        "All anchors after the last move, as a table that --anchors reads: metres in the DEM's CRS.",
        _write_anchors_after,
    ),
    Layer(
        "plans.zip",
        "application/zip",
        "A QGroundControl .plan file for each drone that moves: up, across, down, hold. On Earth, above sea level.",
        _write_plans,
        mission=PLANS,
    ),
    Layer(
        "moves.kml",
        KML,
        "The moves through the air as KML, above mean sea level, the anchors after them and the path; on Earth.",
        _write_kml,
        mission=KML_OF_MOVES,
    ),
    Layer(
        "map.png",
        PNG,
        "The path with what is restored of it, and the moves, over shaded relief.",
        Drawn("service.products.repositionings.picture:draw_repositioning"),
    ),
)
