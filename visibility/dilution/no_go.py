"""No-go zones as polygons and dilutions as contour lines, in the grid's frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import cast

import contourpy
import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.errors import VisibilityInputError

__all__ = ["Zone", "contour_lines", "zones"]

Ring = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Zone:
    """A polygon with holes: closed rings (n, 2) of east_m, north_m, first point = last.

    exterior runs counter-clockwise, holes clockwise, as GeoJSON (RFC 7946) wants them.
    """

    exterior: Ring
    holes: tuple[Ring, ...]

    @property
    def area_m2(self) -> float:
        """Area within the exterior and outside the holes."""
        return _signed_area_m2(self.exterior) + sum(_signed_area_m2(hole) for hole in self.holes)


def zones(grid: ElevationGrid, inside: npt.ArrayLike) -> tuple[Zone, ...]:
    """Polygons around the posts (rows, cols) that are inside: every such post is in one of them, and no other post is.

    Borders run half way between a post inside and its neighbour outside, at the edge of the grid half a cell beyond the
    outermost posts. Diagonal neighbours are joined. Raises VisibilityInputError for an array of another shape.
    """
    mask = np.asarray(inside, np.bool_)
    if mask.shape != grid.shape:
        raise VisibilityInputError(f"A mask of zones must have the grid's shape {grid.shape}, not {mask.shape}.")
    generator = contourpy.contour_generator(
        *_half_a_cell_wider(grid), np.pad(mask.astype(np.float64), 1, mode="edge"), fill_type="OuterOffset"
    )
    points, offsets = cast(tuple[list[Ring], list[npt.NDArray[np.uint32]]], generator.filled(0.5, 2.0))
    found = []
    for ring_points, ring_offsets in zip(points, offsets, strict=True):
        rings = [ring_points[start:stop] for start, stop in pairwise(ring_offsets)]
        exterior = rings[0] if _signed_area_m2(rings[0]) > 0.0 else rings[0][::-1]
        holes = tuple(hole if _signed_area_m2(hole) < 0.0 else hole[::-1] for hole in rings[1:])
        found.append(Zone(exterior, holes))
    return tuple(found)


def contour_lines(
    grid: ElevationGrid, dop: npt.ArrayLike, levels: Sequence[float]
) -> dict[float, tuple[npt.NDArray[np.float64], ...]]:
    """Lines (n, 2) of east_m, north_m along which a dilution (rows, cols) has each level.

    Interpolated in 1/dop, which is 0 where there is no fix, so that lines end at no cliff of infinity; none goes where
    dop is NaN. Raises VisibilityInputError.
    """
    values = np.asarray(dop, np.float64)
    if values.shape != grid.shape or min(grid.shape) < 2:
        raise VisibilityInputError(f"Contours need two rows and columns of the grid's shape {grid.shape}.")
    wrong = [level for level in levels if not (np.isfinite(level) and level > 0.0)]
    if wrong:
        raise VisibilityInputError(f"Contour levels of a dilution must be numbers > 0, not {wrong[0]}.")
    east_m = grid.origin_east_m + np.arange(grid.cols) * grid.cell_east_m
    north_m = grid.origin_north_m - np.arange(grid.rows) * grid.cell_north_m
    generator = contourpy.contour_generator(east_m, north_m, np.ma.masked_invalid(1.0 / values), line_type="Separate")
    return {float(level): tuple(cast(list[Ring], generator.lines(1.0 / level))) for level in levels}


def _half_a_cell_wider(grid: ElevationGrid) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """East and north of the posts, and of one more on each side at half the distance."""
    col = np.concatenate([[-0.5], np.arange(grid.cols), [grid.cols - 0.5]])
    row = np.concatenate([[-0.5], np.arange(grid.rows), [grid.rows - 0.5]])
    return grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m


def _signed_area_m2(ring: Ring) -> float:
    """Area of a closed ring, positive counter-clockwise."""
    east_m, north_m = (ring - ring[0]).T  # near zero, so that products lose no digits
    return float(0.5 * np.sum(east_m[:-1] * north_m[1:] - east_m[1:] * north_m[:-1]))
