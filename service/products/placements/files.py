"""The files of placements: GeoJSON, CSV, QGroundControl plans, beacon parameters, rasters, pictures; and their list."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from service.files.csv_table import TableWriter
from service.files.geojson import feature, place_of, write_collection
from service.files.layer import COG, GEOJSON, KML, PNG, Layer
from service.files.mission_files import (
    LOITER,
    MISSIONS,
    TAKE_OFF,
    WAYPOINT,
    PlanItem,
    above_sea_level,
    plan_text,
    sea_level_m,
    zip_plans,
)
from service.parts.map_facts import altitude_datum_of, dem_name
from service.parts.positioning_answers import PlacedAnchor
from service.products.in_common import Drawn, Raster, common_tags
from terrain import to_lon_lat, true_offsets

from .answer import FinishedPlacement, PlacedOut

__all__ = ["LAYERS"]

CLEAR_OF_GROUND_M = 10.0
NO_GROUND = 255
NO_FLY_COLOUR = "#c01818"
BANDS = ["before", "after"]
PLANS, BEACONS, KML_OF_PLACEMENT = MISSIONS["placement"]


def _write_geojson(finished: FinishedPlacement, path: Path) -> None:
    """A FeatureCollection in longitude and latitude; without a CRS in the DEM's local metres, and says so.

    Its properties hold what an anchor is measured with as well, so that the file can be the next question's anchors.
    """
    grid, measured_with = finished.grid, _measured_with(finished)
    features = []
    for placed in finished.answer.placed:
        worth = placed.model_dump(exclude={"id", "what", "east_m", "north_m", "altitude_m", "above_ground_m"})
        told = {"id": placed.id, "altitude_m": placed.altitude_m, **altitude_datum_of(grid), "what": placed.what}
        features.append(
            feature("Point", place_of(grid, placed.east_m, placed.north_m), told | worth | measured_with, placed.id)
        )
    write_collection(grid, features, path, indent=1)


def _write_csv(finished: FinishedPlacement, path: Path) -> None:
    """id, east_m, north_m, altitude_m, what that counts from where it is known, ranging_sigma_m, max_range_m if any."""
    measured_with = altitude_datum_of(finished.grid) | _measured_with(finished)
    with path.open("w", encoding="utf-8", newline="") as file:
        names = ["id", "east_m", "north_m", "altitude_m", *measured_with]
        TableWriter(file).rows(names, ({**placed.model_dump(), **measured_with} for placed in finished.answer.placed))


def _plan_texts(finished: FinishedPlacement) -> dict[str, str]:
    """The text of each drone's .plan by its file name. Raises FrameError for a DEM without CRS."""
    by_sea = above_sea_level(finished.grid) and finished.parameters.plan_altitudes == "sea level"
    return {
        f"{placed.id}.plan": _plan(finished, placed) if by_sea else _plan_above_ground(finished, placed)
        for placed in finished.answer.placed
        if placed.what != "mast" and (by_sea or placed.above_ground_m is not None)
    }


def _write_plans(finished: FinishedPlacement, path: Path) -> None:
    """All of them in a zip. Raises FrameError for a DEM without CRS."""
    zip_plans(_plan_texts(finished), path)


def _write_beacons(finished: FinishedPlacement, path: Path) -> None:
    """ArduPilot's BCN_* parameters: the origin is the first anchor's place on the ground. Raises FrameError."""
    grid, placed = finished.grid, finished.answer.placed
    first = placed[0]
    origin_altitude_m = first.altitude_m - (first.above_ground_m or 0.0)
    origin_m = first.east_m, first.north_m
    lon_deg, lat_deg = to_lon_lat(grid, *origin_m)
    # turned here: the parameter that would turn them on board, BCN_ORIENT_YAW, holds whole degrees only (AP_Int16)
    along = true_offsets(grid, origin_m, [one.east_m for one in placed], [one.north_m for one in placed])
    lines = [
        "# Origin of the beacons; offsets are metres over ground from it to true north, to the east, and down.",
        f"BCN_LATITUDE,{lat_deg:.7f}",
        f"BCN_LONGITUDE,{lon_deg:.7f}",
        f"BCN_ALT,{sea_level_m(grid, *origin_m, origin_altitude_m)[0]:.2f}",
        "BCN_ORIENT_YAW,0",
    ]
    for number, (one, east_m, north_m) in enumerate(zip(placed, *along, strict=True)):
        lines.append(
            f"# beacon {number}, {one.id}: {north_m:.2f}, {east_m:.2f}, {origin_altitude_m - one.altitude_m:.2f}"
        )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_kml(finished: FinishedPlacement, path: Path) -> None:
    """Placed anchors, those there before, and areas of the rules. Raises FrameError for a DEM without CRS."""
    from service.files.kml import ANCHORS, Mark, anchor_mark, area_marks, write_kml  # its library takes a while to load

    grid, answer, measured_with = finished.grid, finished.answer, _measured_with(finished)

    def mark(one: PlacedOut | PlacedAnchor, told: Mapping[str, object]) -> Mark:
        return anchor_mark(grid, one.id, (one.east_m, one.north_m, one.altitude_m), one.above_ground_m, told)

    placed = [mark(one, {"what": one.what, **measured_with}) for one in answer.placed]
    fixed = [mark(one, {}) for one in answer.fixed]
    no_fly = area_marks(grid, {"no_fly": finished.parameters.rules.no_fly}, NO_FLY_COLOUR)
    folders = {ANCHORS: placed, "Anchors there before": fixed, "No fly": no_fly}
    write_kml(grid, f"Anchors over {dem_name(grid)}", folders, path)


def _measured_with(finished: FinishedPlacement) -> dict[str, float]:
    """ranging_sigma_m of every placed anchor, and max_range_m where ranges have a limit."""
    goal, rules = finished.parameters.goal, finished.parameters.rules
    limit = {} if rules.max_range_m is None else {"max_range_m": rules.max_range_m}
    return {"ranging_sigma_m": goal.ranging_sigma_m, **limit}


def _plan(finished: FinishedPlacement, placed: PlacedOut) -> str:
    """Take off straight up from the ground below, or from the base where there is one, fly there, and hold."""
    grid = finished.grid
    lon_deg, lat_deg = to_lon_lat(grid, placed.east_m, placed.north_m)
    # over unknown ground home is where it hovers
    ups_m = [placed.altitude_m, placed.altitude_m - (placed.above_ground_m or 0.0)]
    altitude_m, home_m = sea_level_m(grid, placed.east_m, placed.north_m, ups_m).tolist()
    home = PlanItem(TAKE_OFF, lon_deg, lat_deg, home_m)
    items = [
        PlanItem(TAKE_OFF, lon_deg, lat_deg, max(altitude_m, home_m + CLEAR_OF_GROUND_M)),
        PlanItem(WAYPOINT, lon_deg, lat_deg, altitude_m),
        PlanItem(LOITER, lon_deg, lat_deg, altitude_m),
    ]
    return plan_text(items, home)


def _plan_above_ground(finished: FinishedPlacement, placed: PlacedOut) -> str:
    """The same with heights above the ground: asked for, or where none above sea level is known."""
    lon_deg, lat_deg = to_lon_lat(finished.grid, placed.east_m, placed.north_m)
    height_m = placed.above_ground_m
    assert height_m is not None, "others have no plan"
    items = [
        PlanItem(TAKE_OFF, lon_deg, lat_deg, max(height_m, CLEAR_OF_GROUND_M)),
        PlanItem(WAYPOINT, lon_deg, lat_deg, height_m),
        PlanItem(LOITER, lon_deg, lat_deg, height_m),
    ]
    return plan_text(items, items[0], above_ground=True)


def _tags(finished: FinishedPlacement) -> dict[str, str]:
    return common_tags(finished.grid, finished.answer, "sightline placement")


def _counts(finished: FinishedPlacement) -> list[npt.NDArray[np.uint8]]:
    no_ground = np.isnan(finished.grid.heights_m)
    return [np.where(no_ground, np.uint8(NO_GROUND), some) for some in (finished.count_before, finished.count_after)]


LAYERS = (
    Layer("anchors.geojson", GEOJSON, "The placed anchors as points, with what each adds.", _write_geojson),
    Layer(
        "anchors.csv",
        "text/csv; charset=utf-8",
        "The placed anchors as a table that --anchors reads: metres in the DEM's CRS.",
        _write_csv,
    ),
    Layer(
        "anchors.kml",
        KML,
        "The placed anchors as KML, above mean sea level or else above the ground; on Earth.",
        _write_kml,
        mission=KML_OF_PLACEMENT,
    ),
    Layer(
        "plans.zip",
        "application/zip",
        "A QGroundControl .plan file for each placed drone: take off, fly there, hold. On Earth.",
        _write_plans,
        mission=PLANS,
    ),
    Layer(
        "beacons.parm",
        "text/plain; charset=utf-8",
        "ArduPilot parameters of the beacons' origin, and each beacon's offset from it in metres: true north, "
        "east, down. On Earth, above sea level.",
        _write_beacons,
        mission=BEACONS,
    ),
    Layer(
        "count.tif",
        COG,
        "Band 1 how many anchors are surely in sight before, band 2 after; 255 (nodata) no ground.",
        Raster(_tags, _counts, lambda _: BANDS, "anchors", NO_GROUND),
    ),
    Layer(
        "dop.tif",
        COG,
        "float32: dilution of precision, band 1 before, band 2 after; +inf no fix, NaN (nodata) unknown.",
        Raster(
            *(_tags, lambda finished: (finished.dop_before, finished.dop_after), lambda _: BANDS),
            *("1", math.nan, "no fix"),
        ),
    ),
    Layer(
        "map.png",
        PNG,
        "How many anchors are in sight after, over shaded relief.",
        Drawn("service.products.placements.picture:draw_placement", {"what": "count", "after": True}),
    ),
    Layer(
        "before.png",
        PNG,
        "The same before.",
        Drawn("service.products.placements.picture:draw_placement", {"what": "count", "after": False}),
    ),
    Layer(
        "dop.png",
        PNG,
        "The dilution of precision after, over shaded relief.",
        Drawn("service.products.placements.picture:draw_placement", {"what": "dop", "after": True}),
    ),
    Layer(
        "dop_before.png",
        PNG,
        "The same before.",
        Drawn("service.products.placements.picture:draw_placement", {"what": "dop", "after": False}),
    ),
)
