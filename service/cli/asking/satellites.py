"""GPS satellites as options, and what is ranged to as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.files.written import written_number

from .options import GROUP, option, told

if TYPE_CHECKING:
    from service.parts.positioning_answers import PlacedAnchor, PlacedSatellite

__all__ = ["SatelliteOptions", "nothing_to_range_to", "sources_table"]

MOST_BYTES = 1_000_000


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
        lon_deg, lat_deg = (written_number(part) for part in text.split(","))
    except ValueError as error:
        raise RequestError(f"--sky-at {text!r} is not of the form LON,LAT in degrees.") from error
    return {"lon_deg": lon_deg, "lat_deg": lat_deg}
