"""Options that commands share, each with its help."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = [
    "AlmanacFile",
    "AnchorFiles",
    "AnchorTexts",
    "AsJson",
    "Band",
    "CellM",
    "ConeDeg",
    "Crs",
    "CurvatureOption",
    "CurvatureWord",
    "DemPath",
    "DopLimit",
    "HeightUnitOption",
    "HeightUnitWord",
    "Kind",
    "KindOption",
    "LonLat",
    "Measure",
    "MeasureOption",
    "MinAnchors",
    "Mode",
    "ModeOption",
    "NavigationFile",
    "Nodata",
    "OutFolder",
    "ReceiverHeight",
    "ReferenceDate",
    "SatelliteTime",
    "SkyAt",
    "UnknownGround",
    "UnknownOption",
    "reading_options",
]


class Mode(StrEnum):
    """How sight lines are calculated."""

    FAST = "fast"
    EXACT = "exact"


class UnknownGround(StrEnum):
    """What a sight line over unknown ground is."""

    UNKNOWN = "unknown"
    OPEN = "open"
    BLOCKED = "blocked"


class CurvatureWord(StrEnum):
    """Whether the ground curves."""

    AUTO = "auto"
    FLAT = "flat"


class HeightUnitWord(StrEnum):
    """Units of heights."""

    METRE = "m"
    FOOT = "ft"
    SURVEY_FOOT = "us-ft"
    DECIMETRE = "dm"
    CENTIMETRE = "cm"
    MILLIMETRE = "mm"
    KILOMETRE = "km"


class Kind(StrEnum):
    """What is measured."""

    RANGING = "ranging"
    PSEUDORANGE = "pseudorange"
    TDOA = "tdoa"


class Measure(StrEnum):
    """Which dilution of precision."""

    GDOP = "gdop"
    PDOP = "pdop"
    HDOP = "hdop"
    VDOP = "vdop"
    TDOP = "tdop"


DemPath = Annotated[
    str,
    typer.Argument(
        metavar="DEM", help="GeoTIFF, ESRI ASCII, SRTM .hgt, DTED, .npz or .npy file; a folder of tiles; or @ground."
    ),
]
Nodata = Annotated[float | None, typer.Option("--nodata", metavar="NUMBER", help="Value that marks unknown posts.")]
Crs = Annotated[
    str | None,
    typer.Option("--crs", metavar="CRS", help="CRS of a DEM whose file names none: EPSG:32611, EPSG:6529+6360."),
]
HeightUnitOption = Annotated[
    HeightUnitWord | None, typer.Option("--height-unit", help="Unit of the heights, in place of what the file says.")
]
Band = Annotated[int | None, typer.Option("--band", metavar="N", help="Band that holds the heights. (default 1)")]
CellM = Annotated[
    float | None, typer.Option("--cell-m", metavar="M", help="Metres between posts, for files that do not tell.")
]
UnknownOption = Annotated[
    UnknownGround, typer.Option(help="What a line over unknown ground is, unless known ground blocks it.")
]
CurvatureOption = Annotated[CurvatureWord, typer.Option(help="auto: as the DEM's CRS implies; flat: none.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON on standard output and nothing else.")]
AnchorTexts = Annotated[
    list[str] | None,
    typer.Option(
        "--anchor",
        metavar="ID,EAST,NORTH,HEIGHT",
        help="An anchor; metres in the DEM's CRS, HEIGHT 80agl (above ground) or 612msl (altitude). Repeatable.",
    ),
]
LonLat = Annotated[bool, typer.Option("--lonlat", help="The pairs of --anchor are longitude,latitude.")]
AnchorFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--anchors",
        metavar="FILE",
        help="Anchors with range, azimuth and elevation limits in a .json, .geojson or .csv file. Repeatable.",
    ),
]
ReceiverHeight = Annotated[
    float | None, typer.Option("--receiver-height", metavar="M", help="Above ground, metres. (default 1.5)")
]
ModeOption = Annotated[Mode, typer.Option(help="Column sweep, or every edge that a line crosses.")]
OutFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the files; without it only the summary.")
]
AlmanacFile = Annotated[
    Path | None, typer.Option("--almanac", metavar="FILE", help="SEM or YUMA almanac; its GPS satellites are anchors.")
]
NavigationFile = Annotated[
    Path | None,
    typer.Option("--navigation", metavar="FILE", help="RINEX navigation file, more precise; in place of --almanac."),
]
SatelliteTime = Annotated[
    str | None, typer.Option("--time", metavar="ISO8601", help="When, such as 2007-01-27T06:00:00Z; with --almanac.")
]
ReferenceDate = Annotated[
    str | None,
    typer.Option(metavar="DATE", help="A date near the almanac's, where it counts weeks modulo 1024. (default --time)"),
]
ConeDeg = Annotated[
    float | None, typer.Option(metavar="DEG", help="Half-angle of the cone of satellites, degrees. (default 85)")
]
SkyAt = Annotated[
    str | None, typer.Option(metavar="LON,LAT", help="Where a DEM without CRS lies, degrees; for satellites.")
]
KindOption = Annotated[Kind, typer.Option(help="Ranges; ranges with an unknown clock; differences of arrival.")]
MeasureOption = Annotated[Measure, typer.Option(help="Which dilution of precision.")]
DopLimit = Annotated[float, typer.Option(metavar="NUMBER", help="From this dilution on it is not good enough.")]
MinAnchors = Annotated[
    int | None, typer.Option(metavar="K", help="So many must be in sight as well. (default what a fix needs)")
]


def reading_options(
    nodata: float | None,
    crs: str | None,
    height_unit: HeightUnitWord | None,
    band: int | None,
    cell_m: float | None,
) -> dict[str, Any]:
    """What read_dem takes besides the path."""
    unit = None if height_unit is None else height_unit.value
    return {"nodata": nodata, "crs": crs, "height_unit": unit, "band": band, "cell_m": cell_m}
