"""``sightline place``: where anchors should be put, so that as much as possible sees enough of them."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .asking.doubts import TRUSTING, DoubtOptions
from .asking.ground import AreaOptions, Margin
from .asking.options import (
    AnchorOptions,
    DemPath,
    Output,
    Reading,
    RequestFile,
    SignalOptions,
    TerrainFrame,
    option,
)
from .asking.placing import CandidateOptions, LinkOptions, PlacementGoal, PlacementRules, TargetOptions
from .output import facts_table, share_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.products.placements.answer import PlacementSummary

__all__ = ["place"]

SUMMARY = "place.json"


def place(
    dem: DemPath,
    /,
    *,
    count: Annotated[int | None, option("How many anchors to place; or give --reach.", "K")] = None,
    reach: Annotated[float | None, option("Place the fewest that reach this share, such as 0.95.", "SHARE")] = None,
    candidates: CandidateOptions = CandidateOptions(),
    goal: PlacementGoal = PlacementGoal(),
    targets: TargetOptions = TargetOptions(),
    rules: PlacementRules = PlacementRules(),
    link: LinkOptions = LinkOptions(),
    anchors: AnchorOptions = AnchorOptions(),
    seed: Annotated[int, option("The same seed gives the same answer.", "N")] = 0,
    time_limit: Annotated[
        float | None, option("After so many seconds take the best so far. Ctrl-C does as well.", "S")
    ] = None,
    terrain_frame: TerrainFrame = False,
    scheduler: Annotated[
        str | None, option("Work out sight on the Dask cluster of this scheduler, tcp://HOST:8786.", "ADDRESS")
    ] = None,
    or_local: Annotated[bool, option("Work here, with a warning, where the cluster cannot be reached.")] = False,
    sight: SignalOptions = SignalOptions(),
    doubts: DoubtOptions = TRUSTING,
    windows: Annotated[
        bool, option("Read only the ground in reach of candidates: coverage, with --max-range; any DEM in metres.")
    ] = False,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Find where anchors should be put, so that as much as possible of the ground or of a path sees enough of them.

    --anchor and --anchors are those already there. Writes place.json,
    anchors.geojson, anchors.csv, anchors.kml, plans.zip with a .plan for each
    drone, beacons.parm, count.tif, dop.tif and pictures before and after into --out;
    by windows, which a DEM of more posts than are read whole is by itself, only the
    first three.
    """
    from service.products.placements.request import PlacementParameters

    from .asking.products import ask, request_of_fields

    asked: BaseModel | Path | None = request
    if asked is None:
        one = {"count": count, "reach": reach, "seed": seed, "time_limit_s": time_limit}
        fields = {
            "candidates": candidates.part(),
            "targets": targets.part(),
            "goal": goal.part(),
            "rules": {**rules.part(), "link": link.part(lonlat=anchors.lonlat)},
            **{name: value for name, value in one.items() if value is not None},
            **sight.part(anchors.part(goal.ranging_sigma_m)),
            **doubts.part(),
            **({} if sight.radio is None else {"radio": sight.radio}),
            "area": area.part(in_degrees=anchors.lonlat),
        }
        asked = request_of_fields(fields, PlacementParameters)
    if or_local and scheduler is None:
        raise RequestError("--or-local goes with --scheduler.")
    if windows and margin_m is not None:
        raise RequestError("--margin is for a DEM that is held; by windows all ground in reach is read.")
    from service.products import Work
    from service.products.placements import PLACEMENT
    from terrain import DemTooLargeError

    where = {} if scheduler is None else {"run_on": "cluster_or_here" if or_local else "cluster"}
    ground = {"plan_altitudes": "ground"} if terrain_frame else {}
    told_of_size: tuple[str, ...] = ()
    with _interrupt_as_stop() as stop:
        if not windows:
            try:
                ask(
                    PLACEMENT,
                    dem,
                    asked,
                    _tables,
                    summary=SUMMARY,
                    what="Placing anchors",
                    work=Work(stop=stop, scheduler=scheduler),
                    changes=where | ground,
                    reading=reading,
                    output=output,
                    margin_m=margin_m,
                )
            except DemTooLargeError as error:
                if not Path(dem).is_file():
                    raise
                told_of_size = (f"The DEM has {error.cells:,} posts, more than are read whole; by windows it was.",)
            else:
                return
        from .asking.by_windows import place_by_windows

        if terrain_frame:
            raise RequestError("--terrain-frame is for the plans of drones, which by windows are not written.")
        place_by_windows(
            dem, asked, summary=SUMMARY, reading=reading, output=output, told=told_of_size, changes=where,
            work=Work(stop=stop, scheduler=scheduler),
        )  # fmt: skip


@contextmanager
def _interrupt_as_stop() -> Iterator[Callable[[], bool]]:
    """A function that tells whether Ctrl-C was pressed; a second one interrupts as ever."""
    pressed = False
    before = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield lambda: pressed
    finally:
        signal.signal(signal.SIGINT, before)


def _tables(answer: PlacementSummary) -> tuple[Table, ...]:
    shares = answer.value_share is not None

    def told(value: float) -> str:
        return share_text(value) if shares else f"{value:.3f} m"

    table = Table(title=escape(answer.goal), title_justify="left")
    table.add_column("placed", style="bold")
    for column in ("east m", "north m", "altitude m", "above\nground m", "adds", "left when\nit is lost"):
        table.add_column(column, justify="right", no_wrap=True)
    for placed in answer.placed:
        above_m = placed.above_ground_m
        table.add_row(
            escape(placed.id),
            f"{placed.east_m:.0f}",
            f"{placed.north_m:.0f}",
            f"{placed.altitude_m:.1f}",
            "–" if above_m is None else f"{above_m:.1f}",
            told(placed.number("marginal")),
            told(placed.number("after_loss")),
        )
    hover, targets = answer.hover, answer.targets
    facts = [
        ("before", told(answer.number("before"))),
        ("with the placed anchors", told(answer.number("value"))),
        ("the same, mode exact", told(answer.number("exact"))),
        ("no choice exceeds", told(answer.number("bound"))),
        ("greedy alone", told(answer.number("greedy"))),
        *_dilution_facts(answer),
        (f"hovering ±{hover.hover_m:g} m off, worst of {hover.draws}", told(hover.number("worst"))),
        ("found by", answer.method + (", proved best" if answer.proved else "")),
        ("candidates", f"{answer.candidates.left:,}"),
        *((f"  removed, {name}", f"{number:,}") for name, number in answer.candidates.removed.items()),
    ]
    if answer.fewest_possible is not None:
        facts.insert(0, ("anchors needed at least", str(answer.fewest_possible)))
    if answer.stopped:
        facts.insert(0, ("stopped early", "this is the best so far"))
    if targets.within_limits_m is not None:
        facts.append(("path within limits", f"{targets.within_limits_m / 1000.0:.2f} km"))
    return table, facts_table("What it is worth", facts)


def _dilution_facts(answer: PlacementSummary) -> list[tuple[str, str]]:
    """What the placed anchors' geometry is worth, whatever they were placed for."""
    told, goal = answer.dilution, answer.parameters["goal"]
    assert isinstance(goal, Mapping)
    name = told.measure.upper()
    return [
        (f"{name}, median", "no fix" if told.median is None else f"{told.median:.2f}"),
        (f"{name} below {goal['dop_limit']:g}", share_text(told.within_limit_share)),
        ("no fix", share_text(told.no_fix_share)),
    ]
