"""Options that commands share: groups of them are frozen dataclasses of a request's fields.

A field is named as in the request, its option as people type it. What was not given is None or empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from service.errors import RequestError

from .cover import BARE, CoverOptions
from .numbers import ANY_NUMBER

__all__ = [
    "GROUP",
    "AnchorOptions",
    "Curvature",
    "DemPath",
    "HeardOptions",
    "Kind",
    "Measure",
    "Mode",
    "Output",
    "PlacesAndAnchors",
    "PositioningOptions",
    "RadioName",
    "RangeSigma",
    "Reading",
    "ReceiverHeight",
    "RequestFile",
    "SignalOptions",
    "TerrainFrame",
    "Unknown",
    "option",
    "told",
]

if TYPE_CHECKING:
    from service.parts.anchors import AnchorIn
    from service.parts.areas import AnyArea
    from terrain import ElevationGrid


Mode = Literal["fast", "exact"]
Unknown = Literal["unknown", "open", "blocked"]
Curvature = Literal["auto", "flat"]
RadioName = Literal["uwb", "2.4GHz", "868MHz", "915MHz", "gnss-l1"]
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

    nodata: Annotated[float | None, ANY_NUMBER, option("Value that marks unknown posts.", "NUMBER")] = None
    crs: Annotated[str | None, option("CRS of a DEM whose file names none: EPSG:32611, EPSG:6529+6360.", "CRS")] = None
    height_unit: Annotated[
        Literal["m", "ft", "us-ft", "dm", "cm", "mm", "km"] | None,
        option("Unit of the heights, in place of what the file says."),
    ] = None
    band: Annotated[int | None, option("Band that holds the heights. (default 1)", "N")] = None
    cell_m: Annotated[float | None, option("Metres between posts, for files that do not tell.", "M")] = None
    resolution_m: Annotated[
        float | None,
        option("Of a file with overviews read the coarsest whose cells are no coarser, metres.", "M", "--resolution"),
    ] = None
    vertical_datum: Annotated[
        str | None, option("What heights shall count from: msl, hae, EGM96, EPSG:5703; converted or taken so.", "DATUM")
    ] = None

    cover: CoverOptions = BARE

    def read(self, dem: str, area: AnyArea | None = None, margin_m: float | None = None) -> ElevationGrid:
        """The DEM of a file, or the ground of tiles, with what stands on it.

        Of tiles no more than the area and the margin around it is read, of one file all unless there is a margin.
        Raises TerrainError, RequestError, CoverError, MeshError.
        """
        return self.cover.put_on(self._ground(dem, area, margin_m))

    def _ground(self, dem: str, area: AnyArea | None, margin_m: float | None) -> ElevationGrid:
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
            resolution_m=self.resolution_m,
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
class HeardOptions:
    """What decides whether an anchor is got."""

    sight: Annotated[
        Literal["visible", "usable"] | None,
        option("usable: what arrives with enough power of each anchor's radio. (default visible)"),
    ] = None
    radio: Annotated[RadioName | None, option("With --sight usable: the radio of anchors that name none.", "NAME")] = (
        None
    )

    def part(self, anchors: Sequence[dict[str, object]]) -> dict[str, object]:
        """These options, and the anchors, as fields, with their radios. Raises RequestError."""
        if self.radio is not None and self.sight != "usable":
            raise RequestError("--radio goes with --sight usable.")
        fields = {name: value for name, value in told(self).items() if name != "radio"}
        return {**fields, "anchors": self.heard(anchors)}

    def heard(self, anchors: Sequence[dict[str, object]]) -> list[dict[str, object]]:
        """Anchors, or tracks, with the radio of those that name none."""
        return [one if self.radio is None else {"radio": self.radio, **one} for one in anchors]


@GROUP
@dataclass(frozen=True, slots=True)
class SignalOptions(HeardOptions):
    """The same, and how sight lines are calculated: fields of every request that asks about sight."""

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
    min_anchors: Annotated[int | None, option("So many must be in sight as well. (default what a fix needs)", "K")] = (
        None
    )
    receiver_above_ground_m: ReceiverHeight = None
