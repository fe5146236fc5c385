"""All places at once: how much of the ground each post would see as a site, and from how much of it each is seen."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.errors import VisibilityInputError
from visibility.sight.curvature import Curvature

from .kernels.rays import WALL_M, Ray, look_along

__all__ = ["DIRECTIONS", "LEAST_DIRECTIONS", "MOST_DIRECTIONS", "SiteMap", "site_map"]

Floats = npt.NDArray[np.float32]

DIRECTIONS, LEAST_DIRECTIONS, MOST_DIRECTIONS = 360, 16, 7200


ERROR_STATEMENT = (
    "rays in {directions} directions, which see the ground only where they cross columns of posts: on real mountains a "
    "site is told 0.99 to 1.04 of what exact mode counts, on ground that is rough from post to post 0.99 to 1.18"
)


@dataclass(frozen=True, slots=True, eq=False)
class SiteMap:
    """How much target ground each post of a grid sees as a site.

    seen_m2: (rows, cols) float32, target ground surely in sight of a site over the post, m²; NaN over unknown ground.
    undecided_m2: (rows, cols) float32, ground that is in sight only if unknown ground hides nothing, m²; NaN likewise.
    target_m2: all target ground. directions: how many rays went out from each post.
    """

    grid: ElevationGrid
    seen_m2: Floats
    undecided_m2: Floats
    target_m2: float
    site_above_ground_m: float
    target_above_ground_m: float
    max_range_m: float
    directions: int
    curvature: Curvature
    elapsed_s: float

    @property
    def error_statement(self) -> str:
        """What the map may be off by, in words."""
        return ERROR_STATEMENT.format(directions=self.directions)

    @property
    def seen_share(self) -> Floats:
        """(rows, cols) float32: part of the target ground surely in sight, 0..1; NaN over unknown ground."""
        share: Floats = self.seen_m2 / np.float32(self.target_m2)
        return share

    @property
    def undecided_share(self) -> Floats:
        """(rows, cols) float32: part of it in sight only if unknown ground hides nothing, 0..1; NaN likewise."""
        share: Floats = self.undecided_m2 / np.float32(self.target_m2)
        return share

    def window(self, first_row: int, last_row: int, first_col: int, last_col: int) -> SiteMap:
        """The sites of a box of posts, both ends within it; what they see stays that of the whole ground."""
        box = (slice(first_row, last_row + 1), slice(first_col, last_col + 1))
        return replace(
            self,
            grid=self.grid.window(first_row, last_row, first_col, last_col),
            seen_m2=np.ascontiguousarray(self.seen_m2[box]),
            undecided_m2=np.ascontiguousarray(self.undecided_m2[box]),
        )


def site_map(
    grid: ElevationGrid,
    site_above_ground_m: float,
    target_above_ground_m: float = 0.0,
    *,
    targets: npt.NDArray[np.bool_] | None = None,
    max_range_m: float = math.inf,
    directions: int = DIRECTIONS,
    curvature: Curvature | None = None,
    progress: Callable[[float], None] | None = None,
) -> SiteMap:
    """How much of the target ground a site over each post of a grid would have in sight.

    Rays go out from every post in so many directions (a multiple of four, spread evenly over each quarter's columns)
    and see the ground where they cross columns of posts, or rows where they are steep; each stands for the posts
    between it and the next. Sight is mutual: with the two heights exchanged, this is from how much of the
    ground each post is seen. The time grows with posts, directions and the length of rays.

    targets: (rows, cols) bool, ground that counts; None: all that is known. max_range_m: horizontal reach.
    curvature: None = what the grid's CRS implies. progress: told the finished share, 0..1.
    Raises VisibilityInputError. Source: the total viewshed of Tabik, Zapata and Romero, "Simultaneous computation of
    total viewshed on large high resolution grids", IJGIS 27 (2013), with rays from each post in place of shared bands.
    """
    begin_s = time.perf_counter()
    for what, height_m in (("site", site_above_ground_m), ("target", target_above_ground_m)):
        if not (0.0 <= height_m < math.inf):
            raise VisibilityInputError(f"A {what} stands at or above the ground, not {height_m:g} m above it.")
    if directions % 4 or not LEAST_DIRECTIONS <= directions <= MOST_DIRECTIONS:
        raise VisibilityInputError(
            f"Directions are a multiple of four from {LEAST_DIRECTIONS} to {MOST_DIRECTIONS}, not {directions}."
        )
    if not max_range_m > 0.0:
        raise VisibilityInputError(f"Sites see ground within a positive range, not {max_range_m:g} m.")
    bent = Curvature.over(grid, curvature)
    known = ~np.isnan(grid.heights_m)
    if targets is not None and targets.shape != grid.shape:
        raise VisibilityInputError(f"Targets are {grid.shape} like the grid, not {targets.shape}.")
    wanted = known if targets is None else targets & known
    if not wanted.any():
        raise VisibilityInputError("There is no known target ground to be seen.")
    rays = _Rays(grid, site_above_ground_m, target_above_ground_m, wanted.astype(np.float32), max_range_m, bent)
    tell = progress or (lambda share: None)
    hides = np.where(known, grid.heights_m, WALL_M)
    open_too = not known.all()
    part = 0.5 if open_too else 1.0
    surely = rays.seen(hides, directions, lambda share: tell(part * share))
    possibly = rays.seen(grid.heights_m, directions, lambda share: tell(0.5 + 0.5 * share)) if open_too else surely
    # rays stand for posts between them, so of a small target they may tell a little more than there is
    most = np.float32(np.count_nonzero(wanted))
    surely, possibly = np.minimum(surely, most), np.minimum(possibly, most)
    cell_m2 = np.float32(grid.cell_east_m * grid.cell_north_m)
    nothing = np.where(known, np.float32(1.0), np.float32(np.nan))
    return SiteMap(
        grid,
        surely * cell_m2 * nothing,
        np.maximum(possibly - surely, np.float32(0.0)) * cell_m2 * nothing,
        float(most) * float(cell_m2),
        site_above_ground_m,
        target_above_ground_m,
        max_range_m,
        directions,
        bent,
        time.perf_counter() - begin_s,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Rays:
    """A question to one ground after the other: unknown ground as a wall, then as nothing."""

    grid: ElevationGrid
    site_m: float
    target_m: float
    targets: Floats
    max_range_m: float
    curvature: Curvature

    def seen(self, ground_m: Floats, directions: int, tell: Callable[[float], None]) -> Floats:
        """(rows, cols): target posts that each post sees, itself among them."""
        eyes_m = self.grid.heights_m + np.float32(self.site_m)
        found = self.targets.copy()
        each = directions // 4
        for quarter in range(4):
            turned = [_turned(array, quarter) for array in (eyes_m, ground_m, self.targets)]
            seen = np.zeros_like(turned[0])
            for number in range(each):
                look_along(*turned, self._ray((2.0 * number + 1.0) / each - 1.0, quarter, 2.0 / each), seen)
                tell((quarter + (number + 1.0) / each) / 4.0)
            found += _turned_back(seen, quarter)
        return found

    def _ray(self, slope: float, quarter: int, spread: float) -> Ray:
        along_m, across_m = self.grid.cell_east_m, self.grid.cell_north_m
        if quarter >= 2:
            along_m, across_m = across_m, along_m
        step_m = math.hypot(along_m, slope * across_m)
        most = max(self.grid.shape) if math.isinf(self.max_range_m) else int(self.max_range_m / step_m)
        return Ray(slope, step_m, min(most, max(self.grid.shape)), spread, self.target_m, self.curvature.drop_per_m2)


def _turned(array: Floats, quarter: int) -> Floats:
    """So that the quarter's rays go east: 0 east, 1 west, 2 south, 3 north."""
    upright = array if quarter < 2 else array.T
    return np.ascontiguousarray(upright if quarter % 2 == 0 else upright[:, ::-1])


def _turned_back(array: Floats, quarter: int) -> Floats:
    upright = array if quarter % 2 == 0 else array[:, ::-1]
    return upright if quarter < 2 else upright.T
