"""``sightline dop`` and ``sightline morph``: their options; the work is done in positioning.py."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import (
    AlmanacFile,
    AnchorFiles,
    AnchorTexts,
    AsJson,
    ConeDeg,
    Crs,
    CurvatureOption,
    CurvatureWord,
    DemPath,
    DopLimit,
    Kind,
    KindOption,
    LonLat,
    Measure,
    MeasureOption,
    MinAnchors,
    Mode,
    ModeOption,
    NavigationFile,
    Nodata,
    OutFolder,
    ReceiverHeight,
    ReferenceDate,
    SatelliteTime,
    SkyAt,
    UnknownGround,
    UnknownOption,
)

__all__ = ["dop", "morph"]

MESHES = ("surface.glb", "surface.stl")


def dop(
    dem: DemPath,
    anchor: AnchorTexts = None,
    lonlat: LonLat = False,
    anchors: AnchorFiles = None,
    almanac: AlmanacFile = None,
    navigation: NavigationFile = None,
    time: SatelliteTime = None,
    reference_date: ReferenceDate = None,
    cone_deg: ConeDeg = None,
    sky_at: SkyAt = None,
    kind: KindOption = Kind.RANGING,
    measure: MeasureOption = Measure.PDOP,
    dop_limit: DopLimit = 2.5,
    min_anchors: MinAnchors = None,
    receiver_height: ReceiverHeight = None,
    surface: Annotated[
        bool, typer.Option("--surface", help="The rover is on the ground: only its motion along it is unknown.")
    ] = False,
    one_dop_per_set: Annotated[
        bool, typer.Option("--one-dop-per-set", help="One dilution for each visible set; right for satellites only.")
    ] = False,
    path: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="CSV of east_m,north_m,above_ground_m (or altitude_m): adds path.csv."),
    ] = None,
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Calculate how good positioning is for a rover, over a whole DEM.

    Writes dop.json, dop.tif, count.tif, position_error.tif, no_go.tif, no_go.geojson, contours.geojson and map.png
    into --out, and path.csv where a --path is given.
    """
    from .path_files import path_from_file
    from .positioning import SatelliteOptions, make_positioning_map

    make_positioning_map(
        "dop-map",
        dem,
        nodata=nodata,
        crs=crs,
        anchor_texts=anchor or [],
        lonlat=lonlat,
        anchor_files=anchors or [],
        satellites=SatelliteOptions(almanac, navigation, time, reference_date, cone_deg, sky_at),
        asked={
            "kind": kind.value,
            "measure": measure.value,
            "dop_limit": dop_limit,
            "min_anchors": min_anchors,
            "receiver_above_ground_m": receiver_height,
            "on_surface": surface,
            "one_dop_per_set": one_dop_per_set,
            "path": None if path is None else path_from_file(path),
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
        },
        out=out,
        as_json=as_json,
    )


def morph(
    dem: DemPath,
    anchor: AnchorTexts = None,
    lonlat: LonLat = False,
    anchors: AnchorFiles = None,
    almanac: AlmanacFile = None,
    navigation: NavigationFile = None,
    time: SatelliteTime = None,
    reference_date: ReferenceDate = None,
    cone_deg: ConeDeg = None,
    sky_at: SkyAt = None,
    kind: KindOption = Kind.RANGING,
    measure: MeasureOption = Measure.PDOP,
    dop_limit: DopLimit = 2.5,
    min_anchors: MinAnchors = None,
    ceiling: Annotated[
        str | None, typer.Option(metavar="HEIGHT", help="Top of the air: 2500msl (altitude) or 300agl (above ground).")
    ] = None,
    receiver_height: ReceiverHeight = None,
    mesh: Annotated[
        bool, typer.Option("--mesh", help="Write surface.glb and surface.stl, where the dilution is the limit.")
    ] = False,
    mesh_layer: Annotated[
        float | None, typer.Option(metavar="M", help="Thickness of their voxels, metres. (default the smaller cell)")
    ] = None,
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Calculate the Digital Morphing Map: above which altitude positioning is good enough.

    Writes morph.json, altitude.tif, above_ground.tif, flags.tif, no_go.geojson, contours.geojson and map.png into
    --out, and with --mesh surface.glb and surface.stl.
    """
    from .positioning import SatelliteOptions, ceiling_fields, make_positioning_map

    make_positioning_map(
        "morphing-map",
        dem,
        nodata=nodata,
        crs=crs,
        anchor_texts=anchor or [],
        lonlat=lonlat,
        anchor_files=anchors or [],
        satellites=SatelliteOptions(almanac, navigation, time, reference_date, cone_deg, sky_at),
        asked={
            "kind": kind.value,
            "measure": measure.value,
            "dop_limit": dop_limit,
            "min_anchors": min_anchors,
            **ceiling_fields(ceiling),
            "receiver_above_ground_m": receiver_height,
            "surface_layer_m": mesh_layer,
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
        },
        left_out=() if mesh else MESHES,
        out=out,
        as_json=as_json,
    )
