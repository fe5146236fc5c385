"""Ground for tests of what a map says to a driving rover: a rough slope with a ridge, anchors on both sides of it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from detection import RangingAnchor
from terrain import ElevationGrid, height_at

Floats = npt.NDArray[np.float64]

POSTS, CELL_M = 81, 10.0
RIDGE_EAST_M, RIDGE_M = 500.0, 30.0
ANTENNA_M = 1.5


def rough(generator: np.random.Generator, correlation_m: float, sigma_m: float = 1.0) -> Floats:
    """(POSTS, POSTS) a field of that sigma whose covariance falls off as exp(-d/L)."""
    size = 4 * POSTS
    at_m = np.minimum(np.arange(size), size - np.arange(size)) * CELL_M
    covariance = np.exp(-np.hypot(at_m[:, None], at_m[None, :]) / correlation_m)
    power = np.maximum(np.fft.fft2(covariance).real, 0.0)
    white = np.fft.fft2(generator.standard_normal((size, size)))
    field: Floats = np.fft.ifft2(np.sqrt(power) * white).real[:POSTS, :POSTS]
    return sigma_m * field


def ridge(more_m: float | Floats = 0.0, ridge_m: float = RIDGE_M) -> ElevationGrid:
    """A slope up to the north with a ridge across, origin at the north-west post (0, 800)."""
    east_m = np.arange(POSTS) * CELL_M
    north_m = 800.0 - np.arange(POSTS) * CELL_M
    heights_m = 0.05 * north_m[:, None] + ridge_m * np.exp(-(((east_m - RIDGE_EAST_M) / 40.0) ** 2)) + more_m
    return ElevationGrid(heights_m.astype(np.float32), CELL_M, CELL_M, 0.0, 800.0)


def anchors() -> list[RangingAnchor]:
    """Three low ones behind the ridge from the west, five around it."""
    places = [(760, 200, 55), (780, 420, 62), (750, 640, 70), (20, 40, 60), (40, 760, 95), (360, 780, 110),
              (250, 20, 70), (420, 420, 130)]  # fmt: skip
    return [RangingAnchor(f"A{n + 1}", *map(float, place)) for n, place in enumerate(places)]


def on_ground(grid: ElevationGrid, east_m: Floats, north_m: Floats) -> Floats:
    """(n, 3) of the antenna."""
    return np.column_stack([east_m, north_m, height_at(grid, east_m, north_m) + ANTENNA_M])
