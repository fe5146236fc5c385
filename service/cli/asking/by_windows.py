"""``sightline visibility --windows`` and ``sightline place --windows``: over a DEM larger than memory."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pydantic import BaseModel
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.products import Work
from service.products.placements.by_windows import WINDOW_PLACEMENT, WindowPlacementSummary
from service.products.windows import WINDOW_MAP
from service.products.windows.answer import WindowMapSummary
from service.products.windows.request import WindowMapParameters
from terrain import LargeDem, open_dem

from ..output import facts_table, output_folder, share_text
from .options import Output, Reading
from .products import ask, request_of_fields

__all__ = ["ask_by_windows", "place_by_windows"]


def ask_by_windows(
    dem: str,
    asked: BaseModel | Path,
    *,
    summary: str,
    reading: Reading,
    scheduler: str | None,
    output: Output,
    told: Sequence[str] = (),
) -> None:
    """Read by windows, calculate, write and print. told: what there is to know of how it came to that.

    asked: what the options make, or the file of a request. scheduler: address of a Dask scheduler whose workers do it.
    Raises RequestError.
    """
    ground = _opened(dem, reading)
    if isinstance(asked, BaseModel):
        asked = request_of_fields(asked.model_dump(exclude_unset=True), WindowMapParameters)
    names = (summary, *(layer.name for layer in WINDOW_MAP.layers))
    beside = None if output.out is None else output_folder(output.out, names)
    # where the workers of a cluster see it, and where it is big enough
    with tempfile.TemporaryDirectory(prefix=".sightline-", dir=beside, ignore_cleanup_errors=True) as folder:
        ask(
            WINDOW_MAP,
            ground.frame(),
            asked,
            lambda answer: (_table(answer),),
            summary=summary,
            reading=reading,
            output=output,
            what="Sight lines by windows",
            work=Work(scheduler=scheduler, folder=Path(folder)),
            changes=None if scheduler is None else {"run_on": "cluster"},
            told=told,
        )


def place_by_windows(
    dem: str,
    asked: BaseModel | Path,
    *,
    summary: str,
    reading: Reading,
    output: Output,
    told: Sequence[str],
    changes: Mapping[str, object],
    work: Work,
) -> None:
    """Read by windows, place, write and print. changes: what the command line says of the request.

    Raises RequestError.
    """
    ground = _opened(dem, reading)
    names = (summary, *(layer.name for layer in WINDOW_PLACEMENT.layers))
    beside = None if output.out is None else output_folder(output.out, names)
    # where the workers of a cluster see it, and where it is big enough
    with tempfile.TemporaryDirectory(prefix=".sightline-", dir=beside, ignore_cleanup_errors=True) as folder:
        ask(
            WINDOW_PLACEMENT,
            ground.frame(),
            asked,
            _tables_of_placement,
            summary=summary,
            reading=reading,
            output=output,
            what="Placing anchors by windows",
            work=replace(work, folder=Path(folder)),
            changes=changes,
            told=told,
        )


def _opened(dem: str, reading: Reading) -> LargeDem:
    """Raises RequestError for options that go with a DEM that is held."""
    not_so = {
        "--crs": reading.crs,
        "--band": reading.band,
        "--cell-m": reading.cell_m,
        "--resolution": reading.resolution_m,
        "--buildings": reading.cover.buildings,
        "--canopy": None if replace(reading.cover, buildings=None).bare else True,
    }
    odd = [option for option, given in not_so.items() if given is not None]
    if odd:
        raise RequestError(f"{' and '.join(odd)} cannot be given for a DEM that is read by windows.")
    return open_dem(dem, nodata=reading.nodata, height_unit=reading.height_unit, vertical_datum=reading.vertical_datum)


def _tables_of_placement(answer: WindowPlacementSummary) -> tuple[Table, ...]:
    """The placed anchors, and what they are worth."""
    table = Table(title=escape(answer.goal), title_justify="left")
    table.add_column("placed", style="bold")
    for column in ("east m", "north m", "altitude m", "above\nground m", "adds"):
        table.add_column(column, justify="right", no_wrap=True)
    for one in answer.placed:
        above = "–" if one.above_ground_m is None else f"{one.above_ground_m:.1f}"
        numbers = (f"{one.east_m:.0f}", f"{one.north_m:.0f}", f"{one.altitude_m:.1f}", above)
        table.add_row(escape(one.id), *numbers, share_text(one.marginal_share))
    facts = [
        ("before", share_text(answer.before_share)),
        ("with the placed anchors", share_text(answer.value_share)),
        ("the same, mode exact", share_text(answer.exact_share)),
        ("no choice exceeds", share_text(answer.bound_share)),
        ("greedy alone", share_text(answer.greedy_share)),
        ("posts that count", f"{answer.targets.points:,}"),
        ("candidates", f"{answer.candidates.left:,}"),
        *((f"  removed, {name}", f"{number:,}") for name, number in answer.candidates.removed.items()),
    ]
    if answer.stopped:
        facts.insert(0, ("stopped early", "this is the best so far"))
    return table, facts_table("What it is worth", facts)


def _table(answer: WindowMapSummary) -> Table:
    """One row per anchor: where it is and what part of the posts in its reach sees it."""
    ground = answer.dem
    table = Table(
        title=escape(f"{ground.name}: {ground.rows:,} × {ground.cols:,} posts by windows, mode {answer.mode}"),
        caption=f"Curvature: {answer.curvature}",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("anchor", style="bold")
    decided = ("usable", "not\nusable") if answer.sight == "usable" else ("visible", "hidden")
    for column in ("east m", "north m", "altitude m", "range m", "posts in reach", *decided, "unknown"):
        table.add_column(column, justify="right", no_wrap=True)
    for anchor in answer.anchors:
        posts = anchor.posts_in_reach
        shares = (anchor.visible_posts, anchor.hidden_posts, anchor.unknown_posts)
        table.add_row(
            escape(anchor.id),
            f"{anchor.east_m:.0f}",
            f"{anchor.north_m:.0f}",
            f"{anchor.altitude_m:.1f}",
            f"{anchor.max_range_m:.0f}",
            f"{posts:,}",
            *(share_text(share / posts if posts else None) for share in shares),
        )
    return table
