"""``sightline dop`` and ``sightline morph``: their options; the work is done in positioning.py."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .areas import AreaFile, AreaText, AroundText, MarginOption, area_fields
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
    DopLimit,
    HeightUnitOption,
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
    reading_options,
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
        typer.Option(metavar="FILE", help="CSV of east_m, north_m, above_ground_m (or altitude_m): adds path.csv."),
    ] = None,
    cut: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LINE|HEIGHT",
            help="A picture of a cut: vertical along EAST,NORTH,EAST,NORTH, or horizontal at 1000msl or 50agl. "
            "Repeatable.",
        ),
    ] = None,
    volume: Annotated[
        bool, typer.Option("--volume", help="Write every voxel: volume.npz, volume.nc and GeoTIFFs; with --ceiling.")
    ] = False,
    ceiling: Annotated[
        str | None,
        typer.Option(metavar="HEIGHT", help="Top of the volume and of vertical cuts: 2500msl, or 300agl."),
    ] = None,
    floor: Annotated[
        float | None,
        typer.Option(metavar="M", help="Its lowest layer, counted as the ceiling is. (default the lowest ground)"),
    ] = None,
    layer: Annotated[
        float | None, typer.Option(metavar="M", help="From layer to layer. (default the cell, at most 100 layers)")
    ] = None,
    bounds: Annotated[
        str | None, typer.Option(metavar="WEST,SOUTH,EAST,NORTH", help="Its sides, metres. (default the whole DEM)")
    ] = None,
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    area: AreaText = None,
    around: AroundText = None,
    polygon: AreaFile = None,
    margin: MarginOption = None,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Calculate how good positioning is for a rover, over a whole DEM.

    Writes dop.json, dop.tif, count.tif, position_error.tif, no_go.tif,
    no_go.geojson, contours.geojson and map.png into --out, path.csv where a
    --path is given, cut-1.png and so on for each --cut, and with --volume the
    voxels.
    """
    from .height_words import height_words
    from .path_files import path_from_file
    from .positioning import SatelliteOptions, make_dop_map
    from .volume_texts import VolumeOptions, cut_fields

    air = VolumeOptions(volume, ceiling, floor, layer, bounds)
    make_dop_map(
        dem,
        {
            "kind": kind.value,
            "measure": measure.value,
            "dop_limit": dop_limit,
            "min_anchors": min_anchors,
            "receiver_above_ground_m": receiver_height,
            "on_surface": surface,
            "one_dop_per_set": one_dop_per_set,
            "path": None if path is None else path_from_file(path),
            "volume": air.fields(),
            "cuts": [cut_fields(text, lonlat=lonlat) for text in cut or []],
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
            "area": area_fields(area, around, polygon, in_degrees=lonlat),
        },
        SatelliteOptions(almanac, navigation, time, reference_date, cone_deg, sky_at),
        anchor or [],
        anchors or [],
        lonlat=lonlat,
        reading=reading_options(nodata, crs, height_unit, band, cell_m),
        margin_m=margin,
        left_out=air.left_out,
        heights=height_words(anchor, cut, ceiling),
        out=out,
        as_json=as_json,
    )


def morph(
    dem: DemPath,
    ceiling: Annotated[
        str, typer.Option(metavar="HEIGHT", help="Top of the air: 2500msl (altitude) or 300agl (above ground).")
    ],
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
    mesh: Annotated[
        bool, typer.Option("--mesh", help="Write surface.glb and surface.stl, where the dilution is the limit.")
    ] = False,
    mesh_layer: Annotated[
        float | None, typer.Option(metavar="M", help="Thickness of their voxels, metres. (default the smaller cell)")
    ] = None,
    track: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Anchors that move: CSV of id, time_s, east_m, north_m, above_ground_m (or altitude_m), or .json. "
            "Repeatable.",
        ),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option(metavar="FROM,TO,STEP", help="Frames over time, seconds; 0 is --time. Adds files and animation."),
    ] = None,
    available_at: Annotated[
        str | None,
        typer.Option(metavar="HEIGHT", help="Availability at 60agl or 1500msl. (default --receiver-height)"),
    ] = None,
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    area: AreaText = None,
    around: AroundText = None,
    polygon: AreaFile = None,
    margin: MarginOption = None,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Calculate the Digital Morphing Map: above which altitude positioning is good enough.

    Writes morph.json, altitude.tif, above_ground.tif, flags.tif, no_go.geojson,
    contours.geojson and map.png into --out; with --mesh surface.glb and
    surface.stl; with --frames frames_altitude.tif, frames_state.tif,
    availability.tif, availability.png and animation.gif.
    """
    from .height_words import height_words
    from .positioning import SatelliteOptions, make_morphing_map
    from .track_files import frames_fields, tracks_from_file
    from .volume_texts import ceiling_fields

    make_morphing_map(
        dem,
        {
            "kind": kind.value,
            "measure": measure.value,
            "dop_limit": dop_limit,
            "min_anchors": min_anchors,
            **ceiling_fields(ceiling),
            "receiver_above_ground_m": receiver_height,
            "surface_layer_m": mesh_layer,
            "tracks": [one for file in track or [] for one in tracks_from_file(file)],
            "frames": frames_fields(frames, available_at),
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
            "area": area_fields(area, around, polygon, in_degrees=lonlat),
        },
        SatelliteOptions(almanac, navigation, time, reference_date, cone_deg, sky_at),
        anchor or [],
        anchors or [],
        lonlat=lonlat,
        reading=reading_options(nodata, crs, height_unit, band, cell_m),
        margin_m=margin,
        left_out=() if mesh else MESHES,
        heights=height_words(anchor, ceiling, available_at),
        out=out,
        as_json=as_json,
    )
