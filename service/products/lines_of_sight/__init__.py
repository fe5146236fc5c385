"""Lines of sight between pairs of points as a product."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from service.products import Inline, Product, WarmUp
from terrain import ElevationGrid, Standing
from visibility import Anchor, line_of_sight, lines_of_sight, min_visible_altitude, profile
from visibility.cover import Canopy
from visibility.signal import RADIOS, Foliage, signals, with_foliage

from .calculate import LAYERS, LineOut, LinesOfSightSummary, calculate_lines, pack_lines, unpack_lines
from .request import PAIRS, LinesOfSightIn, LinesOfSightParameters

__all__ = ["LINES_OF_SIGHT"]


def _pairs(grid: ElevationGrid) -> None:
    starts_m, ends_m = [[10.0, -10.0, 60.0]] * 2, [[200.0, -150.0, 5.0], [-50.0, 20.0, 90.0]]
    lines_of_sight(grid, starts_m, ends_m, wavelength_m=0.1, dem_sigma_m=3.0, excess_path=True)
    line_of_sight(grid, starts_m[0], ends_m[0])
    profile(grid, starts_m[0], ends_m[0])
    corners_m = np.array([(50, -50, 9), (90, -50, 9), (60, -90, 9)], float)
    built = replace(grid, standing=Standing(corners_m[None, :2], corners_m[None], 1))
    lines_of_sight(built, starts_m, ends_m)
    min_visible_altitude(built, [Anchor("A", 100.0, -200.0, 90.0)])
    canopy = Canopy(grid, np.full(grid.shape, 9.0, np.float32), np.zeros(grid.shape, np.float32))
    signals(with_foliage(built, Foliage(canopy)), starts_m, ends_m, RADIOS["868MHz"])


# pairs are counted where the body is read, and their ends judged where they are packed
LINES_OF_SIGHT = Product(
    name="lines-of-sight",
    title="lines of sight",
    plural="lines_of_sight",
    model="LinesOfSight",
    tag="Lines of sight",
    summary="Clearance between pairs of points.",
    about="Clearance, verdict and blocking point of many straight lines at once; exact on the triangulated surface.",
    asked=LinesOfSightIn,
    parameters=LinesOfSightParameters,
    answer=LinesOfSightSummary,
    example=PAIRS,
    warm_up=(WarmUp(_pairs),),
    calculate=calculate_lines,
    layers=LAYERS,
    pack=pack_lines,
    unpack=unpack_lines,
    long_body=True,
    inline=Inline("lines", "lines.json", LineOut, "One entry per pair, in their order; null until it succeeded."),
)
