"""The grounds that are measured on: a rough fractal, and real DEMs where they are at hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, read_dem
from visibility import Anchor, anchor_above_ground

__all__ = ["CENTRE_ABOVE_GROUND_M", "centre_anchor", "fractal_grid", "fractal_m", "real_grid", "spread_anchors"]

DATA = Path(__file__).parents[1] / "../shared/data/dem"
CELL_M = 30.0
RELIEF_M = 1500.0
CENTRE_ABOVE_GROUND_M = 100.0


def fractal_m(posts: int, seed: int = 1, slope: float = 1.6) -> npt.NDArray[np.float32]:
    """(posts, posts) heights 0..1500 m: white noise shaped by wave number ** -slope; it continues across its edges."""
    noise = np.random.default_rng(seed).standard_normal((posts, posts))
    spectrum = np.fft.rfft2(noise)
    wave_number = np.hypot(np.fft.fftfreq(posts)[:, None], np.fft.rfftfreq(posts)[None, :])
    wave_number[0, 0] = 1.0
    spectrum *= wave_number**-slope
    field = np.fft.irfft2(spectrum, s=(posts, posts))
    field -= field.min()
    heights_m: npt.NDArray[np.float32] = (field * (RELIEF_M / field.max())).astype(np.float32)
    return heights_m


def fractal_grid(posts: int, seed: int = 1) -> ElevationGrid:
    """The rough fractal as a local grid of 30 m cells."""
    return ElevationGrid(fractal_m(posts, seed), CELL_M, CELL_M)


def real_grid(name: str) -> ElevationGrid | None:
    """A real DEM from the folder beside the checkout, None where that folder is absent."""
    path = DATA / name
    return read_dem(path) if path.is_file() else None


def centre_anchor(grid: ElevationGrid) -> Anchor:
    """100 m above the middle post."""
    east_m, north_m = grid.position_of(grid.rows // 2, grid.cols // 2)
    return anchor_above_ground(grid, "centre", east_m, north_m, CENTRE_ABOVE_GROUND_M)


def spread_anchors(grid: ElevationGrid, count: int, seed: int = 7) -> list[tuple[Anchor, int, int, float]]:
    """Anchors over known posts drawn at random, 10 to 300 m above ground: (anchor, row, col, above_ground_m) each."""
    random = np.random.default_rng(seed)
    heights_above_m = np.geomspace(10.0, 300.0, count)
    known = np.argwhere(np.isfinite(grid.heights_m))
    chosen = known[random.choice(len(known), size=count, replace=False)]
    drawn = []
    for number, ((row, col), above_m) in enumerate(zip(chosen, heights_above_m, strict=True)):
        east_m, north_m = grid.position_of(int(row), int(col))
        anchor = anchor_above_ground(grid, f"A{number + 1}", east_m, north_m, float(above_m))
        drawn.append((anchor, int(row), int(col), float(above_m)))
    return drawn
