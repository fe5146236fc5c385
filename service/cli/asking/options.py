"""Options that commands share: groups of them, GPS satellites among them, are frozen dataclasses of a request's fields.

A field is named as in the request, its option as people type it. What was not given is None or empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter, Token
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

__all__ = [
    "GROUP",
    "WHOLE",
    "AnchorOptions",
    "Curvature",
    "DemPath",
    "Kind",
    "Measure",
    "Mode",
    "Output",
    "PlacesAndAnchors",
    "PositioningOptions",
    "RangeSigma",
    "Reading",
    "ReceiverHeight",
    "RequestFile",
    "SatelliteOptions",
    "SightOptions",
    "TerrainFrame",
    "Unknown",
    "nothing_to_range_to",
    "option",
    "sources_table",
    "told",
]

if TYPE_CHECKING:
    from service.parts.anchors import AnchorIn
    from service.parts.areas import AnyArea
    from service.parts.positioning_answers import PlacedAnchor, PlacedSatellite
    from terrain import ElevationGrid


Mode = Literal["fast", "exact"]
Unknown = Literal["unknown", "open", "blocked"]
Curvature = Literal["auto", "flat"]
Kind = Literal["ranging", "pseudorange", "tdoa"]
Measure = Literal["gdop", "pdop", "hdop", "vdop", "tdop"]
GROUP = Parameter(name="*")
DemPath = Annotated[
    str,
    Parameter(
        allow_leading_hyphen=False,
        help="GeoTIFF, ESRI ASCII, SRTM .hgt, DTED, .npz or .npy file; a folder of tiles; or @ground.",
    ),
]
MOST_BYTES = 1_000_000


def _whole_number(kind: Any, tokens: Sequence[Token]) -> int:
    """The converter's own would round 2.5."""
    return int(tokens[0].value)


WHOLE = Parameter(converter=_whole_number)


def option(help: str, metavar: str | None = None, name: str | None = None) -> Parameter:
    """What a field's option is told to be; without a name it is called as the field."""
    return Parameter(name=name, metavar=metavar, help=help)


ReceiverHeight = Annotated[float | None, option("Above ground, metres. (default 1.5)", "M", "--receiver-height")]
RangeSigma = Annotated[
    float | None,
    option(
        "One-sigma error of every range, metres. (default what each anchor says, else 0.1; to satellites 1)",
        "M",
        "--range-sigma",
    ),
]
RequestFile = Annotated[
    Path | None, option("The request as JSON, as over HTTP, in place of all the above.", "FILE", "--request")
]
TerrainFrame = Annotated[bool, option("Altitudes in .plan files count from the ground, not from sea level.")]


def told(group: Any) -> dict[str, object]:
    """What the options of a group say, as the fields of its part of a request; without what was not given."""
    found = ((field.name, getattr(group, field.name)) for field in fields(group))
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in found
        if value is not None and value != ()
    }


@GROUP
@dataclass(frozen=True, slots=True)
class Reading:
    """How a DEM is read: what ``terrain.read_dem`` takes besides its file."""

    nodata: Annotated[float | None, option("Value that marks unknown posts.", "NUMBER")] = None
    crs: Annotated[str | None, option("CRS of a DEM whose file names none: EPSG:32611, EPSG:6529+6360.", "CRS")] = None
    height_unit: Annotated[
        Literal["m", "ft", "us-ft", "dm", "cm", "mm", "km"] | None,
        option("Unit of the heights, in place of what the file says."),
    ] = None
    band: Annotated[int | None, WHOLE, option("Band that holds the heights. (default 1)", "N")] = None
    cell_m: Annotated[float | None, option("Metres between posts, for files that do not tell.", "M")] = None
    vertical_datum: Annotated[
        str | None, option("What heights shall count from: msl, hae, EGM96, EPSG:5703; converted or taken so.", "DATUM")
    ] = None

    def read(self, dem: str, area: AnyArea | None = None, margin_m: float | None = None) -> ElevationGrid:
        """The DEM of a file, or the ground of tiles: of them no more than the area and the margin around it.

        Of one file all is read, unless there is a margin. Raises TerrainError, RequestError.
        """
        from terrain import read_dem

        from .ground import read_tiles

        of_tiles = read_tiles(dem, self, area, margin_m)
        if of_tiles is not None:
            return of_tiles
        return read_dem(
            dem,
            nodata=self.nodata,
            crs=self.crs,
            height_unit=self.height_unit,
            band=self.band,
            cell_m=self.cell_m,
            vertical_datum=self.vertical_datum,
        )


@GROUP
@dataclass(frozen=True, slots=True)
class Output:
    """Where answers go."""

    out: Annotated[Path | None, option("Folder for the files; without it only the summary.", "DIR")] = None
    as_json: Annotated[bool, option("Print JSON on standard output and nothing else.", name="--json")] = False


@GROUP
@dataclass(frozen=True, slots=True)
class AnchorOptions:
    """The ``anchors`` of a request."""

    anchor: Annotated[
        tuple[str, ...],
        option(
            "An anchor; metres in the DEM's CRS, HEIGHT 80agl (above ground) or 612msl (altitude). Repeatable.",
            "ID,EAST,NORTH,HEIGHT",
        ),
    ] = ()
    lonlat: Annotated[bool, option("The pairs of --anchor are longitude,latitude.")] = False
    anchors: Annotated[
        tuple[Path, ...],
        option(
            "Anchors with range, azimuth and elevation limits in a .json, .geojson or .csv file. Repeatable.", "FILE"
        ),
    ] = ()

    def read(self) -> list[AnchorIn]:
        """The anchors of all options. Raises RequestError."""
        from .anchor_files import anchors_from_file
        from .texts import anchor_from_text

        of_texts = [anchor_from_text(text, lonlat=self.lonlat) for text in self.anchor]
        return of_texts + [anchor for path in self.anchors for anchor in anchors_from_file(path)]

    def part(self, range_sigma_m: float | None = None) -> list[dict[str, object]]:
        """The same as fields, so that a sigma of every range, if there is one, is checked. Raises RequestError."""
        sigma = {} if range_sigma_m is None else {"ranging_sigma_m": range_sigma_m}
        return [{**anchor.model_dump(exclude_none=True), **sigma} for anchor in self.read()]


@GROUP
@dataclass(frozen=True, slots=True)
class PlacesAndAnchors(AnchorOptions):
    """The same where the command takes other places besides."""

    lonlat: Annotated[bool, option("All pairs are longitude,latitude.")] = False


@GROUP
@dataclass(frozen=True, slots=True)
class SightOptions:
    """How sight lines are calculated: fields of every request that asks about sight."""

    mode: Annotated[
        Mode, option("fast: a sweep that errs beside shadows and in altitudes behind them; exact: every edge.")
    ] = "fast"
    unknown: Annotated[Unknown, option("What a line over unknown ground is, unless known ground blocks it.")] = (
        "unknown"
    )
    curvature: Annotated[Curvature, option("auto: as the DEM's CRS implies; flat: none.")] = "auto"


@GROUP
@dataclass(frozen=True, slots=True)
class PositioningOptions:
    """What is measured and when it is good enough: fields of the requests of maps of positioning."""

    kind: Annotated[Kind, option("Ranges; ranges with an unknown clock; differences of arrival.")] = "ranging"
    measure: Annotated[Measure, option("Which dilution of precision.")] = "pdop"
    dop_limit: Annotated[float, option("From this dilution on it is not good enough.", "NUMBER")] = 2.5
    min_anchors: Annotated[
        int | None, WHOLE, option("So many must be in sight as well. (default what a fix needs)", "K")
    ] = None
    receiver_above_ground_m: ReceiverHeight = None


@GROUP
@dataclass(frozen=True, slots=True)
class SatelliteOptions:
    """The ``satellites`` of a request."""

    almanac: Annotated[Path | None, option("SEM or YUMA almanac; its GPS satellites are anchors.", "FILE")] = None
    navigation: Annotated[
        Path | None, option("RINEX navigation file, more precise; in place of --almanac.", "FILE")
    ] = None
    time: Annotated[str | None, option("When, such as 2007-01-27T06:00:00Z; with --almanac.", "ISO8601")] = None
    reference_date: Annotated[
        str | None, option("A date near the almanac's, where it counts weeks modulo 1024. (default --time)", "DATE")
    ] = None
    cone_deg: Annotated[float | None, option("Half-angle of the cone of satellites, degrees. (default 85)", "DEG")] = (
        None
    )
    sky_at: Annotated[str | None, option("Where a DEM without CRS lies, degrees; for satellites.", "LON,LAT")] = None

    def part(self, range_sigma_m: float | None = None) -> dict[str, object] | None:
        """As the request has them, all with this sigma; None without a file of orbits. Raises RequestError."""
        if self.almanac is not None and self.navigation is not None:
            raise RequestError("Give only one of --almanac and --navigation.")
        if self.almanac is None and self.navigation is None:
            if told(self):
                raise RequestError("--time, --reference-date, --cone-deg and --sky-at need --almanac FILE.")
            return None
        if self.time is None:
            option = "--almanac" if self.navigation is None else "--navigation"
            raise RequestError(f"{option} needs --time, such as --time 2007-01-27T06:00:00Z.")
        sigma = {} if range_sigma_m is None else {"ranging_sigma_m": range_sigma_m}
        found = {**told(self), **sigma, "reference_date": self.reference_date or _date_of(self.time)}
        if self.almanac is not None:
            found["almanac"] = _orbit_text("almanac", self.almanac)
        if self.navigation is not None:
            found["navigation"] = _orbit_text("navigation file", self.navigation)
        if self.sky_at is not None:
            del found["sky_at"]
            found |= _lon_lat(self.sky_at)
        return found


def nothing_to_range_to() -> RequestError:
    """What a map of positioning without anchors and satellites is refused with."""
    return RequestError(
        "Nothing to range to: give --anchor ID,EAST,NORTH,80agl, --anchors FILE or --almanac FILE with --time."
    )


def sources_table(curvature: str, anchors: Sequence[PlacedAnchor], satellites: Sequence[PlacedSatellite]) -> Table:
    """One row per anchor and per satellite. curvature: what was used, in words."""
    table = Table(
        title="Anchors and satellites", caption=f"Curvature: {curvature}", title_justify="left", caption_justify="left"
    )
    table.add_column("id", style="bold")
    for column in ("east m", "north m", "altitude m", "azimuth", "elevation"):
        table.add_column(column, justify="right", no_wrap=True)
    for anchor in anchors:
        place = (f"{anchor.east_m:.0f}", f"{anchor.north_m:.0f}", f"{anchor.altitude_m:.1f}")
        table.add_row(escape(anchor.id), *place, "", "")
    for satellite in satellites:
        angles = (f"{satellite.grid_azimuth_deg:.1f}°", f"{satellite.elevation_deg:.1f}°")
        table.add_row(satellite.id, "", "", "", *angles)
    return table


def _date_of(time: str) -> str:
    """The date of a time: an almanac that can be used for it is near it. Raises RequestError."""
    try:
        return datetime.fromisoformat(time).date().isoformat()
    except ValueError as error:
        raise RequestError(
            f"--time {time!r} is no ISO 8601 time with its offset, such as 2007-01-27T06:00:00Z."
        ) from error


def _orbit_text(what: str, path: Path) -> str:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise RequestError(f"The {what} {path.name} is larger than {MOST_BYTES:,} bytes; is it one?")
        return path.read_text(encoding="ascii")
    except UnicodeDecodeError as error:
        raise RequestError(f"The {what} {path.name} is not a text file.") from error
    except OSError as error:
        raise RequestError(f"The {what} {str(path)!r} cannot be read: {error.strerror}.") from error


def _lon_lat(text: str) -> dict[str, float]:
    try:
        lon_deg, lat_deg = (float(part) for part in text.split(","))
    except ValueError as error:
        raise RequestError(f"--sky-at {text!r} is not of the form LON,LAT in degrees.") from error
    return {"lon_deg": lon_deg, "lat_deg": lat_deg}
