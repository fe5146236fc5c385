"""Maps of a few classes: pixels darkened by relief, and a legend that tells each class's share of the known posts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from terrain import ElevationGrid

from .classes import NO_GROUND_COLOUR, UNKNOWN_COLOUR
from .furniture import INK
from .relief import Sampling, pick
from .sheet import anchor_handle, hatching, lit_ground, margin_legend, rgb

__all__ = ["UNDECIDED", "MapClass", "class_legend", "class_pixels"]

# in an array of class numbers: what is unknown
UNDECIDED = np.uint8(255)


@dataclass(frozen=True, slots=True)
class MapClass:
    """A class as the legend names it, and its colour #rrggbb."""

    label: str
    colour: str


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


def class_legend(
    axes: Axes,
    grid: ElevationGrid,
    numbers: npt.NDArray[np.uint8],
    classes: Sequence[MapClass],
    title: str,
    more: Sequence[tuple[str, Artist]] = (),
) -> None:
    """Classes in their order with their share of the known posts, what else is drawn, and the anchors."""
    known = ~np.isnan(grid.heights_m)
    posts = np.bincount(numbers[known], minlength=256)
    known_posts = max(int(posts.sum()), 1)
    rows: list[tuple[str, Artist, int | None]] = [
        (kind.label, Patch(fc=kind.colour, ec=INK, lw=0.6), int(posts[number])) for number, kind in enumerate(classes)
    ]
    if posts[UNDECIDED]:
        unknown = Patch(fc=UNKNOWN_COLOUR, ec="#777777", lw=0.6, hatch="/////")
        rows.append(("unknown", unknown, int(posts[UNDECIDED])))
    if not known.all():
        rows.append(("no ground", Patch(fc=NO_GROUND_COLOUR, ec=INK, lw=0.6), None))
    widest = max(len(label) for label, _, n in rows if n is not None)
    labels = [label if n is None else f"{label:<{widest}} {100 * n / known_posts:5.1f} %" for label, _, n in rows]
    handles = [handle for _, handle, _ in rows]
    margin_legend(
        axes,
        [*handles, *(handle for _, handle in more), anchor_handle()],
        [*labels, *(label for label, _ in more), "anchor"],
        f"{title},\nshare of known posts",
    )
