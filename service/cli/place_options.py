"""``sightline place``: its options; the work is done in place.py."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from .options import (
    AnchorFiles,
    AnchorTexts,
    AsJson,
    Band,
    CellM,
    Crs,
    CurvatureOption,
    CurvatureWord,
    DemPath,
    HeightUnitOption,
    Kind,
    KindOption,
    LonLat,
    Measure,
    MeasureOption,
    Mode,
    ModeOption,
    Nodata,
    OutFolder,
    ReceiverHeight,
    TerrainFrame,
    UnknownGround,
    UnknownOption,
    VerticalDatumOption,
    reading_options,
)

__all__ = ["place"]


class Objective(StrEnum):
    """What is good."""

    COVERAGE = "coverage"
    DOP = "dop"
    MEAN_ERROR = "mean-error"
    WORST_ERROR = "worst-error"


def place(
    dem: DemPath,
    count: Annotated[int | None, typer.Option(metavar="K", help="How many anchors to place; or give --reach.")] = None,
    reach: Annotated[
        float | None, typer.Option(metavar="SHARE", help="Place the fewest that reach this share, such as 0.95.")
    ] = None,
    spacing: Annotated[
        float | None, typer.Option(metavar="M", help="Candidates on a lattice of this spacing, metres.")
    ] = None,
    height: Annotated[
        list[str] | None, typer.Option(metavar="HEIGHT", help="Of the lattice: 120agl or 900msl. Repeatable.")
    ] = None,
    where: Annotated[
        Path | None, typer.Option(metavar="FILE", help="GeoJSON polygon that the lattice lies in; default the DEM.")
    ] = None,
    mast: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE,HEIGHT", help="Places of masts in a GeoJSON file, and their height. Repeatable."),
    ] = None,
    site: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE,HEIGHT", help="Road or landing sites, and a drone's height there. Repeatable."),
    ] = None,
    objective: Annotated[
        Objective, typer.Option(help="What is good. Coverage counts anchors in sight, even where they stand in a row.")
    ] = Objective.COVERAGE,
    min_anchors: Annotated[int, typer.Option(metavar="K", help="So many anchors must be in sight.")] = 4,
    dop_limit: Annotated[float, typer.Option(metavar="NUMBER", help="A dilution below this is good enough.")] = 5.0,
    measure: MeasureOption = Measure.PDOP,
    kind: KindOption = Kind.RANGING,
    surface: Annotated[
        bool, typer.Option("--surface", help="The rover is on the ground: only its motion along it is unknown.")
    ] = False,
    spare: Annotated[int, typer.Option(metavar="N", help="So many anchors may be lost, 0 or 1.")] = 0,
    area: Annotated[
        Path | None, typer.Option(metavar="FILE", help="GeoJSON polygon to serve; default the DEM.")
    ] = None,
    path: Annotated[Path | None, typer.Option(metavar="FILE", help="GeoJSON LineString to serve instead.")] = None,
    corridor: Annotated[
        float | None, typer.Option(metavar="M", help="Serve the ground within half this width of --path.")
    ] = None,
    weights: Annotated[
        Path | None, typer.Option(metavar="FILE", help="GeoJSON polygons whose property weight is what ground counts.")
    ] = None,
    receiver_height: ReceiverHeight = None,
    no_fly: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="GeoJSON polygons without anchors. Repeatable.")
    ] = None,
    stand_off: Annotated[
        list[str] | None, typer.Option(metavar="FILE,M", help="GeoJSON shapes to keep so far from. Repeatable.")
    ] = None,
    min_agl: Annotated[float | None, typer.Option(metavar="M", help="Lowest height above ground.")] = None,
    max_agl: Annotated[float | None, typer.Option(metavar="M", help="Ceiling above ground.")] = None,
    max_altitude: Annotated[float | None, typer.Option(metavar="M", help="Ceiling as an altitude.")] = None,
    max_range: Annotated[float | None, typer.Option(metavar="M", help="Longest range that is measured.")] = None,
    separation: Annotated[float | None, typer.Option(metavar="M", help="Least distance between anchors.")] = None,
    base: Annotated[
        list[str] | None,
        typer.Option(metavar="EAST,NORTH,HEIGHT", help="Base that every anchor must see. Repeatable."),
    ] = None,
    link_range: Annotated[float | None, typer.Option(metavar="M", help="Longest link to a base or relay.")] = None,
    relays: Annotated[int, typer.Option(metavar="N", help="So many other anchors may relay the link.")] = 0,
    anchor: AnchorTexts = None,
    lonlat: LonLat = False,
    anchors: AnchorFiles = None,
    seed: Annotated[int, typer.Option(metavar="N", help="The same seed gives the same answer.")] = 0,
    time_limit: Annotated[
        float | None, typer.Option(metavar="S", help="After so many seconds take the best so far. Ctrl-C does as well.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Work out sight on the Dask cluster of this scheduler, tcp://HOST:8786."),
    ] = None,
    or_local: Annotated[
        bool, typer.Option("--or-local", help="Work here, with a warning, where the cluster cannot be reached.")
    ] = False,
    request: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The request as JSON, as over HTTP, in place of all the above.")
    ] = None,
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    vertical_datum: VerticalDatumOption = None,
    terrain_frame: TerrainFrame = False,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Find where anchors should be put, so that as much as possible of the ground or of a path sees enough of them.

    --anchor and --anchors are those already there. Writes place.json,
    anchors.geojson, anchors.csv, plans.zip with a .plan for each drone,
    beacons.parm, count.tif, dop.tif and pictures before and after into --out.
    """
    from service.products.placements.request import PlacementParameters

    from .maps import anchors_of
    from .place import CandidateOptions, GoalOptions, RuleOptions, TargetOptions, make_placement
    from .request_files import given, request_from_file

    if request is not None:
        asked = request_from_file(request, PlacementParameters)
    else:
        fields = {
            "candidates": CandidateOptions(spacing, height or [], where, mast or [], site or []).fields(),
            "anchors": anchors_of(anchor or [], anchors or [], lonlat=lonlat),
            "targets": TargetOptions(area, path, corridor, weights, receiver_height).fields(),
            "goal": GoalOptions(
                objective.value.replace("-", "_"), min_anchors, dop_limit, measure.value, kind.value, surface, spare
            ).fields(),
            "rules": RuleOptions(
                no_fly=no_fly or [],
                stand_off=tuple(stand_off or ()),
                min_above_ground_m=min_agl,
                max_above_ground_m=max_agl,
                max_altitude_m=max_altitude,
                max_range_m=max_range,
                min_separation_m=separation,
                bases=tuple(base or ()),
                link_range_m=link_range,
                relays=relays,
            ).fields(lonlat=lonlat),
            "count": count,
            "reach": reach,
            "seed": seed,
            "time_limit_s": time_limit,
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
            "plan_altitudes": "ground" if terrain_frame else None,
        }
        asked = PlacementParameters.model_validate(given(fields))
    make_placement(
        dem,
        asked,
        scheduler,
        or_local=or_local,
        reading=reading_options(nodata, crs, height_unit, band, cell_m, vertical_datum),
        out=out,
        as_json=as_json,
    )
