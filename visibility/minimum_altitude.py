"""Minimum visible altitude: the lowest altitude over every post from which an anchor is in sight."""

from __future__ import annotations

import importlib.metadata
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid

from .anchors import Anchor, check_anchors
from .curvature import Curvature
from .errors import VisibilityInputError

__all__ = ["HIDDEN", "UNKNOWN", "VISIBLE", "MinimumVisibleAltitude", "Mode", "UnknownGround", "min_visible_altitude"]

Mode = Literal["fast", "exact"]
UnknownGround = Literal["unknown", "open", "blocked"]

HIDDEN, VISIBLE, UNKNOWN = np.uint8(0), np.uint8(1), np.uint8(255)


@dataclass(frozen=True, eq=False)
class MinimumVisibleAltitude:
    """The answer to ``min_visible_altitude``.

    altitude_m: (n_anchors, rows, cols) float32, lowest altitude over each post from which the anchor is in sight and
        within its antenna limits; NaN = unknown (the line crosses unknown ground), +inf = at no altitude.
    hidden_below_m: same shape; below it the anchor is hidden for certain by known ground, also where altitude_m is NaN.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    altitude_m: npt.NDArray[np.float32]
    hidden_below_m: npt.NDArray[np.float32]
    mode: Mode
    unknown: UnknownGround
    curvature: Curvature
    error_statement: str
    warnings: tuple[str, ...]
    elapsed_s: float
    version: str

    def visible(self, *, above_ground_m: float | None = None, altitude_m: float | None = None) -> npt.NDArray[np.uint8]:
        """(n_anchors, rows, cols) uint8 for receivers at one height: 1 visible, 0 hidden, 255 unknown.

        Give exactly one height: above each post's ground (>= 0), or an altitude. Raises VisibilityInputError.
        """
        raise NotImplementedError

    def margin_m(
        self, *, above_ground_m: float | None = None, altitude_m: float | None = None
    ) -> npt.NDArray[np.float32]:
        """(n_anchors, rows, cols) float32: receiver altitude minus altitude_m, the signed clearance; NaN = unknown."""
        raise NotImplementedError


def min_visible_altitude(
    grid: ElevationGrid,
    anchors: Sequence[Anchor],
    mode: Mode = "fast",
    curvature: Curvature | None = None,
    *,
    unknown: UnknownGround = "unknown",
    progress: Callable[[float], None] | None = None,
) -> MinimumVisibleAltitude:
    """Lowest altitude over every post from which each anchor is in sight.

    mode: "fast" is the column-wise O(N) sweep; "exact" the maximum over every edge of the triangulation that the sight
        line crosses.
    curvature: None takes what the grid's CRS implies (Curvature.of); FLAT switches it off.
    unknown: what a line over unknown ground is: "unknown" (NaN), "open" (ignored) or "blocked" (+inf).
    progress: called with the finished share 0..1, at least once per anchor.
    Raises AnchorError, VisibilityInputError.
    """
    raise NotImplementedError
