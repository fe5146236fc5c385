"""``sightline navigate``: the log of a drive through the inertial filter, to a table and files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.table import Table

from service.errors import RequestError

from ..asking.detectors import LogOptions
from ..asking.estimators import drive_settings
from ..asking.ground import AreaOptions, Margin
from ..asking.options import GROUP, AnchorOptions, Curvature, Output, RangeSigma, Reading, RequestFile, option, told
from ..output import facts_table

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.files.drives.rows import DriveRows
    from service.products.navigations.calculate import NavigationSummary
    from service.products.navigations.request import NavigationParameters
    from terrain import ElevationGrid

__all__ = ["navigate"]

LOG = (
    "Tables (CSV, or a folder of them) of inertial readings, fixes, ranges and speeds, or a ROS bag, MCAP, PX4 ULog, "
    "DataFlash or MAVLink telemetry."
)
SETTINGS = "JSON of what is known besides: imu, axes, units, lever_arm_m, heading_deg …; docs/navigate.md has all."
# ground that nobody knows around a drive without a map: so far beside it, in so many posts
BESIDE_M, POSTS = 20.0, 64


@GROUP
@dataclass(frozen=True, slots=True)
class ReceiverOptions:
    """What a satellite receiver heard: ``satellites`` of the request."""

    observations: Annotated[
        Path | None, option("RINEX 2 or 3 of a satellite receiver on the vehicle: pseudoranges and phases.", "FILE")
    ] = None
    orbits: Annotated[
        tuple[Path, ...], option("RINEX navigation, and SP3 too. Repeatable. Goes with --observations.", "FILE")
    ] = ()
    zero_gps_s: Annotated[
        float | None,
        option("GPS time since 1980-01-06 of the readings' time 0. (default as the times tell)", "S", "--zero-gps"),
    ] = None

    def part(self) -> dict[str, object]:
        """As the request has it. Raises RequestError, AlmanacFileError."""
        from gnss.text_files import read_text
        from service.products.navigations.receiver import MOST_CHARACTERS

        if self.observations is None:
            if self.orbits or self.zero_gps_s is not None:
                raise RequestError("--orbits and --zero-gps go with --observations.")
            return {}
        if not self.orbits:
            raise RequestError("--observations needs --orbits: a RINEX navigation file of that time.")
        told: dict[str, object] = {
            "observations": read_text(self.observations, "RINEX observation", MOST_CHARACTERS),
            "orbits": [read_text(path, "navigation or SP3", MOST_CHARACTERS) for path in self.orbits],
        }
        return {"satellites": told if self.zero_gps_s is None else told | {"zero_gps_s": self.zero_gps_s}}


@GROUP
@dataclass(frozen=True, slots=True)
class MapOptions:
    """The map, and how far it is asked: fields of the request."""

    dem: Annotated[
        str | None, option("A DEM: it foretells sight and the ground's height. Metres are those of its CRS.", "FILE")
    ] = None
    ask_the_map: Annotated[
        bool | None,
        Parameter(
            name="--ask-the-map",
            negative="--without-the-map",
            help="Whether it tells which ranges to believe, and the ground's height. (default as asked)",
        ),
    ] = None
    dem_sigma_m: Annotated[float | None, option("One-sigma error of it. (default 3)", "M", "--dem-sigma")] = None
    curvature: Annotated[Curvature, option("auto: as the DEM's CRS implies; flat: none.")] = "auto"


def navigate(
    *logs: Annotated[Path, Parameter(name="LOG", allow_leading_hyphen=False, help=LOG)],
    settings: Annotated[Path | None, option(SETTINGS, "FILE")] = None,
    anchors: AnchorOptions = AnchorOptions(),
    range_sigma: RangeSigma = None,
    receiver: ReceiverOptions = ReceiverOptions(),
    map: MapOptions = MapOptions(),
    form: LogOptions = LogOptions(),
    interval: Annotated[float | None, option("Between the places that are told. (default 1)", "S")] = None,
    lat: Annotated[float | None, option("Latitude of a drive in metres of no CRS, degrees north.", "DEG")] = None,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Navigate through LOG, the log of a drive: inertial readings, corrected by what else was measured.

    Writes navigation.json, track.csv, track.geojson, track.gpx, track.npz,
    points.json, innovations.csv, map.png, errors.png and innovations.png into
    --out. Without --dem places are those of fixes, or metres of no CRS.
    """
    from service.products.navigations import NAVIGATION
    from service.products.navigations.request import NavigationParameters

    from ..asking.products import ask, request_of_fields

    asked: BaseModel | Path | None = request
    warnings: list[str] = []
    ground: str | ElevationGrid | None = map.dem
    if asked is None:
        if not logs:
            raise RequestError(f"Missing argument 'LOG': {LOG}")
        if map.dem is None and (map.ask_the_map is not None or map.dem_sigma_m is not None or map.curvature != "auto"):
            raise RequestError("--ask-the-map, --without-the-map, --dem-sigma and --curvature go with --dem.")
        placed = anchors.part(range_sigma)
        if range_sigma is not None and not placed:
            raise RequestError("--range-sigma goes with --anchor or --anchors.")
        if anchors.lonlat and not anchors.anchor and area.area is None and area.around is None:
            raise RequestError("--lonlat goes with --anchor, --area or --around.")
        rows = _rows(logs, form, [str(one["id"]) for one in placed])
        warnings = rows.told
        options = told(map)
        options.pop("dem", None)
        fields = {
            **rows.fields(),
            **receiver.part(),
            "ranges": _to_anchors(rows, {str(one["id"]) for one in placed}),
            "anchors": placed,
            "settings": drive_settings(settings, rows),
            "area": area.part(in_degrees=anchors.lonlat),
            **options,
            **({} if interval is None else {"interval_s": interval}),
            **({} if lat is None else {"lat_deg": lat}),
        }
        asked = request_of_fields(fields, NavigationParameters)
        if ground is None:
            ground = _unknown_ground(asked)
    if ground is None:
        raise RequestError("A request in a file needs its DEM: --dem FILE.")
    ask(
        NAVIGATION,
        ground,
        asked,
        _tables,
        summary="navigation.json",
        what="Navigation",
        reading=reading,
        output=output,
        margin_m=margin_m,
        told=warnings,
    )


def _rows(logs: tuple[Path, ...], form: LogOptions, anchor_ids: list[str]) -> DriveRows:
    from service.files.drives.reading import read_drive

    if form.epoch:
        raise RequestError("--epoch is for detect; here each range has its own time.")
    return read_drive(logs, form.form(), anchor_ids)


def _to_anchors(rows: DriveRows, known: set[str]) -> list[dict[str, object]]:
    """The ranges to anchors that are known; of the others it is told."""
    strange = sorted({str(one["anchor_id"]) for one in rows.ranges} - known)
    if strange:
        more = " …" if len(strange) > 5 else ""
        rows.told.append(
            f"Ranges to {', '.join(strange[:5])}{more} were not used: no --anchor or --anchors names them."
        )
    return [dict(one) for one in rows.ranges if one["anchor_id"] in known]


def _unknown_ground(asked: NavigationParameters) -> ElevationGrid:
    """Where there is no map: posts of unknown height around all that has a place, in the metric CRS of that place."""
    import numpy as np
    import pyproj

    from gnss.sky import place_of_ecef
    from service.products.navigations.receiver import ranges_of
    from terrain import ElevationGrid, Provenance
    from terrain.crs.metric import local_metric_crs

    named = [*asked.fixes, *asked.anchors]
    degrees = np.array([(one.lon_deg, one.lat_deg) for one in named if one.lon_deg is not None], float).reshape(-1, 2)
    if asked.satellites is not None and not len(degrees):
        place = place_of_ecef(ranges_of(asked.satellites).place_ecef_m)
        degrees = np.array([(place.lon_deg, place.lat_deg)])
    metres = np.array([(one.east_m, one.north_m) for one in named if one.east_m is not None], float).reshape(-1, 2)
    if len(degrees) and len(metres):
        raise RequestError("Some places are in degrees and some in metres; without --dem nothing tells how they lie.")
    if any(one.above_ground_m is not None for one in named):
        raise RequestError("Heights above the ground need a --dem that knows the ground.")
    crs = None
    if len(degrees):
        geodetic = pyproj.CRS.from_epsg(4326)
        crs = local_metric_crs(geodetic, degrees[:, 0], degrees[:, 1])
        onward = pyproj.Transformer.from_crs(geodetic, crs, always_xy=True)
        metres = np.column_stack(onward.transform(degrees[:, 0], degrees[:, 1]))
    side = 1.5 * float(np.ptp(metres, axis=0).max()) + 2.0 * BESIDE_M
    west, south = (metres.min(axis=0) + metres.max(axis=0) - side) / 2.0
    return ElevationGrid(
        np.full((POSTS, POSTS), np.nan, np.float32),
        side / (POSTS - 1),
        side / (POSTS - 1),
        float(west),
        float(south) + side,
        crs,
        vertical_datum=None if asked.satellites is None else "EGM96",
        provenance=Provenance("no map"),
    )


def _tables(answer: NavigationSummary) -> tuple[Table, ...]:
    facts = [
        ("readings", f"{answer.readings:,}"),
        ("time", f"{answer.from_s:.2f} to {answer.to_s:.2f} s ({answer.to_s - answer.from_s:.1f} s)"),
        ("way", f"{answer.way_m:,.1f} m"),
        ("places", f"{answer.places:,}, {'smoothed' if answer.smoothed else 'filtered'}"),
        *((f"radius {name}", f"{metres:.2f} m") for name, metres in answer.radius_quantiles_m.items()),
        ("force bias", f"{', '.join(f'{one:.3f}' for one in answer.force_bias_m_per_s2)} m/s²"),
        ("turn rate bias", f"{', '.join(f'{one:.4f}' for one in answer.rate_bias_deg_per_s)} °/s"),
    ]
    if answer.hidden_ranges is not None:
        facts.append(("ranges that the map left out", f"{answer.hidden_ranges:,}"))
    table = Table(title="Measurements", title_justify="left")
    table.add_column("of", style="bold")
    for column in ("numbers", "used", "not believed", "left out", "mean NIS"):
        table.add_column(column, justify="right")
    for one in answer.sources:
        nis = "–" if one.mean_nis is None else f"{one.mean_nis:.2f}"
        table.add_row(one.source, f"{one.measurements:,}", f"{one.used:,}", f"{one.gated:,}", f"{one.left_out:,}", nis)
    return facts_table(f"{answer.dem.name}: bubble of {answer.epsilon:g} sigma", facts), table
