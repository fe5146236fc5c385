"""Visible sets along a trajectory, and the surfaces and antennas that they follow from as the kernels take them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.dilution.dop import Dop, solve
from visibility.dilution.dop_questions import DopKind, Sources, set_words, sources_of
from visibility.dilution.ground_normals import rover_normals
from visibility.dilution.kernels.visible_sets import Antennas, Surfaces, Window, sets_at_points
from visibility.sight.anchors import Anchor, DistantAnchor
from visibility.sight.antenna_limits import ALL_ROUND, limits_of
from visibility.sight.kernels.reach import LIMIT_FIELDS
from visibility.sight.minimum_altitude import MinimumVisibleAltitude
from visibility.sight.sight_points import check_points, in_posts

__all__ = ["ColumnTables", "VisibleSets", "column_tables", "dop_along", "sources_of_anchors", "visible_sets"]


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


@dataclass(frozen=True, eq=False)
class VisibleSets:
    """The answer to ``visible_sets``, for n points and k anchors.

    mask: (n, words) uint64, bit a of word a // 64 = anchor a is in sight for certain. unknown: (n,) bool, whether it is
        not known of some anchor, or the point lies outside the grid. count: (n,) anchors in sight for certain.
    """

    mask: npt.NDArray[np.uint64]
    unknown: npt.NDArray[np.bool_]
    count: npt.NDArray[np.int64]
    anchors: int

    def visible(self) -> npt.NDArray[np.bool_]:
        """(n, k) bool: the mask as a table."""
        bits = np.unpackbits(self.mask.astype("<u8").view(np.uint8), axis=1, bitorder="little")
        return bits[:, : self.anchors].astype(np.bool_)


def visible_sets(minimum: MinimumVisibleAltitude, points_m: npt.ArrayLike) -> VisibleSets:
    """Which anchors are in sight of each point (n, 3): east, north, altitude, metres, in the grid's frame.

    Between posts the minimum visible altitude is taken as linear on the triangle that the point lies in, as the ground
    itself is. That is exact where the ground is lit or the point on a post; in a shadow it is off by how far the
    shadow's upper side bends within a cell. Where a post of the triangle is unknown or out of an antenna's reach, so is
    the point. Raises VisibilityInputError.
    """
    points = check_points(minimum.grid, "points_m", points_m)
    return sets_of(minimum, column_tables(minimum), points)


def sets_of(minimum: MinimumVisibleAltitude, tables: ColumnTables, points: npt.NDArray[np.float64]) -> VisibleSets:
    """Visible sets of checked points; NaN altitudes are unknown."""
    anchors = len(minimum.anchors)
    mask = np.zeros((len(points), set_words(anchors)), np.uint64)
    unknown = np.zeros(len(points), np.bool_)
    posts = np.ascontiguousarray(in_posts(minimum.grid, points)[:, :2])
    sets_at_points(points, posts, tables.surfaces, tables.antennas, mask, unknown)
    return VisibleSets(mask, unknown, np.bitwise_count(mask).sum(axis=1, dtype=np.int64), anchors)


def dop_along(
    minimum: MinimumVisibleAltitude, points_m: npt.ArrayLike, kind: DopKind = "ranging", *, on_surface: bool = False
) -> Dop:
    """Dilution of precision at each point (n, 3) of a trajectory, from the anchors in sight there.

    on_surface: the points move along the ground, so only that motion is unknown; the slope is that of the triangle
        they are over, and on a post that to its neighbours, as in ``dop_map``. Raises VisibilityInputError.
    """
    points = check_points(minimum.grid, "points_m", points_m)
    tables = column_tables(minimum)
    sets = sets_of(minimum, tables, points)
    normals = rover_normals(minimum.grid, points[:, 0], points[:, 1]) if on_surface else None
    return solve(points, tables.sources, sets.mask, sets.unknown, kind, normals)
