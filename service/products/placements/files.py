"""Placed anchors as files for other programs: GeoJSON, CSV, QGroundControl plans, beacon parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from service.files.geojson import write_collection
from service.files.missions import above_sea_level
from service.files.qgroundcontrol import LOITER, TAKE_OFF, WAYPOINT, PlanItem, plan_text, zip_plans
from service.files.tables import TableWriter
from service.products.placements.calculate import FinishedPlacement
from terrain import height_at, to_lon_lat, true_offsets

__all__ = ["plan_texts", "write_beacons", "write_csv", "write_geojson", "write_plans"]

CLEAR_OF_GROUND_M = 10.0


def write_geojson(finished: FinishedPlacement, path: Path) -> None:
    """A FeatureCollection in longitude and latitude; without a CRS in the DEM's local metres, and says so.

    Its properties hold what an anchor is measured with as well, so that the file can be the next question's anchors.
    """
    grid, measured_with = finished.grid, _measured_with(finished)
    features = []
    for placed in finished.answer["placed"]:
        position = (placed["east_m"], placed["north_m"])
        properties = {key: value for key, value in placed.items() if key not in ("east_m", "north_m", "above_ground_m")}
        features.append(
            {
                "type": "Feature",
                "id": placed["id"],
                "geometry": {
                    "type": "Point",
                    "coordinates": position if grid.crs is None else to_lon_lat(grid, *position),
                },
                "properties": properties | measured_with,
            }
        )
    write_collection(grid, features, path, indent=1)


def write_csv(finished: FinishedPlacement, path: Path) -> None:
    """id, east_m, north_m, altitude_m, ranging_sigma_m, and max_range_m where there is one."""
    measured_with = _measured_with(finished)
    with path.open("w", encoding="utf-8", newline="") as file:
        names = ["id", "east_m", "north_m", "altitude_m", *measured_with]
        TableWriter(file).rows(names, ({**placed, **measured_with} for placed in finished.answer["placed"]))


def plan_texts(finished: FinishedPlacement) -> dict[str, str]:
    """The text of each drone's .plan by its file name. Raises FrameError for a DEM without CRS."""
    by_sea = above_sea_level(finished.grid)
    return {
        f"{placed['id']}.plan": _plan(finished, placed) if by_sea else _plan_above_ground(finished, placed)
        for placed in finished.answer["placed"]
        if placed["what"] != "mast" and (by_sea or placed["above_ground_m"] is not None)
    }


def write_plans(finished: FinishedPlacement, path: Path) -> None:
    """All of them in a zip. Raises FrameError for a DEM without CRS."""
    zip_plans(plan_texts(finished), path)


def write_beacons(finished: FinishedPlacement, path: Path) -> None:
    """ArduPilot's BCN_* parameters: the origin is the first anchor's place on the ground. Raises FrameError."""
    grid, placed = finished.grid, finished.answer["placed"]
    first = placed[0]
    origin_altitude_m = first["altitude_m"] - (first["above_ground_m"] or 0.0)
    origin_m = first["east_m"], first["north_m"]
    lon_deg, lat_deg = to_lon_lat(grid, *origin_m)
    # turned here: the parameter that would turn them on board, BCN_ORIENT_YAW, holds whole degrees only (AP_Int16)
    along = true_offsets(grid, origin_m, *([one[name] for one in placed] for name in ("east_m", "north_m")))
    lines = [
        "# Origin of the beacons; offsets are metres over ground from it to true north, to the east, and down.",
        f"BCN_LATITUDE,{lat_deg:.7f}",
        f"BCN_LONGITUDE,{lon_deg:.7f}",
        f"BCN_ALT,{origin_altitude_m:.2f}",
        "BCN_ORIENT_YAW,0",
    ]
    for number, (one, east_m, north_m) in enumerate(zip(placed, *along, strict=True)):
        lines.append(
            f"# beacon {number}, {one['id']}: {north_m:.2f}, {east_m:.2f}, {origin_altitude_m - one['altitude_m']:.2f}"
        )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _measured_with(finished: FinishedPlacement) -> dict[str, float]:
    """ranging_sigma_m of every placed anchor, and max_range_m where ranges have a limit."""
    goal, rules = finished.parameters.goal, finished.parameters.rules
    limit = {} if rules.max_range_m is None else {"max_range_m": rules.max_range_m}
    return {"ranging_sigma_m": goal.ranging_sigma_m, **limit}


def _plan(finished: FinishedPlacement, placed: dict[str, Any]) -> str:
    """Take off straight up from the ground below, or from the base where there is one, fly there, and hold."""
    grid = finished.grid
    lon_deg, lat_deg = to_lon_lat(grid, placed["east_m"], placed["north_m"])
    ground_m = float(height_at(grid, placed["east_m"], placed["north_m"]))
    altitude_m = placed["altitude_m"]
    home_m = ground_m if ground_m == ground_m else altitude_m  # over unknown ground home is where it hovers
    home = PlanItem(TAKE_OFF, lon_deg, lat_deg, home_m)
    items = [
        PlanItem(TAKE_OFF, lon_deg, lat_deg, max(altitude_m, home_m + CLEAR_OF_GROUND_M)),
        PlanItem(WAYPOINT, lon_deg, lat_deg, altitude_m),
        PlanItem(LOITER, lon_deg, lat_deg, altitude_m),
    ]
    return plan_text(items, home)


def _plan_above_ground(finished: FinishedPlacement, placed: dict[str, Any]) -> str:
    """The same with heights above the ground, where none above sea level is known."""
    lon_deg, lat_deg = to_lon_lat(finished.grid, placed["east_m"], placed["north_m"])
    height_m = placed["above_ground_m"]
    items = [
        PlanItem(TAKE_OFF, lon_deg, lat_deg, max(height_m, CLEAR_OF_GROUND_M)),
        PlanItem(WAYPOINT, lon_deg, lat_deg, height_m),
        PlanItem(LOITER, lon_deg, lat_deg, height_m),
    ]
    return plan_text(items, items[0], above_ground=True)
