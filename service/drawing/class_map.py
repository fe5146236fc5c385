"""Maps of a few classes: colours, pixels darkened by relief, legends with shares, pixels to lay over a hillshade."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.patches import Patch
from PIL import Image

from service.drawing.furniture import INK
from service.drawing.sheet import Sampling, anchor_handle, hatching, lit_ground, margin_legend, pick, rgb
from terrain import ElevationGrid

__all__ = [
    "NO_GROUND_COLOUR",
    "UNDECIDED",
    "UNKNOWN_COLOUR",
    "ClassShare",
    "CountClass",
    "MapClass",
    "class_legend",
    "class_pixels",
    "class_shares",
    "count_classes",
    "lookup_table",
    "share_legend",
    "write_hillshade",
    "write_legend",
    "write_pixels",
]

MOST_CLASSES = 8
# None in sight is the news a planner looks for: a warm colour that no class of the blue-green ramp comes near.
NONE_COLOUR = "#bd8468"
UNKNOWN_COLOUR = "#b9b9b9"
NO_GROUND_COLOUR = "#e4e4e4"
RAMP, RAMP_FROM, RAMP_TO = "YlGnBu", 0.12, 0.86
# in an array of class numbers: what is unknown
UNDECIDED = np.uint8(255)


@dataclass(frozen=True, slots=True)
class CountClass:
    """Posts that see ``first``..``last`` anchors, and their colour."""

    first: int
    last: int
    rgb: tuple[float, float, float]

    @property
    def colour(self) -> str:
        """The same as #rrggbb."""
        return to_hex(self.rgb)

    @property
    def label(self) -> str:
        """How the legend names it."""
        return str(self.first) if self.first == self.last else f"{self.first}–{self.last}"


def count_classes(n_anchors: int, fewest: int = 1) -> tuple[CountClass, ...]:
    """None, then one class per count from the fewest on; with many anchors, classes of about equal width."""
    n_classes = min(n_anchors - fewest + 1, MOST_CLASSES - 1)
    edges = np.linspace(fewest - 1, n_anchors, n_classes + 1).round().astype(int)
    ramp = matplotlib.colormaps[RAMP](np.linspace(RAMP_FROM, RAMP_TO, n_classes) if n_classes > 1 else [0.6])
    ramped = (
        CountClass(int(low) + 1, int(high), (float(r), float(g), float(b)))
        for low, high, (r, g, b, _) in zip(edges[:-1], edges[1:], ramp, strict=True)
    )
    return CountClass(0, 0, to_rgb(NONE_COLOUR)), *ramped


def lookup_table(classes: tuple[CountClass, ...]) -> npt.NDArray[np.float32]:
    """(n_anchors + 1, 3) colour of each count."""
    return np.array([c.rgb for c in classes for _ in range(c.first, c.last + 1)], np.float32)


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
    marked: str = "anchor",
) -> None:
    """Classes in their order with their share of the known posts, what else is drawn, and what the marks are."""
    share_legend(axes, class_shares(grid, numbers, classes), title, more, marked)


def share_legend(
    axes: Axes,
    shares: Sequence[ClassShare],
    title: str,
    more: Sequence[tuple[str, Artist]] = (),
    marked: str = "anchor",
) -> None:
    """Rows with their share of the known posts, what else is drawn, and what the marks are."""
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
        [*labels, *(label for label, _ in more), marked],
        f"{title},\nshare of known posts",
    )


def _patch(share: ClassShare) -> Patch:
    if share.label == "unknown":
        return Patch(fc=share.colour, ec="#777777", lw=0.6, hatch="/////")
    return Patch(fc=share.colour, ec=INK, lw=0.6)


def write_hillshade(grid: ElevationGrid, path: Path) -> None:
    """The ground lit from the north-west, grey; clear where no ground is known."""
    light, _ = lit_ground(grid, Sampling.of(grid.shape))
    grey = np.asarray(np.rint(light * 255.0), np.uint8)
    write_pixels(grid, np.stack((grey, grey, grey), axis=-1), path)


def write_pixels(grid: ElevationGrid, pixels: npt.NDArray[np.uint8], path: Path) -> None:
    """(rows, cols, 3) pixels as a PNG that is clear where no ground is known."""
    _, no_ground = lit_ground(grid, Sampling.of(grid.shape))
    alpha = np.where(no_ground, 0, 255).astype(np.uint8)
    Image.fromarray(np.dstack((pixels, alpha))).save(path, format="PNG")


def write_legend(title: str, shares: Sequence[ClassShare], path: Path) -> None:
    """The classes of a map as JSON; share: of the known posts, 0..1; null where it is no part of them."""
    known_posts = sum(share.posts or 0 for share in shares)
    classes = [
        {
            "label": share.label,
            "colour": share.colour,
            "posts": share.posts,
            "share": None if share.posts is None or not known_posts else share.posts / known_posts,
        }
        for share in shares
    ]
    legend = {"title": title, "known_posts": known_posts, "classes": classes}
    path.write_text(json.dumps(legend, allow_nan=False), encoding="utf-8")
