"""``sightline dop`` and ``sightline morph``: their options; the work is done in positioning.py."""

from __future__ import annotations

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


def dop(
    dem: DemPath,
    anchor: AnchorTexts = None,
    lonlat: LonLat = False,
    anchors: AnchorFiles = None,
    almanac: AlmanacFile = None,
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
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Calculate how good positioning is for a rover, over a whole DEM.

    Writes dop.json, dop.tif, count.tif, no_go.tif, no_go.geojson, contours.geojson and map.png into --out.
    """
    from .positioning import SatelliteOptions, make_positioning_map

    make_positioning_map(
        "dop-map",
        dem,
        nodata=nodata,
        crs=crs,
        anchor_texts=anchor or [],
        lonlat=lonlat,
        anchor_files=anchors or [],
        satellites=SatelliteOptions(almanac, time, reference_date, cone_deg, sky_at),
        asked={
            "kind": kind.value,
            "measure": measure.value,
            "dop_limit": dop_limit,
            "min_anchors": min_anchors,
            "receiver_above_ground_m": receiver_height,
            "on_surface": surface,
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
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Calculate the Digital Morphing Map: above which altitude positioning is good enough.

    Writes morph.json, altitude.tif, above_ground.tif, flags.tif and map.png into --out.
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
        satellites=SatelliteOptions(almanac, time, reference_date, cone_deg, sky_at),
        asked={
            "kind": kind.value,
            "measure": measure.value,
            "dop_limit": dop_limit,
            "min_anchors": min_anchors,
            **ceiling_fields(ceiling),
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
        },
        out=out,
        as_json=as_json,
    )
