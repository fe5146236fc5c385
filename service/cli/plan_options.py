"""``sightline plan``: its options; the work is done in plan.py."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import (
    AlmanacFile,
    AnchorFiles,
    AnchorTexts,
    AsJson,
    Band,
    CellM,
    ConeDeg,
    Crs,
    CurvatureWord,
    DemPath,
    HeightUnitOption,
    Kind,
    Measure,
    Mode,
    NavigationFile,
    Nodata,
    OutFolder,
    ReferenceDate,
    SatelliteTime,
    SkyAt,
    TerrainFrame,
    UnknownGround,
    VerticalDatumOption,
    reading_options,
)

__all__ = ["plan"]

Place = "EAST,NORTH"


def plan(
    dem: DemPath,
    start: Annotated[
        str | None, typer.Option(metavar=Place, help="Where the rover is, metres in the DEM's CRS. Required.")
    ] = None,
    goal: Annotated[
        list[str] | None,
        typer.Option(
            metavar=f"{Place}|FILE", help="Where to: a place, or GeoJSON polygons. Required; repeatable: any will do."
        ),
    ] = None,
    via: Annotated[list[str] | None, typer.Option(metavar=Place, help="A place to pass; in order. Repeatable.")] = None,
    heading: Annotated[
        float | None, typer.Option(metavar="DEG", help="Where the rover looks at the start, from grid north.")
    ] = None,
    max_slope: Annotated[float | None, typer.Option(metavar="DEG", help="Steepest ground. (default 25)")] = None,
    max_pitch: Annotated[float | None, typer.Option(metavar="DEG", help="Steepest along the way.")] = None,
    max_roll: Annotated[float | None, typer.Option(metavar="DEG", help="Steepest across the way.")] = None,
    max_step: Annotated[float | None, typer.Option(metavar="M", help="Highest step under the rover.")] = None,
    footprint: Annotated[float | None, typer.Option(metavar="M", help="Radius of the rover. (default 0.5)")] = None,
    receiver_height: Annotated[
        float | None, typer.Option(metavar="M", help="Of its antenna over the ground. (default 1.5)")
    ] = None,
    turning_radius: Annotated[
        float | None, typer.Option(metavar="M", help="Tightest arc; 0 = turns on the spot. (default 0)")
    ] = None,
    reverse: Annotated[bool, typer.Option("--reverse", help="It also drives backwards.")] = False,
    speed: Annotated[float | None, typer.Option(metavar="M/S", help="On level ground. (default 1)")] = None,
    min_anchors: Annotated[int | None, typer.Option(metavar="K", help="At least so many in sight everywhere.")] = None,
    dop_limit: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="The dilution of precision stays below it.")
    ] = None,
    kind: Annotated[Kind | None, typer.Option(help="What is measured. (default ranging)")] = None,
    measure: Annotated[Measure | None, typer.Option(help="Which dilution of precision. (default pdop)")] = None,
    surface: Annotated[bool, typer.Option("--surface", help="Only motion along the ground is unknown.")] = False,
    bubble: Annotated[
        float | None, typer.Option(metavar="EPSILON", help="Safety bubble of so many sigmas, kept clear everywhere.")
    ] = None,
    dem_sigma: Annotated[
        float | None, typer.Option(metavar="M", help="Uncertainty of the ground, added to it.")
    ] = None,
    weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=NUMBER", help="Of length, climb, time, dop, out-of-sight, position-error. Repeatable."
        ),
    ] = None,
    no_go: Annotated[list[Path] | None, typer.Option(metavar="FILE", help="GeoJSON polygons to stay out of.")] = None,
    keep_in: Annotated[list[Path] | None, typer.Option(metavar="FILE", help="GeoJSON polygons to stay within.")] = None,
    anchor: AnchorTexts = None,
    lonlat: Annotated[bool, typer.Option("--lonlat", help="All pairs are longitude,latitude.")] = False,
    anchors: AnchorFiles = None,
    track: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="Anchors that move, as .json or .csv. Repeatable.")
    ] = None,
    departure: Annotated[
        float | None, typer.Option(metavar="S", help="When the rover leaves, on the clock of the tracks. (default 0)")
    ] = None,
    map: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="visibility.json, dop.json or morph.json: its anchors and limits."),
    ] = None,
    almanac: AlmanacFile = None,
    navigation: NavigationFile = None,
    time: SatelliteTime = None,
    reference_date: ReferenceDate = None,
    cone_deg: ConeDeg = None,
    sky_at: SkyAt = None,
    iterations: Annotated[
        int | None, typer.Option(metavar="N", help="Of the sampling planner, which betters the grid's way.")
    ] = None,
    no_sampling: Annotated[
        bool, typer.Option("--no-sampling", help="Take the grid's way: sooner, and a little dearer.")
    ] = False,
    time_limit: Annotated[float | None, typer.Option(metavar="S", help="Time-out of the plan. (default 60)")] = None,
    seed: Annotated[
        int | None, typer.Option(metavar="N", help="The same seed gives the same path. (default 0)")
    ] = None,
    request: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The request as JSON, as over HTTP, in place of all the above.")
    ] = None,
    mode: Annotated[Mode | None, typer.Option(help="How maps of sight are made. (default exact)")] = None,
    unknown: Annotated[UnknownGround | None, typer.Option(help="What a line over unknown ground is.")] = None,
    curvature: Annotated[CurvatureWord | None, typer.Option(help="auto: as the DEM's CRS implies; flat: none.")] = None,
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
    """Plan a path on which the anchors stay in sight, or tell what blocks every path and the least that would open one.

    Writes path.json, path.geojson, map.png and, of a path, path.csv, path.gpx,
    path.plan and profile.png into --out.
    """
    from .plan import PlanOptions, make_path, path_request
    from .positioning import SatelliteOptions

    options = PlanOptions(
        start=start,
        goals=goal or [],
        via=via or [],
        weights=weight or [],
        no_go=no_go or [],
        keep_in=keep_in or [],
        anchor_texts=anchor or [],
        anchor_files=anchors or [],
        tracks=track or [],
        lonlat=lonlat,
        satellites=SatelliteOptions(almanac, navigation, time, reference_date, cone_deg, sky_at),
        rover={
            "footprint_radius_m": footprint,
            "receiver_above_ground_m": receiver_height,
            "max_slope_deg": max_slope,
            "max_pitch_deg": max_pitch,
            "max_roll_deg": max_roll,
            "max_step_m": max_step,
            "min_turning_radius_m": turning_radius,
            "can_reverse": reverse or None,
            "speed_m_per_s": speed,
        },
        limits={
            "min_anchors": min_anchors,
            "dop_limit": dop_limit,
            "kind": kind,
            "measure": measure,
            "on_surface": surface or None,
            "bubble_epsilon": bubble,
            "dem_sigma_m": dem_sigma,
        },
        budget={"iterations": iterations, "seconds": time_limit, "sampling": False if no_sampling else None},
        rest={
            "start_heading_deg": heading,
            "departure_s": departure,
            "seed": seed,
            "mode": mode,
            "unknown": unknown,
            "curvature": curvature,
            "plan_altitudes": "ground" if terrain_frame else None,
        },
    )
    make_path(
        dem,
        path_request(request, map, options),
        reading=reading_options(nodata, crs, height_unit, band, cell_m, vertical_datum),
        out=out,
        as_json=as_json,
    )
