"""Minimum visible altitude: the lowest altitude over every post from which an anchor is in sight; kept per anchor."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Protocol, get_args

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from terrain.version import VERSION
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import Anchor, DistantAnchor, check_anchors, hide_beyond_reach, raise_to_reach
from visibility.sight.clear_altitudes import UnknownGround, clear_altitudes, raise_behind_standing
from visibility.sight.curvature import Curvature
from visibility.sight.doubts import forget_where_doubted
from visibility.sight.fast_errors import fast_errors
from visibility.sight.kernels.reach import classify
from visibility.sight.sweeps import exact_sweep, fast_sweep

__all__ = [
    "HIDDEN",
    "UNKNOWN",
    "VISIBLE",
    "MinimumVisibleAltitude",
    "Mode",
    "SurfaceCache",
    "Surfaces",
    "UnknownGround",
    "min_visible_altitude",
]

Mode = Literal["fast", "exact"]

HIDDEN, VISIBLE, UNKNOWN = np.uint8(0), np.uint8(1), np.uint8(255)

ENGINES = {"fast": fast_sweep, "exact": exact_sweep}
EXACT_ERROR = "every edge of the triangulated surface, in float64: altitudes within 1 mm of the exact maximum"
SIGNAL_ERROR = (
    "signals over every edge of the triangulated surface: lowest altitudes to 0.1 m; what the models "
    "leave out is the radios' spread"
)


@dataclass(frozen=True, eq=False)
class MinimumVisibleAltitude:
    """The answer to ``min_visible_altitude``.

    altitude_m: (n_anchors, rows, cols) float32, lowest altitude over each post from which the anchor is in sight and
        within its antenna limits; NaN = unknown (the line crosses unknown ground), +inf = at no altitude.
    hidden_below_m: same shape; below it the anchor is hidden for certain, also where altitude_m is NaN. The same array
        as altitude_m where nothing is unknown.
    of_signals: the signals of all anchors decided, not sight (``min_usable_altitude``).
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    altitude_m: npt.NDArray[np.float32]
    hidden_below_m: npt.NDArray[np.float32]
    mode: Mode
    unknown: UnknownGround
    curvature: Curvature
    warnings: tuple[str, ...]
    elapsed_s: float
    version: str
    of_signals: bool = False

    @cached_property
    def error_statement(self) -> str:
        """What this answer may be off by: in fast mode on this ground, with these anchors."""
        if self.of_signals:
            return SIGNAL_ERROR
        return EXACT_ERROR if self.mode == "exact" else fast_errors(self.grid.heights_m, self.altitude_m).sentence()

    def visible(self, *, above_ground_m: float | None = None, altitude_m: float | None = None) -> npt.NDArray[np.uint8]:
        """(n_anchors, rows, cols) uint8 for receivers at one height: 1 visible, 0 hidden, 255 unknown.

        Give exactly one height: above each post's ground (>= 0), or an altitude. Raises VisibilityInputError.
        """
        base_m, above_m = self._receiver(above_ground_m, altitude_m)
        seen = np.zeros(self.altitude_m.shape, np.uint8)
        classify(self.altitude_m, self.hidden_below_m, base_m, above_m, seen)
        for number, anchor in enumerate(self.anchors):
            if isinstance(anchor, DistantAnchor):
                continue
            # the lowest altitude says nothing about limits that a receiver can be above
            hide_beyond_reach(self.grid, anchor, self.curvature, base_m, above_m, seen[number])
        return seen

    def within_limits(
        self, *, above_ground_m: float | None = None, altitude_m: float | None = None
    ) -> npt.NDArray[np.bool_]:
        """(n_anchors, rows, cols) bool: whether receivers at one height are within antenna limits, sight apart."""
        base_m, above_m = self._receiver(above_ground_m, altitude_m)
        within = np.ones(self.altitude_m.shape, np.uint8)
        for number, anchor in enumerate(self.anchors):
            if isinstance(anchor, Anchor):
                hide_beyond_reach(self.grid, anchor, self.curvature, base_m, above_m, within[number])
        return np.asarray(within == VISIBLE, np.bool_)

    def margin_m(
        self, *, above_ground_m: float | None = None, altitude_m: float | None = None
    ) -> npt.NDArray[np.float32]:
        """(n_anchors, rows, cols) float32: receiver altitude minus altitude_m, the signed clearance; NaN = unknown."""
        base_m, above_m = self._receiver(above_ground_m, altitude_m)
        margin_m: npt.NDArray[np.float32] = base_m + above_m - self.altitude_m
        return margin_m

    def window(self, first_row: int, last_row: int, first_col: int, last_col: int) -> MinimumVisibleAltitude:
        """The same over some of the posts, ends included: ground around them hides as before."""
        part = (slice(first_row, last_row + 1), slice(first_col, last_col + 1))
        altitude_m = np.ascontiguousarray(self.altitude_m[:, *part])
        same = self.hidden_below_m is self.altitude_m
        return replace(
            self,
            grid=self.grid.window(first_row, last_row, first_col, last_col),
            altitude_m=altitude_m,
            hidden_below_m=altitude_m if same else np.ascontiguousarray(self.hidden_below_m[:, *part]),
        )

    def _receiver(
        self, above_ground_m: float | None, altitude_m: float | None
    ) -> tuple[npt.NDArray[np.float32], np.float32]:
        """Altitudes of (rows, cols), and how far above them receivers are."""
        if above_ground_m is not None and altitude_m is None:
            if not (math.isfinite(above_ground_m) and above_ground_m >= 0.0):
                raise VisibilityInputError(f"Receiver above_ground_m must be >= 0 m, not {above_ground_m}.")
            return self.grid.heights_m, np.float32(above_ground_m)
        if altitude_m is not None and above_ground_m is None:
            if not math.isfinite(altitude_m):
                raise VisibilityInputError(f"Receiver altitude_m must be a finite number, not {altitude_m}.")
            return np.full(self.grid.shape, altitude_m, np.float32), np.float32(0.0)
        raise VisibilityInputError("Give exactly one receiver height: above_ground_m or altitude_m.")


def min_visible_altitude(
    grid: ElevationGrid,
    anchors: Sequence[Anchor | DistantAnchor],
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
    progress: called with the finished share 0..1, at least once per few anchors.
    Raises AnchorError, VisibilityInputError.
    """
    started_s = time.perf_counter()
    if mode not in get_args(Mode):
        raise VisibilityInputError(f"mode must be one of {', '.join(get_args(Mode))}, not {mode!r}.")
    if unknown not in get_args(UnknownGround):
        raise VisibilityInputError(f"unknown must be one of {', '.join(get_args(UnknownGround))}, not {unknown!r}.")
    anchors = tuple(anchors)
    warnings = check_anchors(grid, anchors)
    curvature = Curvature.over(grid, curvature)

    hidden_below_m, altitude_m = clear_altitudes(grid, anchors, ENGINES[mode], curvature, unknown, progress)
    raise_behind_standing(grid, anchors, curvature, hidden_below_m)
    if altitude_m is not hidden_below_m:
        raise_behind_standing(grid, anchors, curvature, altitude_m)
    for number, anchor in enumerate(anchors):
        if isinstance(anchor, DistantAnchor):
            continue
        raise_to_reach(grid, anchor, curvature, hidden_below_m[number])
        if altitude_m is not hidden_below_m:
            raise_to_reach(grid, anchor, curvature, altitude_m[number])
    if altitude_m is hidden_below_m and _are_doubted(anchors):
        altitude_m = hidden_below_m.copy()
    for number, anchor in enumerate(anchors):
        if isinstance(anchor, Anchor):
            forget_where_doubted(grid, anchor.doubts, altitude_m[number])
    return MinimumVisibleAltitude(
        grid=grid,
        anchors=anchors,
        altitude_m=altitude_m,
        hidden_below_m=hidden_below_m,
        mode=mode,
        unknown=unknown,
        curvature=curvature,
        warnings=warnings,
        elapsed_s=time.perf_counter() - started_s,
        version=VERSION,
    )


def _are_doubted(anchors: Sequence[Anchor | DistantAnchor]) -> bool:
    return any(isinstance(anchor, Anchor) and anchor.doubts for anchor in anchors)


# altitude_m, hidden_below_m and of_signals of one anchor
Kept = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], bool]


class Surfaces(Protocol):
    """``min_visible_altitude``, or another that is called as it is."""

    def __call__(
        self,
        grid: ElevationGrid,
        anchors: Sequence[Anchor | DistantAnchor],
        mode: Mode = "fast",
        curvature: Curvature | None = None,
        *,
        unknown: UnknownGround = "unknown",
    ) -> MinimumVisibleAltitude:
        """Of each anchor the lowest altitude over every post."""


class SurfaceCache:
    """Answers ``min_visible_altitude`` for one grid, and remembers each anchor's surface until it is not asked for.

    computed, reused: how many anchors' surfaces were calculated and how many remembered, since the cache was made.
    window: first and last row, first and last column of the posts that are answered; None: all of them. All hide.
    calculate: what is asked in its place, such as ``visibility.signal.min_usable_altitude``. remembers: so many of the
        surfaces that were not asked for last are kept as well, the latest.
    """

    def __init__(
        self,
        grid: ElevationGrid,
        mode: Mode = "fast",
        curvature: Curvature | None = None,
        *,
        unknown: UnknownGround = "unknown",
        window: tuple[int, int, int, int] | None = None,
        calculate: Surfaces = min_visible_altitude,
        remembers: int = 0,
    ) -> None:
        self._remembers = remembers
        self.grid = grid
        self.box = grid if window is None else grid.window(*window)
        self._window = window
        self._calculate = calculate
        self.mode: Mode = mode
        self.curvature = Curvature.over(grid, curvature)
        self.unknown: UnknownGround = unknown
        self.computed = 0
        self.reused = 0
        self._surfaces: dict[Anchor | DistantAnchor, Kept] = {}

    def surfaces(self, anchors: tuple[Anchor | DistantAnchor, ...]) -> MinimumVisibleAltitude:
        """As ``min_visible_altitude`` of these anchors; forgets those of the last answer that are not among them.

        Unlike there, none at all are an answer too: there may be times without any.

        Raises AnchorError, VisibilityInputError.
        """
        started_s = time.perf_counter()
        warnings = check_anchors(self.grid, anchors) if anchors else ()
        missing = tuple(anchor for anchor in anchors if anchor not in self._surfaces)
        kept = {anchor: self._surfaces[anchor] for anchor in anchors if anchor in self._surfaces}
        if missing:
            found = self._calculate(self.grid, missing, self.mode, self.curvature, unknown=self.unknown)
            if self._window is not None:
                found = found.window(*self._window)
            for number, anchor in enumerate(missing):
                kept[anchor] = (found.altitude_m[number], found.hidden_below_m[number], found.of_signals)
        self.computed += len(missing)
        self.reused += len(anchors) - len(missing)
        others = [anchor for anchor in self._surfaces if anchor not in kept]
        latest = others[max(len(others) - self._remembers, 0) :]
        self._surfaces = {**{anchor: self._surfaces[anchor] for anchor in latest}, **kept}
        nothing = np.empty((0, *self.box.shape), np.float32)
        altitude_m = np.stack([kept[anchor][0] for anchor in anchors]) if anchors else nothing
        same = all(kept[anchor][0] is kept[anchor][1] for anchor in anchors)
        same = same or not (self.grid.unknown_posts or _are_doubted(anchors))
        hidden_below_m = altitude_m if same else np.stack([kept[anchor][1] for anchor in anchors])
        return MinimumVisibleAltitude(
            grid=self.box,
            anchors=anchors,
            altitude_m=altitude_m,
            hidden_below_m=hidden_below_m,
            mode=self.mode,
            unknown=self.unknown,
            curvature=self.curvature,
            warnings=warnings,
            elapsed_s=time.perf_counter() - started_s,
            version=VERSION,
            of_signals=bool(anchors) and all(kept[anchor][2] for anchor in anchors),
        )
