"""Minimum-visible-altitude surfaces as the kernels of volumes and morphing maps take them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.dilution.dop_questions import Sources, sources_of
from visibility.sight.anchors import ALL_ROUND, Anchor
from visibility.sight.distant import DistantAnchor
from visibility.sight.minimum_altitude import MinimumVisibleAltitude
from visibility.sight.reach import limit_numbers

__all__ = ["ColumnTables", "column_tables", "sources_of_anchors"]

Surfaces = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.float32]]
Reach = tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_], npt.NDArray[np.float64], npt.NDArray[np.bool_], float]


@dataclass(frozen=True, slots=True, eq=False)
class ColumnTables:
    """Arguments that the column kernels share; see kernels.columns.fill_column."""

    surfaces: Surfaces
    reach: Reach
    sources: Sources

    def place(self, grid: ElevationGrid, first_row: int, first_col: int) -> tuple[float, float, float, float, int, int]:
        """Where a window of posts begins: (origin east, origin north, cell east, cell north, row, col)."""
        return (
            grid.origin_east_m,
            grid.origin_north_m,
            grid.cell_east_m,
            grid.cell_north_m,
            first_row,
            first_col,
        )


def column_tables(surfaces: MinimumVisibleAltitude) -> ColumnTables:
    """The tables of a set of surfaces."""
    anchors = surfaces.anchors
    sources = sources_of_anchors(anchors)
    limits = np.tile([0.0, math.inf, 0.0, 2.0 * math.pi, -math.inf, math.inf], (len(anchors), 1))
    limited = np.zeros(len(anchors), np.bool_)
    for number, anchor in enumerate(anchors):
        if isinstance(anchor, Anchor) and anchor.limits != ALL_ROUND:
            limited[number] = True
            limits[number] = limit_numbers(anchor.limits)
    arrays = (
        np.ascontiguousarray(surfaces.altitude_m),
        np.ascontiguousarray(surfaces.hidden_below_m),
        surfaces.grid.heights_m,
    )
    return ColumnTables(arrays, (sources[0], sources[1], limits, limited, surfaces.curvature.drop_per_m2), sources)


def sources_of_anchors(anchors: tuple[Anchor | DistantAnchor, ...]) -> Sources:
    """Anchors as the dilution kernels take them: near ones by position, distant ones by direction."""
    rows, distant = [], []
    for anchor in anchors:
        distant.append(isinstance(anchor, DistantAnchor))
        if isinstance(anchor, DistantAnchor):
            across = math.cos(anchor.elevation_rad)
            rows.append(
                (
                    across * math.sin(anchor.azimuth_rad),
                    across * math.cos(anchor.azimuth_rad),
                    math.sin(anchor.elevation_rad),
                )
            )
        else:
            rows.append((anchor.east_m, anchor.north_m, anchor.altitude_m))
    return sources_of(rows, distant)
