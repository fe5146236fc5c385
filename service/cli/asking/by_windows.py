"""``sightline visibility --windows``: a map over a DEM larger than memory."""

from __future__ import annotations

import json

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.files.layer import replacing
from service.products import Work
from service.products.visibility.large_answer import LargeMapSummary
from service.products.visibility.large_map import COUNT, LOWEST, make_large_map
from service.products.visibility.request import VisibilityMapParameters
from terrain import open_dem

from ..output import (
    leaving_nothing_new,
    output_folder,
    print_json,
    print_tables,
    print_warnings,
    progress_bar,
    share_text,
)
from .options import Output, Reading

__all__ = ["make_map_by_windows"]


def make_map_by_windows(
    dem: str,
    parameters: VisibilityMapParameters,
    *,
    summary: str,
    reading: Reading,
    scheduler: str | None,
    output: Output,
    told: tuple[str, ...] = (),
) -> None:
    """Read by windows, calculate, write and print. told: what there is to know of how it came to that.

    scheduler: address of a Dask scheduler whose workers do it. Raises RequestError.
    """
    not_so = {
        "--crs": reading.crs,
        "--band": reading.band,
        "--cell-m": reading.cell_m,
        "--buildings": reading.cover.buildings,
    }
    odd = [option for option, given in not_so.items() if given is not None]
    if odd:
        raise RequestError(f"{' and '.join(odd)} cannot be given for a DEM that is read by windows.")
    if output.out is None:
        raise RequestError("A map by windows is files: give --out DIR.")
    ground = open_dem(
        dem, nodata=reading.nodata, height_unit=reading.height_unit, vertical_datum=reading.vertical_datum
    )
    names = (COUNT, LOWEST, summary)
    folder = output_folder(output.out, names)
    with progress_bar("Sight lines by windows") as progress, leaving_nothing_new(folder, names):
        answer = make_large_map(ground, parameters, folder, Work(progress=progress, scheduler=scheduler))
        answer = answer.model_copy(update={"warnings": [*told, *answer.warnings]})
        document = answer.model_dump(mode="json")
        with replacing(folder / summary) as unfinished:
            unfinished.write_text(json.dumps(document, allow_nan=False, indent=1), encoding="utf-8")
    written = [folder / name for name in (summary, COUNT, LOWEST)]
    if output.as_json:
        print_json({**document, "files": [str(path) for path in written]})
        return
    print_tables(_table(answer))
    print_warnings(answer.warnings)
    for path in written:
        print(path)


def _table(answer: LargeMapSummary) -> Table:
    """One row per anchor: where it is and what part of the posts in its reach sees it."""
    ground = answer.dem
    table = Table(
        title=escape(f"{ground.name}: {ground.rows:,} × {ground.cols:,} posts by windows, mode {answer.mode}"),
        caption=f"Curvature: {answer.curvature}",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("anchor", style="bold")
    for column in ("east m", "north m", "altitude m", "range m", "posts in reach", "visible", "hidden", "unknown"):
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
