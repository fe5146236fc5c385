"""``sightline los``: does one point see another, and by how much."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from pydantic import ValidationError

from service.errors import RequestError
from service.parts.points import PointIn
from service.parts.positions import resolve_point
from service.parts.sentences import sentence_of
from terrain import ElevationGrid
from visibility import FLAT, LineOfSight, line_of_sight

from .anchor_texts import position_fields
from .grounds import read_ground
from .height_words import height_words, told_of_heights
from .output import facts_table, print_json, print_tables, print_warnings

__all__ = ["show_line_of_sight"]


def show_line_of_sight(
    dem: str,
    reading: dict[str, Any],
    ends: tuple[str, str],
    *,
    lonlat: bool,
    flat: bool,
    options: dict[str, Any],
    as_json: bool,
) -> None:
    """Read the DEM and print the verdict between both ends, each EAST,NORTH,HEIGHT."""
    asked = [_point(name, text, lonlat) for name, text in zip(("--from", "--to"), ends, strict=True)]
    grid = read_ground(dem, reading)
    told = (*grid.provenance.warnings, *told_of_heights(grid, height_words(ends)))
    start_m, end_m = (resolve_point(grid, point, name) for name, point in zip(("--from", "--to"), asked, strict=True))
    sight = line_of_sight(grid, start_m, end_m, curvature=FLAT if flat else None, **options)
    if as_json:
        print_json(_document(grid, sight, start_m, end_m, told))
        return
    print_tables(facts_table(f"Line of sight: {sight.verdict}", _facts(sight, start_m, end_m)))
    print_warnings([*told, *sight.warnings])


def _point(name: str, text: str, lonlat: bool) -> PointIn:
    complaint = f"{name} {text!r} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 80agl or 612msl."
    fields = position_fields(text, lonlat=lonlat, complaint=complaint)
    try:
        return PointIn.model_validate(fields)
    except ValidationError as error:
        raise RequestError(f"{name}: {sentence_of(error)}") from error


def _document(
    grid: ElevationGrid,
    sight: LineOfSight,
    start_m: tuple[float, ...],
    end_m: tuple[float, ...],
    warnings: tuple[str, ...],
) -> dict[str, Any]:
    """The whole answer; numbers that are not known or not finite are null, the verdict says why."""
    told = {name: _finite_or_none(value) for name, value in asdict(sight).items() if name != "curvature"}
    ends = {"from_m": start_m, "to_m": end_m}
    return {
        **ends,
        **told,
        "curvature": sight.curvature.sentence(),
        "dem_sha256": grid.digest,
        "warnings": [*warnings, *sight.warnings],
    }


def _finite_or_none(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _facts(sight: LineOfSight, start_m: tuple[float, ...], end_m: tuple[float, ...]) -> list[tuple[str, str]]:
    facts = [
        ("from", _place(start_m)),
        ("to", _place(end_m)),
        ("distance", f"{sight.distance_m:.1f} m"),
        ("clearance", _metres(sight.clearance_m)),
    ]
    if sight.blocking_point_m is not None and sight.blocking_distance_m is not None:
        where = f"{_place(sight.blocking_point_m)}, {sight.blocking_distance_m:.1f} m away"
        facts.append(("blocked at" if sight.verdict == "blocked" else "closest at", where))
    facts.append(("detour over the ground", _metres(sight.excess_path_m)))
    if sight.fresnel_clearance is not None:
        facts.append(("Fresnel clearance", f"{sight.fresnel_clearance:.2f} radii of the first zone"))
        facts.append(("diffraction loss", f"{sight.diffraction_loss_db:.1f} dB"))
    if sight.probability_clear is not None:
        facts.append(("probability clear", f"{sight.probability_clear:.3f}"))
    return [*facts, ("curvature", sight.curvature.sentence())]


def _place(position_m: tuple[float, ...]) -> str:
    return "{:.1f} m east, {:.1f} m north, {:.1f} m high".format(*position_m)


def _metres(value_m: float) -> str:
    if math.isnan(value_m):
        return "not known"
    return f"{value_m:.3f} m" if math.isfinite(value_m) else "nothing known in between" if value_m > 0 else "–"
