"""How far fast mode may be off on one grid: what was measured on many, by what can be counted on this one.

Fast mode errs beside the edges of shadows, so the share of posts that it calls wrongly goes with how many there are;
altitudes over hidden posts are off with how rough the ground is and how far shadows reach. The factors below are from
windows and whole tiles of twelve real DEMs and a rough fractal, anchors 2 to 300 m above ground on posts, between
them, on the border and up to 12 posts beyond it (docs/benchmarks.md, "Fast mode by situation").
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["FastErrors", "fast_errors"]

Heights = npt.NDArray[np.float32]

RECEIVERS_M = (0.0, 1.5, 10.0)
LINES = 64  # of a large grid so many lines of posts stand for all
MEAN_OF_EDGES = 0.03  # misclassified posts per edge between neighbours that differ: in the mean …
MOST_OF_EDGES = 0.2  # … and more than with any anchor
MEAN_BY_UNKNOWN, MOST_BY_UNKNOWN = 0.05, 0.5  # the same per edge between known and unknown answers
MOST_OF_UNKNOWN = 8.0  # posts called unknown for nothing, per edge between known and unknown answers
MOST_POSTS = 8.0  # on grids with few edges so many posts may be wrong besides
LARGE_ERRORS = 1.5  # of the bend of the ground, times the root of the grid's longer side in posts


@dataclass(frozen=True, slots=True)
class FastErrors:
    """Of the worst anchor: shares of the known posts, and metres.

    misclassified: share of posts that fast mode and exact mode call differently, about; misclassified_most: at most.
    unknown_most: share that fast mode calls unknown though exact mode knows, at most. large_error_m: what the altitudes
    of all but one in a thousand hidden posts are within; NaN where no three neighbours are known.
    """

    misclassified: float
    misclassified_most: float
    unknown_most: float
    large_error_m: float

    def sentence(self) -> str:
        """The statement that an answer carries."""
        told = [
            f"rays in float32, which err beside the edges of shadows: by what was measured on other grounds, about "
            f"{_digits(100.0 * self.misclassified)} % and at most {_digits(100.0 * self.misclassified_most)} % of an "
            f"anchor's posts on this one differ from exact for receivers up to {RECEIVERS_M[-1]:g} m above ground"
        ]
        if not math.isnan(self.large_error_m):
            told.append(
                "altitudes over all but one in a thousand of its hidden posts are within "
                f"{_digits(self.large_error_m)} m"
            )
        if self.unknown_most > 0.0:
            told.append(f"at most {_digits(100.0 * self.unknown_most)} % more posts than in exact are called unknown")
        return "; ".join(told)


def fast_errors(heights_m: Heights, altitude_m: Heights) -> FastErrors:
    """What fast mode's answer may be off by.

    heights_m: (rows, cols), NaN = unknown; altitude_m: (n_anchors, rows, cols), its answer over them, NaN = unknown.
    """
    rows, cols = heights_m.shape
    tops = np.unique(np.linspace(0, max(rows - 2, 0), min(max(rows - 1, 1), LINES)).astype(np.intp))
    edges = max((_shadow_edges(heights_m, one_m, tops) for one_m in altitude_m), default=0.0)
    # few and far between: no sample of lines tells how many there are
    unknown, known_posts = 0.0, heights_m.size
    if np.isnan(heights_m.min()):
        known = ~np.isnan(heights_m)
        unknown = max((_edges(np.isnan(one_m), known) for one_m in altitude_m), default=0.0)
        known_posts = int(np.count_nonzero(known))
    few = MOST_POSTS / max(known_posts, MOST_POSTS)
    return FastErrors(
        misclassified=MEAN_OF_EDGES * edges + MEAN_BY_UNKNOWN * unknown,
        misclassified_most=min(MOST_OF_EDGES * edges + MOST_BY_UNKNOWN * unknown + few, 1.0),
        unknown_most=min(MOST_OF_UNKNOWN * unknown + few, 1.0) if unknown > 0.0 else 0.0,
        large_error_m=LARGE_ERRORS * math.sqrt(max(rows, cols)) * _bend_m(heights_m, tops),
    )


def _shadow_edges(heights_m: Heights, altitude_m: Heights, tops: npt.NDArray[np.intp]) -> float:
    """Edges of shadows per known post, for the receiver that has most; on some lines of posts, and to the next ones."""
    lines = np.stack([tops, np.minimum(tops + 1, len(heights_m) - 1)], axis=1)
    ground_m, clear_m = heights_m[lines], altitude_m[lines]
    known = ~np.isnan(ground_m)
    # along the first line of each pair, and across
    along, across = known[:, 0, 1:] & known[:, 0, :-1], known[:, 0] & known[:, 1]
    most = 0
    for above_m in RECEIVERS_M:
        seen = clear_m <= ground_m + np.float32(above_m)
        count = int(np.count_nonzero((seen[:, 0, 1:] != seen[:, 0, :-1]) & along))
        most = max(most, count + int(np.count_nonzero((seen[:, 0] != seen[:, 1]) & across)))
    return most / max(int(np.count_nonzero(known[:, 0])), 1)


def _edges(marked: npt.NDArray[np.bool_], known: npt.NDArray[np.bool_]) -> float:
    """Neighbours of which one is marked, both on known ground, per known post."""
    along = int(np.count_nonzero((marked[:, 1:] != marked[:, :-1]) & known[:, 1:] & known[:, :-1]))
    across = int(np.count_nonzero((marked[1:] != marked[:-1]) & known[1:] & known[:-1]))
    return (along + across) / max(int(np.count_nonzero(known)), 1)


def _bend_m(heights_m: Heights, tops: npt.NDArray[np.intp]) -> float:
    """How much slopes change from post to post: mean of the second differences along lines and across them, added."""
    tops = tops[tops + 2 < len(heights_m)]
    along_m = np.abs(np.diff(heights_m[tops].astype(np.float64), 2, axis=1))
    across_m = np.abs(heights_m[tops].astype(np.float64) - 2.0 * heights_m[tops + 1] + heights_m[tops + 2])
    means = [float(bends[~np.isnan(bends)].mean()) for bends in (along_m, across_m) if not np.isnan(bends).all()]
    return sum(means) if means else math.nan


def _digits(number: float) -> str:
    return f"{number:.2g}" if number < 100.0 else f"{number:.0f}"
