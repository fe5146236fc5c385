"""``sightline dop`` and ``sightline morph``: anchors and satellites in, maps of positioning out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .maps import MapFiles, anchors_of, make_map
from .output import facts_table, share_text

__all__ = ["SatelliteOptions", "make_positioning_map", "sources_table"]

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


def make_positioning_map(
    name: str,
    dem: str,
    *,
    anchor_texts: list[str],
    anchor_files: list[Path],
    lonlat: bool,
    satellites: SatelliteOptions,
    asked: dict[str, Any],
    left_out: tuple[str, ...] = (),
    **rest: Any,
) -> None:
    """Read, calculate, write and print a map of the product of that name; ``rest`` as for make_map.

    left_out: layers that are not written.
    """
    anchors = anchors_of(anchor_texts, anchor_files, lonlat=lonlat)
    sky = satellites.fields()
    if not anchors and not asked.get("tracks") and sky is None:
        raise RequestError(
            "Nothing to range to: give --anchor ID,EAST,NORTH,80agl, --anchors FILE or --almanac FILE with --time."
        )
    from service.products.layers import LAYERS
    from service.products.registry import PRODUCTS

    given = {field: value for field, value in asked.items() if value is not None}
    product, (summary, tables) = PRODUCTS[name], COMMANDS[name]
    parameters = product.parameters.model_validate({"anchors": anchors, "satellites": sky, **given})
    offered = (layer for layer in LAYERS[name].values() if layer.name not in left_out and not layer.for_screens)
    layers = tuple(layer.name for layer in offered if layer.is_of(given))
    make_map(dem, parameters, product.calculate, MapFiles(summary, layers), tables, **rest)


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


def _dop_tables(summary: dict[str, Any]) -> tuple[Table, ...]:
    quantiles = summary["dop_quantiles"]
    facts = [
        (f"{summary['measure'].upper()} < {summary['dop_limit']:g}", share_text(summary["share_within_limit"])),
        ("no-go", share_text(summary["share_no_go"])),
        ("unknown", share_text(summary["share_unknown"])),
        *(
            (f"{summary['measure'].upper()} {name}", "no fix" if quantiles[name] is None else f"{quantiles[name]:.2f}")
            for name in quantiles
        ),
        *(
            (f"{name} error p50", "no fix" if quantiles_m["p50"] is None else f"{quantiles_m['p50']:.3g} m")
            for name, quantiles_m in summary["position_error_quantiles_m"].items()
        ),
        *([] if summary["volume"] is None else [("voxels of the volume", f"{summary['volume']['voxels']:,}")]),
        *((f"posts {name.replace('_', ' ')}", f"{posts:,}") for name, posts in summary["posts_by_reason"].items()),
    ]
    bound = ", along the surface" if summary["on_surface"] else ""
    title = (
        f"{summary['dem']['name']}: {summary['kind']}, antenna {summary['receiver_above_ground_m']:g} m above "
        f"ground{bound}"
    )
    return sources_table(summary), facts_table(title, facts)


def _morphing_tables(summary: dict[str, Any]) -> tuple[Table, ...]:
    ceiling, above_m = summary["ceiling"], summary["above_ground_m"]
    top = (
        f"{ceiling['above_ground_m']:g} m above ground"
        if ceiling["above_ground_m"] is not None
        else f"altitude {ceiling['altitude_m']:g} m"
    )
    facts = [
        *((state["state"].replace("_", " "), share_text(state["share"])) for state in summary["states"]),
        ("posts with several no-flight intervals", f"{summary['posts_with_several_intervals']:,}"),
        *((f"flyable above ground {name}", "–" if m is None else f"{m:.0f} m") for name, m in above_m.items()),
    ]
    over_time = summary["over_time"]
    if over_time is not None:
        ((height, metres),) = over_time["available_at"].items()
        facts += [
            ("frames", f"{len(over_time['frames'])}"),
            (f"available at {metres:g} m {'agl' if height == 'above_ground_m' else 'msl'}", ""),
            *(
                (f"  {how}", share_text(over_time[f"share_{how}_available"]))
                for how in ("always", "sometimes", "never")
            ),
        ]
    title = (
        f"{summary['dem']['name']}: {summary['measure'].upper()} of {summary['kind']} < {summary['dop_limit']:g} "
        f"up to {top}"
    )
    return sources_table(summary), facts_table(title, facts)


def sources_table(summary: dict[str, Any]) -> Table:
    """One row per anchor and per satellite."""
    table = Table(
        title="Anchors and satellites",
        caption=f"Curvature: {summary['curvature']}",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("id", style="bold")
    for column in ("east m", "north m", "altitude m", "azimuth", "elevation"):
        table.add_column(column, justify="right", no_wrap=True)
    for anchor in summary["anchors"]:
        place = (f"{anchor['east_m']:.0f}", f"{anchor['north_m']:.0f}", f"{anchor['altitude_m']:.1f}")
        table.add_row(escape(anchor["id"]), *place, "", "")
    for satellite in summary["satellites"]:
        angles = (f"{satellite['grid_azimuth_deg']:.1f}°", f"{satellite['elevation_deg']:.1f}°")
        table.add_row(satellite["id"], "", "", "", *angles)
    return table


COMMANDS: Mapping[str, tuple[str, Callable[[dict[str, Any]], tuple[Table, ...]]]] = {
    "dop-map": ("dop.json", _dop_tables),
    "morphing-map": ("morph.json", _morphing_tables),
}
