"""``sightline bubble``: how surely a vehicle keeps clear of the ground along a path, or did in a history of poses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from rich.table import Table

from service.errors import RequestError

from .asking.cover import BARE
from .asking.doubts import TRUSTING, DoubtOptions
from .asking.ground import AreaOptions, Margin
from .asking.options import (
    GROUP,
    AnchorOptions,
    DemPath,
    Output,
    RangeSigma,
    Reading,
    RequestFile,
    SignalOptions,
    option,
    told,
)
from .asking.satellites import SatelliteOptions, sources_table
from .output import facts_table

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.products.safety_bubbles.calculate import BuildingFacts, FirstViolation, SafetyBubblesSummary

__all__ = ["bubble"]

PATH = (
    "CSV of east_m, north_m, above_ground_m (or altitude_m), time_s and, for a history of poses, "
    "ee_m2, en_m2, eu_m2, nn_m2, nu_m2, uu_m2; or path.csv of a plan or a GeoJSON LineString, with --height."
)


@GROUP
@dataclass(frozen=True, slots=True)
class FilterOptions:
    """What the vehicle ranges and how it moves: fields of the request."""

    kind: Annotated[Literal["ranging", "pseudorange"], option("Ranges; ranges with an unknown clock.")] = "ranging"
    ranging_interval_s: Annotated[
        float | None,
        option("Seconds between ranges. (default once at each point; of a planned path 1)", "S", "--interval"),
    ] = None
    epsilon: Annotated[float, option("So many sigmas is the radius.", "NUMBER")] = 3.0
    dem_sigma_m: Annotated[float, option("One-sigma error of the DEM, added to it.", "M", "--dem-sigma")] = 0.0
    dop_scaled: Annotated[bool, option("Multiply each variance by the PDOP of the anchors in sight.")] = False
    initial_position_sigma_m: Annotated[
        float | None,
        option("Of the position before the first ranges. (default 10; of a planned path 1)", "M", "--start-sigma"),
    ] = None
    initial_velocity_sigma_m_per_s: Annotated[
        float | None,
        option("Of the velocity before them, per axis. (default 1; of a planned path 0.3)", "M/S", "--speed-sigma"),
    ] = None
    on_ground: Annotated[
        bool | None,
        Parameter(
            name="--on-ground",
            negative="--off-ground",
            help="The vehicle is on the ground, whose height the DEM tells. (default off; of a planned path on)",
        ),
    ] = None
    under_ground: Annotated[
        Literal["refuse", "violated"], option("What a point below the ground or inside a building is.")
    ] = "refuse"


def bubble(
    dem: DemPath,
    /,
    *,
    path: Annotated[Path | None, option(f"{PATH} Required.", "FILE")] = None,
    height: Annotated[
        str | None, option("Of every point of a planned path or a GeoJSON line: 30agl or 1500msl.", "HEIGHT")
    ] = None,
    speed: Annotated[float | None, option("Along the path, where it has no time_s. (default 1)", "M/S")] = None,
    anchors: AnchorOptions = AnchorOptions(),
    satellites: SatelliteOptions = SatelliteOptions(),
    range_sigma: RangeSigma = None,
    filter: FilterOptions = FilterOptions(),
    agility: Annotated[
        float | None,
        option(
            "Power of the vehicle's acceleration, per axis: how it swerves. (default 0.1; of a planned path 0.01)",
            "M2/S3",
        ),
    ] = None,
    sight: SignalOptions = SignalOptions(),
    doubts: DoubtOptions = TRUSTING,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Tell how surely a vehicle keeps clear of ground and buildings along a path, or did in a history of poses.

    Writes bubble.json, points.csv, points.geojson, points.json, points.npz,
    profile.png and map.png into --out.
    """
    from service.products.safety_bubbles.request import BubbleParameters

    from .asking.path_files import trajectory_from_file
    from .asking.products import ask, request_of_fields

    asked: BaseModel | Path | None = request
    if asked is None:
        if path is None:
            raise RequestError(f"Missing option '--path': {PATH}")
        swerves = {} if agility is None else {"horizontal_m2_per_s3": agility, "up_m2_per_s3": agility}
        fields = {
            "satellites": satellites.part(range_sigma),
            "buildings": reading.cover.mesh(),
            **trajectory_from_file(path, height).fields(),
            **({} if speed is None else {"speed_m_per_s": speed}),
            **told(filter),
            **({"motion": swerves} if swerves else {}),
            **sight.part(anchors.part(range_sigma)),
            **doubts.part(),
            "area": area.part(in_degrees=anchors.lonlat),
        }
        asked = request_of_fields(fields, BubbleParameters)
        if reading.cover.of_mesh:  # one may pass below its roofs: it goes into the request as it is
            reading = replace(reading, cover=BARE)
    from service.products.safety_bubbles import SAFETY_BUBBLES

    ask(
        SAFETY_BUBBLES,
        dem,
        asked,
        _tables,
        summary="bubble.json",
        what="Safety bubbles",
        reading=reading,
        output=output,
        margin_m=margin_m,
    )


def _tables(answer: SafetyBubblesSummary) -> tuple[Table, ...]:
    first, buildings = answer.first_violation, answer.buildings
    facts = [
        ("points", f"{answer.points:,}"),
        *_building_facts(buildings),
        ("clear of the ground" if buildings is None else "clear of ground and buildings", f"{answer.ok:,}"),
        ("violated", f"{answer.violated:,}"),
        ("near unknown ground", f"{answer.unknown:,}"),
        ("first violation", "none" if first is None else _violation(first, answer.sight)),
        ("least margin", f"{answer.least_margin_m:.1f} m"),
        *((f"radius {name}", f"{metres:.1f} m") for name, metres in answer.radius_quantiles_m.items()),
        *([("one sigma of a range", answer.sigmas)] if answer.sigmas else []),
        ("promise of the bubbles, at least", f"{100.0 * answer.least_promise:.1f} %"),
    ]
    table = facts_table(f"{answer.dem.name}: bubble of {answer.epsilon:g} sigma", facts)
    if answer.curvature is None:
        return (table,)
    return sources_table(answer.curvature, answer.anchors, answer.satellites), table


def _building_facts(buildings: BuildingFacts | None) -> list[tuple[str, str]]:
    if buildings is None:
        return []
    return [
        ("buildings", f"{buildings.bodies:,} ({buildings.triangles:,} triangles) in {buildings.name}"),
        ("points nearer to one than to the ground", f"{buildings.points_nearest:,}"),
    ]


def _violation(first: FirstViolation, sight: str) -> str:
    counted = "usable" if sight == "usable" else "in sight"
    seen = "" if first.in_sight is None else f"; {counted}: {', '.join(first.in_sight) or 'none'}"
    where = f"point {first.point} at {first.distance_m:.0f} m, {first.time_s:g} s"
    clearance = f"clearance {first.clearance_m:.1f} m to the {first.nearest}"
    return f"{where}: radius {first.radius_m:.1f} m, {clearance}{seen}"
