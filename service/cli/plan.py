"""``sightline plan``: a path for a rover on which the anchors stay in sight, or what blocks every path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.files.written import written_number

from .asking.doubts import TRUSTING, DoubtOptions
from .asking.ground import AreaOptions, Margin
from .asking.options import (
    DemPath,
    HeardOptions,
    Output,
    PlacesAndAnchors,
    RangeSigma,
    Reading,
    RequestFile,
    TerrainFrame,
    option,
    told,
)
from .asking.planning import BudgetOptions, LimitOptions, RestOptions, RoverOptions, WayOptions
from .asking.satellites import SatelliteOptions
from .output import facts_table

if TYPE_CHECKING:
    from service.products.paths.answer import PathSummary

__all__ = ["plan"]


def plan(
    dem: DemPath,
    /,
    *,
    way: WayOptions = WayOptions(),
    rover: RoverOptions = RoverOptions(),
    limits: LimitOptions = LimitOptions(),
    weight: Annotated[
        tuple[str, ...], option("Of length, climb, time, dop, out-of-sight, position-error. Repeatable.", "NAME=NUMBER")
    ] = (),
    anchors: PlacesAndAnchors = PlacesAndAnchors(),
    track: Annotated[tuple[Path, ...], option("Anchors that move, as .json or .csv. Repeatable.", "FILE")] = (),
    map: Annotated[
        Path | None, option("visibility.json, dop.json or morph.json: its anchors and limits.", "FILE")
    ] = None,
    terrain_frame: TerrainFrame = False,
    satellites: SatelliteOptions = SatelliteOptions(),
    range_sigma: RangeSigma = None,
    budget: BudgetOptions = BudgetOptions(),
    heard: HeardOptions = HeardOptions(),
    rest: RestOptions = RestOptions(),
    doubts: DoubtOptions = TRUSTING,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Plan a path on which the anchors stay in sight, or tell what blocks every path and the least that would open one.

    Writes path.json, path.geojson, map.png and, of a path, path.csv, path.gpx,
    path.plan, path.kml and profile.png into --out; with --alternatives
    alternatives.geojson.
    """
    from service.products.paths import PATH
    from service.products.paths.request import PathQuestion

    from .asking.anchor_files import tracks_from_file
    from .asking.products import ask, completed, given_map, request_from_file, request_of_fields

    on = None if map is None else given_map(map)
    if request is not None:
        asked = request_from_file(request, PATH, on)
    else:
        if map is not None and range_sigma is not None:
            raise RequestError(
                "A map brings its anchors along, with the error of their ranges; give --map or --range-sigma."
            )
        sigma = {} if range_sigma is None else {"ranging_sigma_m": range_sigma}
        moving = [one for file in track for one in tracks_from_file(file)]
        tracks = [{**one.model_dump(exclude_none=True), **sigma} for one in moving]
        fields = {
            **way.part(lonlat=anchors.lonlat),
            **heard.part(anchors.part(range_sigma)),
            "satellites": satellites.part(range_sigma),
            **told(rest),
            **doubts.part(),
            "tracks": heard.heard(tracks),
            "rover": told(rover),
            "limits": told(limits),
            "budget": budget.part(),
            "weights": _weights(weight),
            "area": area.part(in_degrees=anchors.lonlat),
        }
        asked = completed(PATH, request_of_fields(fields, PathQuestion), on, map)
    ask(
        PATH,
        dem,
        asked,
        _tables,
        summary="path.json",
        what="Planning",
        changes={"plan_altitudes": "ground"} if terrain_frame else {},
        reading=reading,
        output=output,
        margin_m=margin_m,
        on=on,
    )


def _weights(texts: tuple[str, ...]) -> dict[str, float]:
    """NAME=VALUE options as weights. Raises RequestError."""
    from service.products.paths.request import WeightsIn

    names, found = tuple(WeightsIn.model_fields), {}
    for text in texts:
        option, _, value = text.partition("=")
        name = option.strip().replace("-", "_")
        try:
            found[name] = written_number(value)
        except ValueError as error:
            raise RequestError(f"--weight {text!r} is not of the form NAME=NUMBER.") from error
        if name not in names:
            raise RequestError(f"--weight {text!r} is not one of {', '.join(names)}, such as climb=2.")
    return found


def _tables(answer: PathSummary) -> tuple[Table, ...]:
    from planning.words import time_words

    facts = [("outcome", answer.status.replace("_", " ")), ("in words", answer.sentence)]
    if answer.departures:
        facts.append(("when to leave", answer.departures_sentence))
    if answer.alternatives_sentence and not answer.alternatives:
        facts.append(("other ways", answer.alternatives_sentence))
    totals, validation = answer.totals, answer.validation
    if totals is None or validation is None or answer.cost_split is None:
        return (facts_table(f"Path over {answer.dem.name}", facts), *_cuts(answer))
    facts += [
        ("length", f"{totals.length_m / 1000.0:.3f} km"),
        ("up, down", f"{totals.climb_m:.0f} m, {totals.descent_m:.0f} m"),
        ("steepest ground", f"{totals.steepest_deg:.1f}°"),
        ("time", time_words(totals.time_s)),
    ]
    if answer.ranged_to:
        no_fix, got = "no fix somewhere", "usable" if answer.parameters.get("sight") == "usable" else "in sight"
        facts += [
            (f"with fewer than {answer.needed_in_sight} {got}", time_words(totals.out_of_sight_s)),
            ("  longest at a stretch", time_words(totals.longest_out_of_sight_s)),
            (f"fewest {got}", str(totals.fewest_anchors)),
            (f"worst {_measure(answer)}", no_fix if totals.worst_dop is None else f"{totals.worst_dop:.2f}"),
            ("position error, mean", f"{totals.mean_position_sigma_m:.2f} m, one sigma, predicted"),
            ("  one sigma of a range", answer.sigmas),
        ]
    split = ", ".join(f"{name.replace('_', ' ')} {value:,.0f}" for name, value in answer.cost_split.items() if value)
    facts.append(("cost", f"{answer.cost:,.0f} ({split})"))
    if answer.ratio is not None:
        facts.append(("  of the reference", f"{answer.ratio:.4f}"))
    facts += [("planned by", answer.planner), ("validator", validation.sentence)]
    return (facts_table(f"Path over {answer.dem.name}", facts), *_others(answer))


def _others(answer: PathSummary) -> tuple[Table, ...]:
    if not answer.alternatives:
        return ()
    table = Table(title=f"Other ways: {answer.alternatives_sentence}", title_justify="left")
    for column in ("way", "beside the path", "of it elsewhere"):
        table.add_column(column, justify="right" if column == "of it elsewhere" else "left")
    for one in answer.alternatives:
        table.add_row(one.what, escape(one.sentence), f"{one.apart_share:.0%}")
    return (table,)


def _measure(answer: PathSummary) -> str:
    limits = answer.parameters["limits"]
    assert isinstance(limits, dict), "as PathParameters has them"
    return str(limits["measure"]).upper()


def _cuts(answer: PathSummary) -> tuple[Table, ...]:
    cut = answer.unreachable
    if cut is None:
        return ()
    table = Table(title="What would let a path through, one by itself", title_justify="left")
    for column in ("limit", "asked", "needed", "in words", "path found"):
        table.add_column(column, justify="right" if column in ("asked", "needed") else "left")
    for one in cut.relaxations:
        numbers = ("–" if value is None else f"{value:.4g} {one.unit}".rstrip() for value in (one.asked, one.needed))
        table.add_row(one.reason, *numbers, escape(one.sentence), "yes" if one.shown else "not shown")
    return (table,) if cut.relaxations else ()
