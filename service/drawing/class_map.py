"""Maps of a few classes: pixels darkened by relief, and a legend that tells each class's share of the known posts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from service.drawing.class_map import NO_GROUND_COLOUR, UNKNOWN_COLOUR
from service.drawing.furniture import INK
from service.drawing.sheet import Sampling, anchor_handle, hatching, lit_ground, margin_legend, pick, rgb
from terrain import ElevationGrid

__all__ = ["UNDECIDED", "ClassShare", "MapClass", "class_legend", "class_pixels", "class_shares", "share_legend"]

# in an array of class numbers: what is unknown
UNDECIDED = np.uint8(255)


@dataclass(frozen=True, slots=True)
class MapClass:
    """A class as the legend names it, and its colour #rrggbb."""

    label: str
    colour: str


@dataclass(frozen=True, slots=True)
class ClassShare:
    """A row of a legend: name, colour #rrggbb, and how many of the known posts; None where it is no part of them."""

    label: str
    colour: str
    posts: int | None


def class_pixels(
    grid: ElevationGrid, numbers: npt.NDArray[np.uint8], classes: Sequence[MapClass]
) -> npt.NDArray[np.uint8]:
    """(rows, cols, 3) picture of class numbers (rows, cols); what is unknown is grey and hatched."""
    sampling = Sampling.of(grid.shape)
    shown = pick(numbers, sampling)
    light, no_ground = lit_ground(grid, sampling)
    table = np.zeros((256, 3), np.float32)
    table[: len(classes)] = [rgb(kind.colour) for kind in classes]
    colour = table[shown] * light[..., None]
    unknown = shown == UNDECIDED
    colour[unknown] = rgb(UNKNOWN_COLOUR)
    colour[unknown & hatching(shown.shape)] *= 0.72
    colour[no_ground & unknown] = rgb(NO_GROUND_COLOUR)
    return np.asarray(np.rint(colour * 255.0), np.uint8)


def class_shares(grid: ElevationGrid, numbers: npt.NDArray[np.uint8], classes: Sequence[MapClass]) -> list[ClassShare]:
    """Classes in their order with their posts, then what is unknown and what is no ground, where there is any."""
    known = ~np.isnan(grid.heights_m)
    posts = np.bincount(numbers[known], minlength=256)
    rows = [ClassShare(kind.label, kind.colour, int(posts[number])) for number, kind in enumerate(classes)]
    if posts[UNDECIDED]:
        rows.append(ClassShare("unknown", UNKNOWN_COLOUR, int(posts[UNDECIDED])))
    if not known.all():
        rows.append(ClassShare("no ground", NO_GROUND_COLOUR, None))
    return rows


def class_legend(
    axes: Axes,
    grid: ElevationGrid,
    numbers: npt.NDArray[np.uint8],
    classes: Sequence[MapClass],
    title: str,
    more: Sequence[tuple[str, Artist]] = (),
) -> None:
    """Classes in their order with their share of the known posts, what else is drawn, and the anchors."""
    share_legend(axes, class_shares(grid, numbers, classes), title, more)


def share_legend(axes: Axes, shares: Sequence[ClassShare], title: str, more: Sequence[tuple[str, Artist]] = ()) -> None:
    """Rows with their share of the known posts, what else is drawn, and the anchors."""
    known_posts = max(sum(share.posts or 0 for share in shares), 1)
    widest = max(len(share.label) for share in shares if share.posts is not None)
    labels = [
        share.label if share.posts is None else f"{share.label:<{widest}} {100 * share.posts / known_posts:5.1f} %"
        for share in shares
    ]
    handles = [_patch(share) for share in shares]
    margin_legend(
        axes,
        [*handles, *(handle for _, handle in more), anchor_handle()],
        [*labels, *(label for label, _ in more), "anchor"],
        f"{title},\nshare of known posts",
    )


def _patch(share: ClassShare) -> Patch:
    if share.label == "unknown":
        return Patch(fc=share.colour, ec="#777777", lw=0.6, hatch="/////")
    return Patch(fc=share.colour, ec=INK, lw=0.6)
