"""The visibility map: who is visible at one receiver height over a whole grid, and what to say about it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from service.parts.asked_frame import told_as_asked
from service.parts.map_facts import Calculation, curvature_of, dem_summary, share_of
from service.parts.positions import resolve_anchor
from service.products.visibility.request import VisibilityMapParameters
from terrain import ElevationGrid, height_at
from visibility import UNKNOWN, VISIBLE, Anchor, min_visible_altitude

__all__ = ["VisibilityMap", "calculate"]

# What is left for counting once the sight lines are done.
SHARE_OF_SIGHT_LINES = 0.95


@dataclass(frozen=True, eq=False)
class VisibilityMap:
    """A finished map.

    visible: (n_anchors, rows, cols) uint8, 1 visible, 0 hidden, 255 unknown, for the receiver height asked for.
    altitude_m: (n_anchors, rows, cols) float32, minimum visible altitude; NaN = unknown, +inf = at no altitude.
    count: (rows, cols) uint8 (uint16 from 255 anchors on), anchors surely visible.
    unknown_count: same shape and type, anchors whose sight is unknown there.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: VisibilityMapParameters
    visible: npt.NDArray[np.uint8]
    altitude_m: npt.NDArray[np.float32]
    count: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
    unknown_count: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
    calculation: Calculation

    @property
    def undecided(self) -> npt.NDArray[np.bool_]:
        """(rows, cols): known posts where nobody is surely visible, but somebody may be."""
        undecided: npt.NDArray[np.bool_] = (self.count == 0) & (self.unknown_count > 0)
        return undecided & ~np.isnan(self.grid.heights_m)

    def summary(self) -> dict[str, Any]:
        """What visibility.json says: plain values, ready for JSON, every number with its unit in its name."""
        known = None if self.grid.unknown_posts == 0 else ~np.isnan(self.grid.heights_m)
        known_posts = self.grid.rows * self.grid.cols - self.grid.unknown_posts
        return {
            "version": self.calculation.version,
            "mode": self.parameters.mode,
            "error_statement": self.calculation.error_statement,
            "curvature": self.calculation.curvature,
            "unknown": self.parameters.unknown,
            "receiver": {
                "above_ground_m": self.parameters.receiver_above_ground_m,
                "altitude_m": self.parameters.receiver_altitude_m,
            },
            "dem": dem_summary(self.grid),
            "anchors": [
                _anchor_summary(self.grid, anchor, self.visible[i], known, known_posts)
                for i, anchor in enumerate(self.anchors)
            ],
            "count_histogram": _count_histogram(self.count, known, known_posts, len(self.anchors)),
            "undecided_posts": int(np.count_nonzero(self.undecided)),
            "posts_with_unknown_anchors": int(np.count_nonzero(self.unknown_count)),
            "warnings": list(self.calculation.warnings),
            "timing": {"calculation_s": self.calculation.elapsed_s},
            "parameters": self.parameters.model_dump(mode="json", exclude_none=True),
        }


@told_as_asked
def calculate(
    grid: ElevationGrid,
    parameters: VisibilityMapParameters,
    progress: Callable[[float], None] | None = None,
) -> VisibilityMap:
    """The map that the parameters ask for on this grid; progress is called with the finished share 0..1.

    Raises AnchorError, VisibilityInputError, FrameError.
    """
    anchors = tuple(resolve_anchor(grid, anchor) for anchor in parameters.anchors)
    answer = min_visible_altitude(
        grid,
        anchors,
        parameters.mode,
        curvature_of(parameters),
        unknown=parameters.unknown,
        progress=None if progress is None else lambda share: progress(SHARE_OF_SIGHT_LINES * share),
    )
    visible = answer.visible(
        above_ground_m=parameters.receiver_above_ground_m, altitude_m=parameters.receiver_altitude_m
    )
    calculation = Calculation(
        answer.error_statement,
        answer.curvature.sentence(),
        (*grid.provenance.warnings, *answer.warnings, *_receiver_warnings(grid, parameters.receiver_altitude_m)),
        answer.elapsed_s,
        answer.version,
    )
    finished = VisibilityMap(
        grid,
        anchors,
        parameters,
        visible,
        answer.altitude_m,
        _count(visible, VISIBLE),
        _count(visible, UNKNOWN),
        calculation,
    )
    if progress is not None:
        progress(1.0)
    return finished


def _receiver_warnings(grid: ElevationGrid, receiver_altitude_m: float | None) -> tuple[str, ...]:
    if receiver_altitude_m is None:
        return ()
    below = int(np.count_nonzero(grid.heights_m > receiver_altitude_m))
    if below == 0:
        return ()
    known_posts = grid.rows * grid.cols - grid.unknown_posts
    return (
        f"The receiver's altitude of {receiver_altitude_m:g} m is below the ground at {below:,} of {known_posts:,} "
        "known posts; no anchor is in sight there.",
    )


def _count(visible: npt.NDArray[np.uint8], value: np.uint8) -> npt.NDArray[np.uint8] | npt.NDArray[np.uint16]:
    # 255 is kept free to mean "nothing known" in count.tif
    counts = np.zeros(visible.shape[1:], np.uint8 if visible.shape[0] < 255 else np.uint16)
    for of_one_anchor in visible:
        counts += of_one_anchor == value
    return counts


def _anchor_summary(
    grid: ElevationGrid,
    anchor: Anchor,
    visible: npt.NDArray[np.uint8],
    known: npt.NDArray[np.bool_] | None,
    known_posts: int,
) -> dict[str, Any]:
    over_known = visible if known is None else visible[known]
    seen, unknown = int(np.count_nonzero(over_known == VISIBLE)), int(np.count_nonzero(over_known == UNKNOWN))
    ground_m = float(height_at(grid, anchor.east_m, anchor.north_m))
    return {
        "id": anchor.id,
        "east_m": anchor.east_m,
        "north_m": anchor.north_m,
        "altitude_m": anchor.altitude_m,
        "above_ground_m": None if math.isnan(ground_m) else anchor.altitude_m - ground_m,
        "visible_share": share_of(seen, known_posts),
        "hidden_share": share_of(known_posts - seen - unknown, known_posts),
        "unknown_share": share_of(unknown, known_posts),
    }


def _count_histogram(
    count: npt.NDArray[Any], known: npt.NDArray[np.bool_] | None, known_posts: int, n_anchors: int
) -> list[dict[str, Any]]:
    posts = np.bincount((count if known is None else count[known]).ravel(), minlength=n_anchors + 1)
    return [
        {"visible_anchors": number, "posts": int(posts[number]), "share": share_of(int(posts[number]), known_posts)}
        for number in range(n_anchors + 1)
    ]
