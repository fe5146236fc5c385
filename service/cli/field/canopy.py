"""``sightline canopy``: how dense trees are, out of what was heard through them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter
from rich.table import Table

from service.errors import RequestError
from service.files.written import written_number

from ..asking.cover import BARE, CoverOptions
from ..asking.options import GROUP, Output, RadioName, Reading, option
from ..output import facts_table, leaving_nothing_new, output_folder, print_json, print_tables, print_warnings

if TYPE_CHECKING:
    from service.files.canopy_fits import CanopyFitOut
    from service.files.canopy_logs import CanopyLog
    from service.parts.anchors import AnchorIn

__all__ = ["canopy"]

FILES = ("canopy.json",)
canopy = App(name="canopy", help="How dense trees are, out of what was heard through them.")
LogFile = Annotated[
    Path,
    Parameter(
        name="LOG",
        allow_leading_hyphen=False,
        help="CSV of loss_db, cn0_dbhz with cn0_open_dbhz, or power_dbm, with directions or places; or gnssvod's .nc.",
    ),
]


@GROUP
@dataclass(frozen=True, slots=True)
class GroundOptions:
    """Where the receivers were among the trees."""

    dem: Annotated[str | None, option("The ground of the places in the log; with --canopy… for its trees.", "DEM")] = (
        None
    )
    anchor: Annotated[tuple[str, ...], option("What sent, for power_dbm. Repeatable.", "ID,EAST,NORTH,HEIGHT")] = ()
    radio: Annotated[RadioName | None, option("Their radio, for power_dbm.", "NAME")] = None
    lonlat: Annotated[bool, option("The anchors' pairs are longitude,latitude.")] = False
    receiver_above_ground_m: Annotated[
        float, option("Of receivers whose height the log does not tell.", "M", "--receiver-height")
    ] = 1.5


@GROUP
@dataclass(frozen=True, slots=True)
class PairOptions:
    """Of a .nc of gnssvod."""

    below: Annotated[str | None, option("Station below the trees.", "NAME")] = None
    above: Annotated[str | None, option("Station in the open.", "NAME")] = None
    system: Annotated[str, option("Satellites that are taken: G for GPS.", "LETTER")] = "G"


@GROUP
@dataclass(frozen=True, slots=True)
class DirectionOptions:
    """A map by direction besides the one density."""

    sectors: Annotated[int, option("So many of azimuth. (default no map)", "N")] = 0
    rings: Annotated[str, option("Edges of elevation for them, degrees.", "DEG,DEG,…")] = "10,30,50,90"
    min_elevation_deg: Annotated[float, option("Of ways that are used.", "DEG", "--min-elevation")] = 10.0


@canopy.command
def fit(
    log: LogFile,
    /,
    *,
    ground: GroundOptions = GroundOptions(),
    pairs: PairOptions = PairOptions(),
    by: DirectionOptions = DirectionOptions(),
    cover: CoverOptions = BARE,
    output: Output = Output(),
) -> None:
    """Fit the density of a canopy to logged signal strengths, with its error, in the form that requests take.

    Without a DEM trees have the height of --canopy-height, from --canopy-base up, and ways lead up to satellites.
    """
    from service.files.canopy_fits import fit_of_log

    read = _read(log, pairs)
    _refuse_unused(read, ground, by, cover)
    grid = None
    if ground.dem is not None:
        grid = Reading(cover=cover).read(ground.dem)
    found = fit_of_log(
        read,
        grid,
        anchors=_anchors(ground),
        crowns_m=(cover.canopy_base_m or 0.0, cover.canopy_top_m),
        receiver_above_ground_m=ground.receiver_above_ground_m,
        rings_deg=_rings(by.rings) if by.sectors else (),
        sectors=by.sectors,
        min_elevation_deg=by.min_elevation_deg,
    )
    if output.out is not None:
        folder = output_folder(output.out, FILES)
        with leaving_nothing_new(folder, FILES):
            (folder / FILES[0]).write_text(found.model_dump_json(indent=1), encoding="utf-8")
    if output.as_json:
        print_json(found.model_dump(mode="json"))
        return
    print_tables(_table(read, found))
    print_warnings(found.warnings)


def _refuse_unused(log: CanopyLog, ground: GroundOptions, by: DirectionOptions, cover: CoverOptions) -> None:
    """Raises RequestError for options that would change nothing."""
    costs = (cover.canopy_model, cover.depth_per_m, cover.canopy_densities, cover.season, cover.canopy_fit)
    if any(given is not None for given in costs):
        raise RequestError(
            "What trees cost is what is fitted: leave out --canopy-model, --canopy-density, --canopy-densities, "
            "--canopy-season and --canopy-fit."
        )
    heights = CoverOptions(canopy_top_m=cover.canopy_top_m, canopy_base_m=cover.canopy_base_m)
    if ground.dem is None and cover != heights:
        raise RequestError("Without --dem DEM only --canopy-height and --canopy-base count of what stands on it.")
    if (ground.anchor or ground.radio is not None) and not log.has("power_dbm"):
        raise RequestError("--anchor and --radio go with a log of power_dbm.")
    if not math.isfinite(ground.receiver_above_ground_m):
        raise RequestError("--receiver-height must be a finite number of metres.")
    if by.rings != DirectionOptions().rings and not by.sectors:
        raise RequestError("--rings needs --sectors N.")


def _read(path: Path, pairs: PairOptions) -> CanopyLog:
    from service.files.canopy_logs import read_canopy_log, read_paired_stations

    if path.suffix.lower() not in (".nc", ".nc4"):
        if pairs.below is not None or pairs.above is not None:
            raise RequestError("--below and --above go with a .nc of gnssvod.")
        return read_canopy_log(path)
    if pairs.below is None or pairs.above is None:
        raise RequestError("Of a .nc of gnssvod tell the stations: --below NAME --above NAME.")
    return read_paired_stations(path, pairs.below, pairs.above, pairs.system)


def _anchors(ground: GroundOptions) -> list[AnchorIn]:
    from service.parts.radios import RadioIn

    from ..asking.texts import anchor_from_text

    radio = None if ground.radio is None else RadioIn.model_validate(ground.radio)
    placed = [anchor_from_text(text, lonlat=ground.lonlat) for text in ground.anchor]
    return [one if radio is None else one.model_copy(update={"radio": radio}) for one in placed]


def _rings(text: str) -> tuple[float, ...]:
    try:
        return tuple(written_number(word) for word in text.split(","))
    except ValueError as fault:
        raise RequestError(f"--rings takes ascending degrees such as 10,30,50,90, not {text!r}.") from fault


def _table(log: CanopyLog, found: CanopyFitOut) -> Table:
    unit = "per metre" if found.canopy is not None else "straight up"
    facts = [
        ("losses, of so many sources", f"{found.count:,}, {found.sources}"),
        (f"optical depth {unit}", f"{found.depth_per_m:.4g} ± {_or_unknown(found.sigma_per_m, '.2g')}"),
        ("  which is", f"{found.db_per_m:.3g} dB {unit}"),
        ("left of the losses, rms", f"{found.rms_db:.2f} dB"),
        ("  of each half by the other", f"{_or_unknown(found.held_out_rms_db, '.2f')} dB"),
    ]
    if found.sky_rms_db is not None:
        facts.append(("left with the map by direction", f"{found.sky_rms_db:.2f} dB"))
        facts.append(("  of each half by the other", f"{_or_unknown(found.sky_held_out_rms_db, '.2f')} dB"))
    facts += [(f"{name}, as published", f"{value:.2f} dB") for name, value in found.published_rms_db.items()]
    return facts_table(f"{log.name}: canopy", facts)


def _or_unknown(value: float | None, form: str) -> str:
    return "unknown" if value is None or not math.isfinite(value) else format(value, form)
