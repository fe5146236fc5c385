"""Depth images of balls and planes by the definition: rays meet them, and depths are rounded in inverse depth."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Surface = Callable[[Array], Array]


def image(
    surface: Surface,
    sensor: tuple[float, float, float, float, float],
    rng: np.random.Generator | None = None,
    noise_steps: float = 0.2,
    columns: int = 640,
    rows: int = 480,
) -> tuple[Array, Array, Array]:
    """(cols, rows, depths) of the pixels that meet a surface; sensor: (focal, col, row, offset, step)."""
    focal, centre_col, centre_row, offset, step = sensor
    cols, lines = (values.reshape(-1).astype(float) for values in np.meshgrid(np.arange(columns), np.arange(rows)))
    rays = np.stack([(cols - centre_col) / focal, (lines - centre_row) / focal, np.ones_like(cols)], axis=1)
    depths = surface(rays)
    met = np.isfinite(depths)
    numbers = (offset - 1.0 / depths[met]) / step
    if rng is not None:
        numbers = numbers + rng.normal(0.0, noise_steps, len(numbers))
    return cols[met], lines[met], 1.0 / (offset - step * np.rint(numbers))


def ball(centre: npt.ArrayLike, radius: float) -> Surface:
    """Depth along rays (n, 3) with forward part 1 of the nearer side of a ball; NaN beside it."""

    def depths(rays: Array) -> Array:
        along, length2 = rays @ np.asarray(centre), (rays**2).sum(axis=1)
        inside = along**2 - length2 * (np.dot(centre, centre) - radius**2)
        return np.where(inside > 0.0, (along - np.sqrt(np.maximum(inside, 0.0))) / length2, np.nan)

    return depths


def plane(normal: npt.ArrayLike, distance: float, within_m: float) -> Surface:
    """Depth of the plane normal·p = distance, as far as it lies within so many metres right and down of the axis."""

    def depths(rays: Array) -> Array:
        found = distance / (rays @ np.asarray(normal))
        points = rays * found[:, None]
        return np.where((np.abs(points[:, :2]) < within_m).all(axis=1) & (found > 0.0), found, np.nan)

    return depths
