"""``sightline bubble``: a path or a history of poses in; radius, clearance and verdict along it out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.table import Table

from service.errors import RequestError
from service.parts.points import PointIn
from service.parts.sentences import sentence_of
from service.products.safety_bubbles.answer import BuildingFacts, FirstViolation, SafetyBubblesSummary
from service.products.safety_bubbles.request import BubbleParameters

from .height_words import height_field
from .maps import anchors_of, make_map
from .output import facts_table
from .path_files import points_and_columns
from .planned_paths import filter_of_a_plan, planned_path
from .positioning import SatelliteOptions, sources_table
from .shape_files import path_fields

__all__ = ["make_bubbles"]

COVARIANCE = ("ee_m2", "en_m2", "eu_m2", "nn_m2", "nu_m2", "uu_m2")
HEIGHT_FORM = "--height {} is not of the form 30agl (above ground) or 1500msl (altitude)."


def make_bubbles(
    dem: str,
    path: Path,
    height: str | None,
    *,
    anchor_texts: list[str],
    anchor_files: list[Path],
    lonlat: bool,
    satellites: SatelliteOptions,
    range_sigma_m: float | None,
    buildings: dict[str, Any] | None,
    asked: dict[str, Any],
    **rest: Any,
) -> None:
    """Read, calculate, write and print; ``rest`` as for make_map. Raises RequestError and what the packages raise."""
    anchors = [anchor.model_dump(exclude_none=True) for anchor in anchors_of(anchor_texts, anchor_files, lonlat=lonlat)]
    sky = satellites.fields()
    if range_sigma_m is not None:
        for source in (*anchors, *([] if sky is None else [sky])):
            source["ranging_sigma_m"] = range_sigma_m
    given = {name: value for name, value in asked.items() if value is not None}
    parameters = BubbleParameters.model_validate(
        {"anchors": anchors, "satellites": sky, "buildings": buildings, **_path(path, height), **given}
    )
    from service.products.safety_bubbles.product import SAFETY_BUBBLES

    make_map(dem, SAFETY_BUBBLES, parameters, _tables, summary="bubble.json", what="Safety bubbles", **rest)


def _path(path: Path, height: str | None) -> dict[str, Any]:
    """The fields of a request that tell the path. Raises RequestError."""
    if path.suffix.lower() in (".geojson", ".json"):
        if height is None:
            raise RequestError("A path in GeoJSON needs --height, such as 30agl or 1500msl.")
        metres = height_field(height, HEIGHT_FORM.format(repr(height)))
        return {"points": [_point(path.name, {**place, **metres}) for place in path_fields(path)]}
    planned = planned_path(path)
    if planned is not None:
        if height is None:
            raise RequestError(
                f"{path.name} is a planned path, whose altitudes are the ground's: say with --height how high "
                "the antenna is, such as 1.5agl."
            )
        metres = height_field(height, HEIGHT_FORM.format(repr(height)))
        places, times_s = planned
        points = [_point(path.name, {**place, **metres}) for place in places]
        # the filter that the plan foresaw, so that both tell one figure for one path
        return {"points": points, "times_s": times_s, **filter_of_a_plan()}
    if height is not None:
        raise RequestError(
            "--height is for paths in GeoJSON and planned ones; a CSV file has the column above_ground_m or altitude_m."
        )
    points, told = points_and_columns(path, ("time_s", *COVARIANCE))
    fields: dict[str, Any] = {"points": points}
    if "time_s" in told:
        fields["times_s"] = told["time_s"]
    there = [column for column in COVARIANCE if column in told]
    if there:
        missing = [column for column in COVARIANCE if column not in told]
        if missing:
            raise RequestError(
                f"The path file {path.name} has {there[0]} but not {missing[0]}; a covariance needs all."
            )
        fields["covariances_m2"] = list(zip(*(told[column] for column in COVARIANCE), strict=True))
    return fields


def _point(name: str, fields: dict[str, float | str]) -> PointIn:
    try:
        return PointIn.model_validate(fields)
    except ValidationError as error:
        raise RequestError(f"{name}: {sentence_of(error)}") from error


def _tables(answer: SafetyBubblesSummary) -> tuple[Table, ...]:
    first, buildings = answer.first_violation, answer.buildings
    facts = [
        ("points", f"{answer.points:,}"),
        *_building_facts(buildings),
        ("clear of the ground" if buildings is None else "clear of ground and buildings", f"{answer.ok:,}"),
        ("violated", f"{answer.violated:,}"),
        ("near unknown ground", f"{answer.unknown:,}"),
        ("first violation", "none" if first is None else _violation(first)),
        ("least margin", f"{answer.least_margin_m:.1f} m"),
        *((f"radius {name}", f"{metres:.1f} m") for name, metres in answer.radius_quantiles_m.items()),
        ("promise of the bubbles, at least", f"{100.0 * answer.least_promise:.1f} %"),
    ]
    table = facts_table(f"{answer.dem.name}: bubble of {answer.epsilon:g} sigma", facts)
    return (sources_table(answer), table) if answer.curvature is not None else (table,)


def _building_facts(buildings: BuildingFacts | None) -> list[tuple[str, str]]:
    if buildings is None:
        return []
    return [
        ("buildings", f"{buildings.bodies:,} ({buildings.triangles:,} triangles) in {buildings.name}"),
        ("points nearer to one than to the ground", f"{buildings.points_nearest:,}"),
    ]


def _violation(first: FirstViolation) -> str:
    seen = "" if first.in_sight is None else f"; in sight: {', '.join(first.in_sight) or 'none'}"
    where = f"point {first.point} at {first.distance_m:.0f} m, {first.time_s:g} s"
    clearance = f"clearance {first.clearance_m:.1f} m to the {first.nearest}"
    return f"{where}: radius {first.radius_m:.1f} m, {clearance}{seen}"
