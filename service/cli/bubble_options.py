"""``sightline bubble``: its options; the work is done in bubble.py."""

from __future__ import annotations

from enum import StrEnum
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
    CurvatureOption,
    CurvatureWord,
    DemPath,
    HeightUnitOption,
    LonLat,
    Mode,
    ModeOption,
    NavigationFile,
    Nodata,
    OutFolder,
    ReferenceDate,
    SatelliteTime,
    SkyAt,
    UnknownGround,
    UnknownOption,
    VerticalDatumOption,
    reading_options,
)

__all__ = ["bubble"]


class BubbleKind(StrEnum):
    """What is measured."""

    RANGING = "ranging"
    PSEUDORANGE = "pseudorange"


class BuildingHeights(StrEnum):
    """What the heights of a mesh are."""

    ABOVE_GROUND = "above_ground"
    ABSOLUTE = "absolute"


class UnderGround(StrEnum):
    """What a point below the ground is."""

    REFUSE = "refuse"
    VIOLATED = "violated"


def bubble(
    dem: DemPath,
    path: Annotated[
        Path,
        typer.Option(
            metavar="FILE",
            help="CSV of east_m, north_m, above_ground_m (or altitude_m), time_s and, for a history of poses, "
            "ee_m2, en_m2, eu_m2, nn_m2, nu_m2, uu_m2; or path.csv of a plan or a GeoJSON LineString, with --height.",
        ),
    ],
    height: Annotated[
        str | None,
        typer.Option(metavar="HEIGHT", help="Of every point of a planned path or a GeoJSON line: 30agl or 1500msl."),
    ] = None,
    speed: Annotated[
        float | None, typer.Option(metavar="M/S", help="Along the path, where it has no time_s. (default 1)")
    ] = None,
    anchor: AnchorTexts = None,
    lonlat: LonLat = False,
    anchors: AnchorFiles = None,
    almanac: AlmanacFile = None,
    navigation: NavigationFile = None,
    time: SatelliteTime = None,
    reference_date: ReferenceDate = None,
    cone_deg: ConeDeg = None,
    sky_at: SkyAt = None,
    kind: Annotated[BubbleKind, typer.Option(help="Ranges; ranges with an unknown clock.")] = BubbleKind.RANGING,
    range_sigma: Annotated[
        float | None, typer.Option(metavar="M", help="One-sigma error of every range. (default what each anchor says)")
    ] = None,
    interval: Annotated[
        float | None,
        typer.Option(metavar="S", help="Seconds between ranges. (default once at each point; of a planned path 1)"),
    ] = None,
    epsilon: Annotated[float, typer.Option(metavar="NUMBER", help="So many sigmas is the radius.")] = 3.0,
    dem_sigma: Annotated[float, typer.Option(metavar="M", help="One-sigma error of the DEM, added to it.")] = 0.0,
    dop_scaled: Annotated[
        bool, typer.Option("--dop-scaled", help="Multiply each variance by the PDOP of the anchors in sight.")
    ] = False,
    start_sigma: Annotated[
        float | None,
        typer.Option(metavar="M", help="Of the position before the first ranges. (default 10; of a planned path 1)"),
    ] = None,
    speed_sigma: Annotated[
        float | None,
        typer.Option(metavar="M/S", help="Of the velocity before them, per axis. (default 1; of a planned path 0.3)"),
    ] = None,
    agility: Annotated[
        float | None,
        typer.Option(
            metavar="M2/S3",
            help="Power of the vehicle's acceleration, per axis: how it swerves. (default 0.1; of a planned path 0.01)",
        ),
    ] = None,
    on_ground: Annotated[
        bool | None,
        typer.Option(
            "--on-ground/--off-ground",
            help="The vehicle is on the ground, whose height the DEM tells. (default off; of a planned path on)",
        ),
    ] = None,
    under_ground: Annotated[
        UnderGround, typer.Option(help="What a point below the ground or inside a building is.")
    ] = UnderGround.REFUSE,
    buildings: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Mesh of buildings on the ground, in metres: .stl, .obj, .ply or .glb."),
    ] = None,
    building_heights: Annotated[
        BuildingHeights, typer.Option(help="Each body stands on the ground, or the file holds altitudes.")
    ] = BuildingHeights.ABOVE_GROUND,
    building_origin: Annotated[
        str | None, typer.Option(metavar="EAST,NORTH", help="Where the mesh's own origin lies. (default 0,0)")
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
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Tell how surely a vehicle keeps clear of ground and buildings along a path, or did in a history of poses.

    Writes bubble.json, points.csv, points.geojson, points.json, points.npz,
    profile.png and map.png into --out.
    """
    from .bubble import make_bubbles
    from .building_files import building_fields
    from .positioning import SatelliteOptions

    make_bubbles(
        dem,
        path,
        height,
        anchor_texts=anchor or [],
        anchor_files=anchors or [],
        lonlat=lonlat,
        satellites=SatelliteOptions(almanac, navigation, time, reference_date, cone_deg, sky_at),
        range_sigma_m=range_sigma,
        buildings=building_fields(buildings, building_heights.value, building_origin),
        asked={
            "speed_m_per_s": speed,
            "kind": kind.value,
            "ranging_interval_s": interval,
            "epsilon": epsilon,
            "dem_sigma_m": dem_sigma,
            "dop_scaled": dop_scaled,
            "initial_position_sigma_m": start_sigma,
            "initial_velocity_sigma_m_per_s": speed_sigma,
            "motion": None if agility is None else {"horizontal_m2_per_s3": agility, "up_m2_per_s3": agility},
            "on_ground": on_ground,
            "under_ground": under_ground.value,
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
        },
        reading=reading_options(nodata, crs, height_unit, band, cell_m, vertical_datum),
        out=out,
        as_json=as_json,
    )
