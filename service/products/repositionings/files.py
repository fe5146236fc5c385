"""Moves of drones as files for other programs: GeoJSON, CSV, QGroundControl plans."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from service.files.geojson import write_collection
from service.files.qgroundcontrol import LOITER, WAYPOINT, PlanItem, plan_text, zip_plans
from service.files.tables import TableWriter
from service.products.repositionings.calculate import FinishedRepositioning
from terrain import ElevationGrid, to_lon_lat

__all__ = ["move_plan_texts", "write_anchors_after", "write_moves", "write_plans", "write_schedule"]

PLACE = ("east_m", "north_m", "altitude_m")
COLUMNS = (
    *("anchor_id", "start_s", "end_s", "flight_m", "flight_s", "stretch"),
    *("from_east_m", "from_north_m", "from_altitude_m", "to_east_m", "to_north_m", "to_altitude_m"),
)


def write_moves(finished: FinishedRepositioning, path: Path) -> None:
    """A FeatureCollection in longitude and latitude; without a CRS in the DEM's local metres, and says so."""
    grid = finished.grid
    features = []
    for move in finished.answer["moves"]:
        ends = [(move[end]["east_m"], move[end]["north_m"]) for end in ("from", "to")]
        features.append(
            {
                "type": "Feature",
                "geometry": {
                    "type": "LineString",
                    "coordinates": ends if grid.crs is None else [to_lon_lat(grid, *end) for end in ends],
                },
                "properties": {
                    **{name: value for name, value in move.items() if name not in ("from", "to")},
                    "from_altitude_m": move["from"]["altitude_m"],
                    "to_altitude_m": move["to"]["altitude_m"],
                },
            }
        )
    write_collection(grid, features, path, indent=1)


def write_schedule(finished: FinishedRepositioning, path: Path) -> None:
    """A row per move, by departure."""
    with path.open("w", encoding="utf-8", newline="") as file:
        moves = sorted(finished.answer["moves"], key=lambda move: (move["start_s"], move["anchor_id"]))
        ends = [{f"{end}_{name}": move[end][name] for end in ("from", "to") for name in PLACE} for move in moves]
        TableWriter(file).rows(COLUMNS, ({**move, **at} for move, at in zip(moves, ends, strict=True)))


def write_anchors_after(finished: FinishedRepositioning, path: Path) -> None:
    """id, east_m, north_m, altitude_m, ranging_sigma_m of every anchor."""
    sigma_m = {anchor.id: anchor.ranging_sigma_m for anchor in finished.anchors}
    with path.open("w", encoding="utf-8", newline="") as file:
        names = ("id", *PLACE, "ranging_sigma_m")
        anchors = finished.answer["anchors"]
        TableWriter(file).rows(names, ({**one, "ranging_sigma_m": sigma_m[one["id"]]} for one in anchors))


def move_plan_texts(finished: FinishedRepositioning) -> dict[str, str]:
    """The text of each moving drone's .plan by its file name. Raises FrameError for a DEM without CRS."""
    by_drone: dict[str, list[dict[str, Any]]] = {}
    for move in finished.answer["moves"]:
        by_drone.setdefault(move["anchor_id"], []).append(move)
    return {f"{drone}.plan": _plan(finished.grid, moves) for drone, moves in by_drone.items()}


def write_plans(finished: FinishedRepositioning, path: Path) -> None:
    """All of them in a zip. Raises FrameError for a DEM without CRS."""
    zip_plans(move_plan_texts(finished), path)


def _plan(grid: ElevationGrid, moves: list[dict[str, Any]]) -> str:
    """Hold until it is time, climb to the level that clears the ground, fly across, descend; at the end, stay."""
    items: list[PlanItem] = []
    arrived_s = 0.0
    for move in moves:
        start, end = move["from"], move["to"]
        level_m = _level_m(move)
        (at_lon, at_lat), (to_lon, to_lat) = (
            to_lon_lat(grid, place["east_m"], place["north_m"]) for place in (start, end)
        )
        hold_s = max(0.0, round(move["start_s"] - arrived_s, 1))
        items += [
            PlanItem(WAYPOINT, at_lon, at_lat, start["altitude_m"], hold_s),
            PlanItem(WAYPOINT, at_lon, at_lat, level_m),
            PlanItem(WAYPOINT, to_lon, to_lat, level_m),
            PlanItem(WAYPOINT, to_lon, to_lat, end["altitude_m"]),
        ]
        arrived_s = move["end_s"]
    last = items[-1]
    items.append(PlanItem(LOITER, last.lon_deg, last.lat_deg, last.altitude_m))
    return plan_text(items, items[0])


def _level_m(move: dict[str, Any]) -> float:
    """Altitude of the level part: what the flight is longer than the way across is climb and descent."""
    start, end = move["from"], move["to"]
    across_m = math.hypot(end["east_m"] - start["east_m"], end["north_m"] - start["north_m"])
    both_m: float = move["flight_m"] - across_m + start["altitude_m"] + end["altitude_m"]
    return both_m / 2.0
