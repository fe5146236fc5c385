"""``sightline dop`` and ``sightline morph``: anchors and satellites in, maps of positioning out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Protocol

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.parts.anchors import AnchorIn
from service.parts.positioning_answers import PlacedAnchor, PlacedSatellite
from service.products.dop.answer import DopMapSummary
from service.products.morphing.answer import MorphingMapSummary

from .maps import anchors_of, make_map
from .output import facts_table, share_text

__all__ = ["SatelliteOptions", "make_dop_map", "make_morphing_map", "sources_table"]

MOST_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class SatelliteOptions:
    """--almanac or --navigation and what goes with it, as typed."""

    almanac: Path | None
    navigation: Path | None
    time: str | None
    reference_date: str | None
    cone_deg: float | None
    sky_at: str | None

    def fields(self) -> dict[str, Any] | None:
        """The ``satellites`` of a request; None without a file of orbits. Raises RequestError."""
        if self.almanac is not None and self.navigation is not None:
            raise RequestError("Give only one of --almanac and --navigation.")
        if self.almanac is None and self.navigation is None:
            if any(value is not None for value in (self.time, self.reference_date, self.cone_deg, self.sky_at)):
                raise RequestError("--time, --reference-date, --cone-deg and --sky-at need --almanac FILE.")
            return None
        if self.time is None:
            option = "--almanac" if self.navigation is None else "--navigation"
            raise RequestError(f"{option} needs --time, such as --time 2007-01-27T06:00:00Z.")
        fields: dict[str, Any] = {
            **({} if self.almanac is None else {"almanac": _orbit_text("almanac", self.almanac)}),
            **({} if self.navigation is None else {"navigation": _orbit_text("navigation file", self.navigation)}),
            "time": self.time,
            "reference_date": self._reference(),
        }
        if self.cone_deg is not None:
            fields["cone_deg"] = self.cone_deg
        if self.sky_at is not None:
            fields |= _lon_lat(self.sky_at)
        return fields

    def _reference(self) -> str | None:
        """The date given, or that of the time: an almanac that can be used for it is near it."""
        if self.reference_date is not None or self.time is None:
            return self.reference_date
        try:
            return datetime.fromisoformat(self.time).date().isoformat()
        except ValueError as error:
            raise RequestError(
                f"--time {self.time!r} is no ISO 8601 time with its offset, such as 2007-01-27T06:00:00Z."
            ) from error


def make_dop_map(
    dem: str,
    fields: dict[str, Any],
    satellites: SatelliteOptions,
    anchor_texts: list[str],
    anchor_files: list[Path],
    *,
    lonlat: bool,
    **rest: Any,
) -> None:
    """Read, calculate, write and print; fields: of the request, None where not given. ``rest`` as for make_map."""
    asked = _asked(fields, satellites, anchors_of(anchor_texts, anchor_files, lonlat=lonlat))
    from service.products.dop.product import DOP_MAP

    make_map(dem, DOP_MAP, DOP_MAP.parameters.model_validate(asked), _dop_tables, summary="dop.json", **rest)


def make_morphing_map(
    dem: str,
    fields: dict[str, Any],
    satellites: SatelliteOptions,
    anchor_texts: list[str],
    anchor_files: list[Path],
    *,
    lonlat: bool,
    **rest: Any,
) -> None:
    """The same for a morphing map."""
    asked = _asked(fields, satellites, anchors_of(anchor_texts, anchor_files, lonlat=lonlat))
    from service.products.morphing.product import MORPHING_MAP

    parameters = MORPHING_MAP.parameters.model_validate(asked)
    make_map(dem, MORPHING_MAP, parameters, _morphing_tables, summary="morph.json", **rest)


def _asked(fields: dict[str, Any], satellites: SatelliteOptions, anchors: list[AnchorIn]) -> dict[str, Any]:
    """A request's fields. Raises RequestError."""
    sky = satellites.fields()
    if not anchors and not fields.get("tracks") and sky is None:
        raise RequestError(
            "Nothing to range to: give --anchor ID,EAST,NORTH,80agl, --anchors FILE or --almanac FILE with --time."
        )
    given = {name: value for name, value in fields.items() if value is not None}
    return {"anchors": anchors, "satellites": sky, **given}


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


def _dop_tables(answer: DopMapSummary) -> tuple[Table, ...]:
    measure = answer.measure.upper()
    facts = [
        (f"{measure} < {answer.dop_limit:g}", share_text(answer.share_within_limit)),
        ("no-go", share_text(answer.share_no_go)),
        ("unknown", share_text(answer.share_unknown)),
        *(
            (f"{measure} {name}", "no fix" if dop is None else f"{dop:.2f}")
            for name, dop in answer.dop_quantiles.items()
        ),
        *(
            (f"{name} error p50", "no fix" if quantiles_m["p50"] is None else f"{quantiles_m['p50']:.3g} m")
            for name, quantiles_m in answer.position_error_quantiles_m.items()
        ),
        *([] if answer.volume is None else [("voxels of the volume", f"{answer.volume.voxels:,}")]),
        *((f"posts {name.replace('_', ' ')}", f"{posts:,}") for name, posts in answer.posts_by_reason.items()),
    ]
    bound = ", along the surface" if answer.on_surface else ""
    title = f"{answer.dem.name}: {answer.kind}, antenna {answer.receiver_above_ground_m:g} m above ground{bound}"
    return sources_table(answer), facts_table(title, facts)


def _morphing_tables(answer: MorphingMapSummary) -> tuple[Table, ...]:
    ceiling = answer.ceiling
    top = (
        f"{ceiling['above_ground_m']:g} m above ground"
        if ceiling["above_ground_m"] is not None
        else f"altitude {ceiling['altitude_m']:g} m"
    )
    facts = [
        *((state.state.replace("_", " "), share_text(state.share)) for state in answer.states),
        ("posts with several no-flight intervals", f"{answer.posts_with_several_intervals:,}"),
        *(
            (f"flyable above ground {name}", "–" if m is None else f"{m:.0f} m")
            for name, m in answer.above_ground_m.items()
        ),
    ]
    over_time = answer.over_time
    if over_time is not None:
        ((height, metres),) = over_time.available_at.items()
        facts += [
            ("frames", f"{len(over_time.frames)}"),
            (f"available at {metres:g} m {'agl' if height == 'above_ground_m' else 'msl'}", ""),
            ("  always", share_text(over_time.share_always_available)),
            ("  sometimes", share_text(over_time.share_sometimes_available)),
            ("  never", share_text(over_time.share_never_available)),
        ]
    title = f"{answer.dem.name}: {answer.measure.upper()} of {answer.kind} < {answer.dop_limit:g} up to {top}"
    return sources_table(answer), facts_table(title, facts)


class TellsSources(Protocol):
    """An answer that tells where anchors and satellites are."""

    @property
    def curvature(self) -> str:
        """Curvature and refraction that were used."""
        ...

    @property
    def anchors(self) -> Sequence[PlacedAnchor]:
        """In the DEM's frame."""
        ...

    @property
    def satellites(self) -> Sequence[PlacedSatellite]:
        """As the middle of the DEM sees them."""
        ...


def sources_table(answer: TellsSources) -> Table:
    """One row per anchor and per satellite."""
    table = Table(
        title="Anchors and satellites",
        caption=f"Curvature: {answer.curvature}",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("id", style="bold")
    for column in ("east m", "north m", "altitude m", "azimuth", "elevation"):
        table.add_column(column, justify="right", no_wrap=True)
    for anchor in answer.anchors:
        place = (f"{anchor.east_m:.0f}", f"{anchor.north_m:.0f}", f"{anchor.altitude_m:.1f}")
        table.add_row(escape(anchor.id), *place, "", "")
    for satellite in answer.satellites:
        angles = (f"{satellite.grid_azimuth_deg:.1f}°", f"{satellite.elevation_deg:.1f}°")
        table.add_row(satellite.id, "", "", "", *angles)
    return table
