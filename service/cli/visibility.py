"""``sightline visibility``: from a DEM and anchors to files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.layers import write_layer
from service.replacing import replacing
from service.schemas import AnchorIn, VisibilityMapParameters
from service.visibility_map import VisibilityMap, calculate
from terrain import read_dem

from .anchor_files import anchors_from_file
from .anchor_texts import anchor_from_text
from .output import print_json, print_tables, print_warnings, progress_bar, share_text

__all__ = ["anchors_table", "count_table", "make_visibility_map", "output_folder"]

SUMMARY = "visibility.json"
LAYER_FILES = ("visible.tif", "min_visible_altitude.tif", "count.tif", "map.png")


def make_visibility_map(
    dem: str,
    *,
    nodata: float | None,
    crs: str | None,
    anchor_texts: list[str],
    lonlat: bool,
    anchor_files: list[Path],
    asked: dict[str, Any],
    out: Path | None,
    as_json: bool,
) -> None:
    """Read, calculate, write into ``out`` and print. What can be wrong in the request is found before the work."""
    anchors = [anchor_from_text(text, lonlat=lonlat) for text in anchor_texts]
    anchors += [anchor for path in anchor_files for anchor in anchors_from_file(path)]
    parameters = _parameters(anchors, asked)
    grid = read_dem(dem, nodata=nodata, crs=crs)
    folder = None if out is None else output_folder(out)
    with progress_bar("Sight lines") as progress:
        finished = calculate(grid, parameters, progress)
    summary = finished.summary()
    files = [] if folder is None else _write_files(finished, summary, folder)
    if as_json:
        print_json({**summary, "files": [str(path) for path in files]})
        return
    print_tables(anchors_table(summary), count_table(summary))
    print_warnings(summary["warnings"])
    for path in files:
        print(path)


def output_folder(out: Path) -> Path:
    """The folder, made if need be. Raises RequestError where it cannot be one."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RequestError(f"The output folder {str(out)!r} cannot be made: {error.strerror}.") from error
    return out


def anchors_table(summary: dict[str, Any]) -> Table:
    """One row per anchor: where it is and what part of the known ground sees it."""
    receiver = summary["receiver"]
    height = (
        f"{receiver['above_ground_m']:g} m above ground"
        if receiver["above_ground_m"] is not None
        else f"at altitude {receiver['altitude_m']:g} m"
    )
    table = Table(
        title=escape(f"{summary['dem']['name']}: receiver {height}, mode {summary['mode']}"),
        caption=f"Curvature: {summary['curvature']}",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("anchor", style="bold")
    for column in ("east m", "north m", "altitude m", "above\nground m", "visible", "hidden", "unknown"):
        table.add_column(column, justify="right", no_wrap=True)
    for anchor in summary["anchors"]:
        above_m = anchor["above_ground_m"]
        table.add_row(
            escape(anchor["id"]),
            f"{anchor['east_m']:.0f}",
            f"{anchor['north_m']:.0f}",
            f"{anchor['altitude_m']:.1f}",
            "–" if above_m is None else f"{above_m:.1f}",
            *(share_text(anchor[f"{state}_share"]) for state in ("visible", "hidden", "unknown")),
        )
    return table


def count_table(summary: dict[str, Any]) -> Table:
    """The known posts by the anchors they see, as in the picture's legend; with many anchors, no row without a post."""
    table = Table(title="Anchors in sight", title_justify="left")
    for column in ("anchors", "posts", "share of\nknown posts"):
        table.add_column(column, justify="right")
    histogram, undecided = summary["count_histogram"], summary["undecided_posts"]
    known_posts = sum(row["posts"] for row in histogram)
    rows = [(str(row["visible_anchors"]), row["posts"]) for row in histogram]
    rows[0] = (rows[0][0], rows[0][1] - undecided)
    kept = [row for row in rows if row[1] or len(histogram) <= 9]
    for label, posts in [*kept, ("unknown", undecided)] if undecided else kept:
        table.add_row(label, f"{posts:,}", share_text(posts / known_posts if known_posts else None))
    return table


def _parameters(anchors: list[AnchorIn], asked: dict[str, Any]) -> VisibilityMapParameters:
    if not anchors:
        raise RequestError("At least one anchor is needed: --anchor ID,EAST,NORTH,80agl or --anchors FILE.")
    if asked["receiver_above_ground_m"] is not None and asked["receiver_altitude_m"] is not None:
        raise RequestError("Give only one of --receiver-height and --receiver-altitude.")
    given = {name: value for name, value in asked.items() if value is not None}
    return VisibilityMapParameters.model_validate({"anchors": anchors, **given})


def _write_files(finished: VisibilityMap, summary: dict[str, Any], folder: Path) -> list[Path]:
    """Every file whole or not at all; the summary comes last, so where it is new all is new."""
    for name in LAYER_FILES:
        write_layer(finished, name, folder / name)
    with replacing(folder / SUMMARY) as unfinished:
        unfinished.write_text(json.dumps(summary, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / name for name in (SUMMARY, *LAYER_FILES)]
