"""Minimum-visible-altitude surfaces as the kernels of volumes and morphing maps take them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from terrain import ElevationGrid
from visibility.dilution.dop_questions import Sources, sources_of
from visibility.dilution.kernels.visible_sets import Antennas, Surfaces, Window
from visibility.sight.anchors import ALL_ROUND, Anchor
from visibility.sight.distant import DistantAnchor
from visibility.sight.kernels.reach import LIMIT_FIELDS
from visibility.sight.minimum_altitude import MinimumVisibleAltitude
from visibility.sight.reach import limits_of

__all__ = ["ColumnTables", "column_tables", "sources_of_anchors"]


@dataclass(frozen=True, slots=True, eq=False)
class ColumnTables:
    """Arguments that the column kernels share; see kernels.visible_sets."""

    surfaces: Surfaces
    antennas: Antennas
    sources: Sources

    def window(self, grid: ElevationGrid, first_row: int, first_col: int) -> Window:
        """Where a window of posts begins."""
        return Window(
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
    limits = np.full(len(anchors), np.array(limits_of(ALL_ROUND), LIMIT_FIELDS))
    limited = np.zeros(len(anchors), np.bool_)
    for number, anchor in enumerate(anchors):
        if isinstance(anchor, Anchor) and anchor.limits != ALL_ROUND:
            limited[number] = True
            limits[number] = limits_of(anchor.limits)
    columns = Surfaces(
        np.ascontiguousarray(surfaces.altitude_m),
        np.ascontiguousarray(surfaces.hidden_below_m),
        surfaces.grid.heights_m,
    )
    antennas = Antennas(sources.anchors, sources.distant, limits, limited, surfaces.curvature.drop_per_m2)
    return ColumnTables(columns, antennas, sources)


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
