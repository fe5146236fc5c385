"""``sightline los``: does one point see another, and by how much."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated

from rich.table import Table

from service.errors import RequestError

from .asking.ground import AreaOptions, Margin, area_asked
from .asking.options import GROUP, Curvature, DemPath, Output, Reading, RequestFile, Unknown, option
from .output import facts_table, print_json, print_tables, print_warnings

if TYPE_CHECKING:
    from service.parts.points import PointIn
    from service.products.lines_of_sight.calculate import LinesOfSightSummary
    from terrain import ElevationGrid
    from visibility.sight import LineOfSight

__all__ = ["los"]

POINT = "EAST,NORTH,HEIGHT"


@GROUP
@dataclass(frozen=True, slots=True)
class LineOptions:
    """How lines are calculated: fields of the request."""

    wavelength_m: Annotated[
        float | None, option("Wavelength, metres; adds the Fresnel clearance.", "M", "--wavelength")
    ] = None
    dem_sigma_m: Annotated[
        float | None, option("One-sigma error of the DEM, metres; adds the probability.", "M", "--dem-sigma")
    ] = None
    unknown: Annotated[Unknown, option("What a line over unknown ground is, unless known ground blocks it.")] = (
        "unknown"
    )
    curvature: Annotated[Curvature, option("auto: as the DEM's CRS implies; flat: none.")] = "auto"


def los(
    dem: DemPath,
    /,
    *,
    start: Annotated[str | None, option("One end; HEIGHT 80agl or 612msl. Required.", POINT, "--from")] = None,
    end: Annotated[str | None, option("The other end. Required.", POINT, "--to")] = None,
    lonlat: Annotated[bool, option("The pairs are longitude,latitude.")] = False,
    line: LineOptions = LineOptions(),
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Tell whether one point sees another, and by how much.

    Of a --request with many lines it writes lines_of_sight.json, lines.json
    and lines.npz into --out.
    """
    if request is not None:
        from service.products.lines_of_sight import LINES_OF_SIGHT

        from .asking.products import ask

        ask(
            *(LINES_OF_SIGHT, dem, request, _tables),
            summary="lines_of_sight.json",
            reading=reading,
            output=output,
            margin_m=margin_m,
        )
        return
    if start is None or end is None:
        raise RequestError("A line needs --from and --to, each EAST,NORTH,HEIGHT; or --request.")
    if output.out is not None:
        raise RequestError("--out goes with --request; of one line everything is printed.")
    ends = {"--from": _point("--from", start, lonlat), "--to": _point("--to", end, lonlat)}
    import numpy as np

    from service.parts.altitude_datums import in_dem_datum
    from service.parts.shapes_in_grid import resolve_point
    from service.parts.unused import notes_on_unused
    from service.products.lines_of_sight.calculate import refuse_lines_outside
    from service.products.lines_of_sight.request import PairIn
    from visibility import FLAT, line_of_sight

    within = area_asked(area.part(in_degrees=lonlat))
    grid = reading.read(dem, within, margin_m)
    pair, of_altitudes = in_dem_datum(grid, PairIn.model_validate({"from": ends["--from"], "to": ends["--to"]}))
    warnings = [*grid.provenance.warnings, *of_altitudes, *notes_on_unused(grid, pair)]
    start_m, end_m = resolve_point(grid, pair.from_, "--from"), resolve_point(grid, pair.to, "--to")
    refuse_lines_outside(grid, within, np.array([start_m]), np.array([end_m]))
    sight = line_of_sight(
        grid,
        start_m,
        end_m,
        curvature=FLAT if line.curvature == "flat" else None,
        unknown=line.unknown,
        wavelength_m=line.wavelength_m,
        dem_sigma_m=line.dem_sigma_m,
    )
    if output.as_json:
        print_json(_document(grid, sight, start_m, end_m, warnings))
        return
    print_tables(facts_table(f"Line of sight: {sight.verdict}", _facts(sight, start_m, end_m)))
    print_warnings([*warnings, *sight.warnings])


def _tables(answer: LinesOfSightSummary) -> tuple[Table, ...]:
    facts = [
        ("lines", f"{answer.lines:,}"),
        ("clear", f"{answer.clear:,}"),
        ("blocked", f"{answer.blocked:,}"),
        ("unknown", f"{answer.unknown:,}"),
        ("curvature", answer.curvature),
    ]
    return (facts_table("Lines of sight", facts),)


def _point(name: str, text: str, lonlat: bool) -> PointIn:
    from service.parts.points import PointIn

    from .asking.products import request_of_fields
    from .asking.texts import position_fields

    complaint = f"{name} {text!r} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 80agl or 612msl."
    fields = position_fields(text, lonlat=lonlat, complaint=complaint)
    try:
        return request_of_fields(fields, PointIn)
    except RequestError as error:
        raise RequestError(f"{name}: {error}") from error


def _document(
    grid: ElevationGrid, sight: LineOfSight, start_m: tuple[float, ...], end_m: tuple[float, ...], warnings: list[str]
) -> dict[str, object]:
    """The whole answer; numbers that are not known or not finite are null, the verdict says why."""
    told = {name: _finite_or_none(value) for name, value in asdict(sight).items() if name != "curvature"}
    return {
        "from_m": start_m,
        "to_m": end_m,
        **told,
        "curvature": sight.curvature.sentence(),
        "dem_sha256": grid.digest,
        "warnings": [*warnings, *sight.warnings],
    }


def _finite_or_none(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _facts(sight: LineOfSight, start_m: tuple[float, ...], end_m: tuple[float, ...]) -> list[tuple[str, str]]:
    facts = [
        ("from", _place(start_m)),
        ("to", _place(end_m)),
        ("distance", f"{sight.distance_m:.1f} m"),
        ("clearance", f"{sight.clearance_m:.3f} m" if math.isfinite(sight.clearance_m) else "nothing known in between"),
    ]
    if sight.blocking_point_m is not None and sight.blocking_distance_m is not None:
        where = f"{_place(sight.blocking_point_m)}, {sight.blocking_distance_m:.1f} m away"
        facts.append(("blocked at" if sight.verdict == "blocked" else "closest at", where))
    facts.append(("detour over the ground", _known(sight.excess_path_m, ".3f", " m")))
    if sight.fresnel_clearance is not None:
        facts.append(("Fresnel clearance", _known(sight.fresnel_clearance, ".2f", " radii of the first zone")))
    if sight.diffraction_loss_db is not None:
        facts.append(("diffraction loss", _known(sight.diffraction_loss_db, ".1f", " dB")))
    if sight.probability_clear is not None:
        facts.append(("probability clear", _known(sight.probability_clear, ".3f", "")))
    return [*facts, ("curvature", sight.curvature.sentence())]


def _place(position_m: tuple[float, ...]) -> str:
    return "{:.1f} m east, {:.1f} m north, {:.1f} m high".format(*position_m)


def _known(value: float, digits: str, unit: str) -> str:
    if math.isnan(value):
        return "not known"
    return f"{value:{digits}}{unit}" if math.isfinite(value) else "none, an end lies below the ground"
