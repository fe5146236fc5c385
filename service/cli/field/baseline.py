"""``sightline baseline``: where a rover was beside a base, from GNSS observation files of both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from rich.table import Table

from service.errors import RequestError

from ..asking.options import Output, Reading, option
from ..asking.texts import numbers_of
from ..output import facts_table, leaving_nothing_new, output_folder, print_json, print_tables, print_warnings

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from gnss.differential import Baseline, BaselineSettings, Observations, Orbits
    from service.files.baseline_files import BaselineSummary

__all__ = ["baseline"]

FILES = ("baseline.csv", "baseline.geojson", "baseline.json")


def baseline(
    rover: Annotated[Path, Parameter(name="ROVER", allow_leading_hyphen=False, help="RINEX 2 or 3 of the rover.")],
    /,
    *,
    base: Annotated[Path | None, option("RINEX 2 or 3 of the base. Required.", "FILE")] = None,
    orbits: Annotated[tuple[Path, ...], option("RINEX navigation, and SP3 too. Repeatable. Required.", "FILE")] = (),
    base_at: Annotated[
        str | None, option("Where the base's antenna is; height above the ellipsoid.", "LON,LAT,HEIGHT")
    ] = None,
    still: Annotated[bool, option("The rover stands; else it drives.")] = False,
    frequencies: Annotated[int, option("1 or 2.", "N")] = 1,
    ambiguities: Annotated[
        Literal["continuous", "instantaneous", "fix-and-hold", "none"], option("How whole cycles are sought and kept.")
    ] = "continuous",
    least_ratio: Annotated[float, option("Second best whole cycles to the best, to fix them.", "NUMBER")] = 3.0,
    mask_deg: Annotated[float, option("Satellites lower than so many degrees are left out.", "DEG", "--mask")] = 15.0,
    dem: Annotated[str | None, option("Leave out what this ground hides from the rover.", "FILE")] = None,
    antenna_height: Annotated[float, option("Of the rover's antenna above the ground, metres.", "M")] = 2.0,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Tell where a rover was beside a base, to centimetres, from GNSS observations of both.

    Writes baseline.csv, baseline.geojson and baseline.json into --out.
    """
    import math

    from gnss.differential import BaselineSettings, read_observations, read_orbits, solve_baseline

    if base is None or not orbits:
        raise RequestError("A baseline needs --base and --orbits: observations of the base, and a navigation file.")
    if dem is None and reading != Reading():
        raise RequestError("Options of reading a DEM go with --dem.")
    settings = BaselineSettings(
        moving=not still,
        frequencies=frequencies,
        elevation_mask_rad=math.radians(mask_deg),
        ambiguities=ambiguities,
        least_ratio=least_ratio,
    )
    of_rover, of_base, sky = read_observations(rover), read_observations(base), read_orbits(*orbits)
    base_m = _base_m(base_at)
    hidden = None if dem is None else _hidden(dem, reading, of_rover, of_base, sky, base_m, settings, antenna_height)
    found = solve_baseline(of_rover, of_base, sky, base_m, settings, hidden)
    _tell(found, None if hidden is None else int(hidden.sum()), output)


def _base_m(text: str | None) -> npt.NDArray[np.float64] | None:
    from gnss import Place, place_ecef_m

    if text is None:
        return None
    numbers = numbers_of(text)
    if numbers is None or len(numbers) != 3:
        raise RequestError(
            f"--base-at {text!r} is not of the form LON,LAT,HEIGHT: degrees, and metres above the ellipsoid."
        )
    return place_ecef_m(Place(*numbers))


def _hidden(
    dem: str,
    reading: Reading,
    rover: Observations,
    base: Observations,
    orbits: Orbits,
    base_m: npt.NDArray[np.float64] | None,
    settings: BaselineSettings,
    above_ground_m: float,
) -> npt.NDArray[np.bool_]:
    """Which of the rover's rows the ground hides, seen from where code alone puts the rover."""
    from dataclasses import replace

    from gnss.differential import solve_baseline
    from visibility.satellites import hidden_observations

    about = solve_baseline(rover, base, orbits, base_m, replace(settings, ambiguities="none"))
    return hidden_observations(reading.read(dem), rover, orbits, about.rover_ecef_m, above_ground_m)


def _tell(found: Baseline, hidden: int | None, output: Output) -> None:
    from service.files.baseline_files import summary_of, write_baseline

    summary = summary_of(found, hidden)
    if output.out is not None:
        folder = output_folder(output.out, FILES)
        with leaving_nothing_new(folder, FILES):
            write_baseline(found, summary, folder)
    if output.as_json:
        print_json(summary.model_dump(mode="json"))
        return
    print_tables(_table(summary))
    print_warnings(summary.warnings)


def _table(summary: BaselineSummary) -> Table:
    facts = [
        (
            "epochs",
            f"{summary.epochs}: {summary.fixed} fixed, {summary.floating} float, {summary.by_code} by code alone",
        ),
        ("base", f"{summary.base.lon_deg:.8f}, {summary.base.lat_deg:.8f}, {summary.base.height_m:.3f} m"),
    ]
    if summary.last_fixed is not None:
        last = summary.last_fixed
        facts.append(
            ("last fixed", f"{last.east_m:.4f} east, {last.north_m:.4f} north, {last.up_m:.4f} up of the base, m")
        )
    if summary.left_out is not None:
        facts.append(("left out", f"{summary.left_out} measurements of satellites behind the terrain"))
    return facts_table("Baseline", facts)
