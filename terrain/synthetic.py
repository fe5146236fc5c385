"""Made-up ground: shapes whose sight lines are known in closed form, and rough terrain from noise.

All have the middle of the grid at east = north = 0, no CRS and (except ``fractal``) an odd number of posts each way, so
that a post stands in the middle. ``u`` is the distance from it in the direction named.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .errors import ElevationGridError
from .grid import ElevationGrid, Provenance

__all__ = ["cone", "fractal", "horizon_distance_m", "plane", "ridge", "wedge"]

Array = npt.NDArray[np.float64]


def plane(
    half_posts: int = 100, cell_m: float = 10.0, *, height_m: float = 0.0, slope_east: float = 0.0,
    slope_north: float = 0.0,
) -> ElevationGrid:  # fmt: skip
    """A plane: height_m + slope_east · east + slope_north · north, (2·half_posts + 1)² posts.

    On flat ground everything is visible: the minimum visible altitude is the ground itself. Over a body of radius R and
    refraction factor k, points h₁ and h₂ above it lose sight of each other at ``horizon_distance_m``.
    """
    east_m, north_m = _middle_axes(half_posts, cell_m)
    return _grid(height_m + slope_east * east_m + slope_north * north_m, cell_m, "plane")


def horizon_distance_m(
    above_ground_1_m: float, above_ground_2_m: float, radius_m: float, refraction_k: float = 4.0 / 3.0
) -> float:
    """Distance at which two points above curved level ground lose sight: sqrt(2kRh₁) + sqrt(2kRh₂), metres."""
    bend_m = 2.0 * refraction_k * radius_m
    return math.sqrt(bend_m * above_ground_1_m) + math.sqrt(bend_m * above_ground_2_m)


def ridge(half_posts: int = 100, cell_m: float = 10.0, *, crest_m: float = 100.0) -> ElevationGrid:
    """A knife-edge along the north-south line u = 0, one cell wide on each side, on ground of height 0.

    From a point a metres west of the crest at altitude z, the minimum visible altitude b metres east of it is
    crest_m + (crest_m − z) · b / a, never below the ground (a and b at least one cell, square to the crest).
    The clearance of a line over the crest is its altitude there minus crest_m.
    """
    east_m, _ = _middle_axes(half_posts, cell_m)
    return _grid(np.where(np.abs(east_m) < 0.5 * cell_m, crest_m, 0.0), cell_m, "ridge")


def wedge(half_posts: int = 100, cell_m: float = 10.0, *, slope: float = 0.5, crest_m: float = 100.0) -> ElevationGrid:
    """A ramp rising eastward to a crest at u = 0 and falling to 0 within one cell beyond; ground 0 elsewhere.

    The foot lies crest_m / slope west of the crest. A point at altitude z ≥ 0 on the western ground sees the whole ramp
    (it is the far side of a hollow); beyond the crest the ridge's formula holds.
    """
    east_m, _ = _middle_axes(half_posts, cell_m)
    ramp_m = np.clip(crest_m + slope * east_m, 0.0, crest_m)
    return _grid(np.where(east_m < 0.5 * cell_m, ramp_m, 0.0), cell_m, "wedge")


def cone(half_posts: int = 100, cell_m: float = 10.0, *, slope: float = 0.5, apex_m: float = 100.0) -> ElevationGrid:
    """A cone of height apex_m with its axis in the middle, on ground of height 0.

    Seen from distance d to the axis at altitude z < apex_m, the flank is visible exactly at azimuths φ about the axis
    (φ = 0 towards the observer) with cos φ > (apex_m − z) / (slope · d): the bounds are the tangent lines. Straight
    behind the apex, b metres from the axis, the minimum visible altitude is apex_m + (apex_m − z) · b / d. On the flank
    the triangulated surface lies below the cone, by at most 0.293 · slope · cell_m.
    """
    east_m, north_m = _middle_axes(half_posts, cell_m)
    return _grid(np.maximum(apex_m - slope * np.hypot(east_m, north_m), 0.0), cell_m, "cone")


def fractal(
    posts: int, seed: int = 1, *, slope: float = 1.6, relief_m: float = 1500.0, cell_m: float = 30.0
) -> ElevationGrid:
    """Rough ground without closed form: white noise whose spectrum falls as frequency^−slope, scaled to 0…relief_m.

    (posts, posts) posts; the same seed gives the same ground everywhere. It tiles without a seam.
    """
    if posts < 2:
        raise ElevationGridError(f"A fractal needs at least 2 posts a side, not {posts}.")
    noise = np.random.default_rng(seed).standard_normal((posts, posts))
    frequency = np.hypot(np.fft.fftfreq(posts)[:, None], np.fft.rfftfreq(posts)[None, :])
    frequency[0, 0] = 1.0  # the mean: any finite weight will do, it is scaled away
    rough = np.fft.irfft2(np.fft.rfft2(noise) * frequency**-slope, s=(posts, posts))
    heights_m = (rough - rough.min()) / (rough.max() - rough.min()) * relief_m
    return _grid(heights_m, cell_m, f"fractal, seed {seed}")


def _middle_axes(half_posts: int, cell_m: float) -> tuple[Array, Array]:
    """East and north of each post (n, n) about the middle post, metres."""
    if half_posts < 1:
        raise ElevationGridError(f"half_posts must be at least 1, not {half_posts}.")
    steps_m = np.arange(-half_posts, half_posts + 1) * float(cell_m)
    east_m, north_m = np.meshgrid(steps_m, -steps_m)
    return east_m, north_m


def _grid(heights_m: Array, cell_m: float, shape: str) -> ElevationGrid:
    rows, cols = heights_m.shape
    return ElevationGrid(
        heights_m.astype(np.float32), cell_m, cell_m,
        origin_east_m=-(cols // 2) * float(cell_m),
        origin_north_m=(rows // 2) * float(cell_m),
        provenance=Provenance(source=f"synthetic {shape}", driver="synthetic"),
    )  # fmt: skip
