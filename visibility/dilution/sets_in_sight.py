"""Visible sets along a trajectory: which anchors each of many points sees, from minimum visible altitudes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.dilution.columns_of_air import ColumnTables, column_tables
from visibility.dilution.dop import Dop, solve
from visibility.dilution.dop_questions import DopKind, set_words
from visibility.dilution.ground_normals import rover_normals
from visibility.dilution.kernels.visible_sets import sets_at_points
from visibility.sight.minimum_altitude import MinimumVisibleAltitude
from visibility.sight.sight_points import check_points, in_posts

__all__ = ["VisibleSets", "dop_along", "visible_sets"]


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
