"""``sightline visibility``: from a DEM and anchors to files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.parts.anchors import AnchorIn
from service.products.visibility.answer import VisibilityMapSummary
from service.products.visibility.request import VisibilityMapParameters

from .maps import anchors_of, make_map
from .output import share_text

__all__ = ["anchors_table", "count_table", "make_visibility_map"]

SUMMARY = "visibility.json"
LEFT_OUT = ("arrays.npz", "anchors.geojson")


def make_visibility_map(
    dem: str,
    *,
    reading: dict[str, Any],
    anchor_texts: list[str],
    lonlat: bool,
    anchor_files: list[Path],
    asked: dict[str, Any],
    heights: frozenset[str],
    margin_m: float | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Read, calculate, write into ``out`` and print. What can be wrong in the request is found before the work."""
    parameters = _parameters(anchors_of(anchor_texts, anchor_files, lonlat=lonlat), asked)
    # after the options were read: what is wrong with them must not wait for all that this loads
    from service.products.visibility.product import VISIBILITY_MAP

    make_map(
        dem,
        VISIBILITY_MAP,
        parameters,
        lambda answer: (anchors_table(answer), count_table(answer)),
        summary=SUMMARY,
        left_out=LEFT_OUT,
        reading=reading,
        heights=heights,
        margin_m=margin_m,
        out=out,
        as_json=as_json,
    )


def anchors_table(answer: VisibilityMapSummary) -> Table:
    """One row per anchor: where it is and what part of the known ground sees it."""
    receiver = answer.receiver
    height = (
        f"{receiver.above_ground_m:g} m above ground"
        if receiver.above_ground_m is not None
        else f"at altitude {receiver.altitude_m:g} m"
    )
    table = Table(
        title=escape(f"{answer.dem.name}: receiver {height}, mode {answer.mode}"),
        caption=f"Curvature: {answer.curvature}",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("anchor", style="bold")
    for column in ("east m", "north m", "altitude m", "above\nground m", "visible", "hidden", "unknown"):
        table.add_column(column, justify="right", no_wrap=True)
    for anchor in answer.anchors:
        above_m = anchor.above_ground_m
        table.add_row(
            escape(anchor.id),
            f"{anchor.east_m:.0f}",
            f"{anchor.north_m:.0f}",
            f"{anchor.altitude_m:.1f}",
            "–" if above_m is None else f"{above_m:.1f}",
            *(share_text(share) for share in (anchor.visible_share, anchor.hidden_share, anchor.unknown_share)),
        )
    return table


def count_table(answer: VisibilityMapSummary) -> Table:
    """The known posts by the anchors they see, as in the picture's legend; with many anchors, no row without a post."""
    table = Table(title="Anchors in sight", title_justify="left")
    for column in ("anchors", "posts", "share of\nknown posts"):
        table.add_column(column, justify="right")
    histogram, undecided = answer.count_histogram, answer.undecided_posts
    known_posts = sum(row.posts for row in histogram)
    rows = [(str(row.visible_anchors), row.posts) for row in histogram]
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
