"""``sightline visibility``: which anchors are in sight over a whole DEM."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .asking.doubts import TRUSTING, DoubtOptions
from .asking.ground import AreaOptions, Margin
from .asking.options import (
    GROUP,
    AnchorOptions,
    DemPath,
    Output,
    Reading,
    ReceiverHeight,
    RequestFile,
    SignalOptions,
    option,
    told,
)
from .output import share_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.products.visibility.calculate import VisibilityMapSummary

__all__ = ["SUMMARY", "anchors_table", "count_table", "visibility"]

SUMMARY = "visibility.json"
LEFT_OUT = ("arrays.npz", "anchors.geojson")


@GROUP
@dataclass(frozen=True, slots=True)
class ReceiverOptions:
    """How high the receiver is: fields of the request."""

    receiver_above_ground_m: ReceiverHeight = None
    receiver_altitude_m: Annotated[
        float | None, option("One altitude everywhere instead, metres.", "M", "--receiver-altitude")
    ] = None


def visibility(
    dem: DemPath,
    /,
    *,
    anchors: AnchorOptions = AnchorOptions(),
    receiver: ReceiverOptions = ReceiverOptions(),
    sight: SignalOptions = SignalOptions(),
    doubts: DoubtOptions = TRUSTING,
    windows: Annotated[
        bool, option("Read only the ground in reach of anchors with max_range_m: any DEM in metres.")
    ] = False,
    scheduler: Annotated[
        str | None, option("With --windows: work on the Dask cluster of this scheduler.", "ADDRESS")
    ] = None,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Calculate which anchors are in sight over a whole DEM, or over an area of it.

    Writes visibility.json, visible.tif, min_visible_altitude.tif, count.tif,
    map.png and map.kml into --out, with --sight usable margin_db.tif; by windows,
    which a DEM of more posts than are read whole is by itself, only the first and
    the count and lowest altitude.
    """
    from service.products.visibility.request import VisibilityMapParameters
    from terrain import DemTooLargeError

    from .asking.products import ask, request_of_fields

    if scheduler is not None and not windows:
        raise RequestError("--scheduler goes with --windows.")
    if windows and margin_m is not None:
        raise RequestError("--margin is for a DEM that is held; by windows all ground in reach is read.")
    asked: BaseModel | Path | None = request
    if asked is None:
        placed = anchors.part()
        if not placed:
            raise RequestError("At least one anchor is needed: --anchor ID,EAST,NORTH,80agl or --anchors FILE.")
        if receiver.receiver_above_ground_m is not None and receiver.receiver_altitude_m is not None:
            raise RequestError("Give only one of --receiver-height and --receiver-altitude.")
        fields: dict[str, object] = {**told(receiver), **sight.part(placed), **doubts.part()}
        fields["area"] = area.part(in_degrees=anchors.lonlat)
        asked = request_of_fields(fields, VisibilityMapParameters)
    # after the options were read: what is wrong with them must not wait for all that this loads
    from service.products.visibility import VISIBILITY_MAP

    told_of_size: tuple[str, ...] = ()
    if not windows:
        try:
            ask(
                VISIBILITY_MAP,
                dem,
                asked,
                lambda answer: (anchors_table(answer), count_table(answer)),
                summary=SUMMARY,
                left_out=LEFT_OUT,
                reading=reading,
                output=output,
                margin_m=margin_m,
            )
        except DemTooLargeError as error:
            if not Path(dem).is_file():
                raise
            told_of_size = (f"The DEM has {error.cells:,} posts, more than are read whole; it was read by windows.",)
        else:
            return
    from .asking.by_windows import ask_by_windows

    ask_by_windows(dem, asked, summary=SUMMARY, reading=reading, scheduler=scheduler, output=output, told=told_of_size)


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
    decided = ("usable", "not\nusable") if _of_signals(answer) else ("visible", "hidden")
    for column in ("east m", "north m", "altitude m", "above\nground m", *decided, "unknown"):
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
    table = Table(title="Anchors usable" if _of_signals(answer) else "Anchors in sight", title_justify="left")
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


def _of_signals(answer: VisibilityMapSummary) -> bool:
    return answer.parameters.get("sight") == "usable"
