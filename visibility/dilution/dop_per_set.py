"""One dilution of precision per visible set, the shortcut of De Vivo et al., II-C."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from visibility.dilution.dop import Dop, checked_sets, solve
from visibility.dilution.dop_questions import DopKind, DopReason, Sources, positions, sources_of

__all__ = ["dop_per_visible_set"]


def dop_per_visible_set(
    points_m: npt.ArrayLike,
    anchor_positions_m: npt.ArrayLike,
    mask: npt.NDArray[np.uint64],
    kind: DopKind = "ranging",
    *,
    unknown: npt.ArrayLike | None = None,
    distant: npt.ArrayLike | None = None,
) -> Dop:
    """As ``dop_at_points``, but calculated once for each visible set, in the middle of the points that have it.

    Exact for distant anchors, near enough for satellites, and wrong by as much as directions turn within the volume for
    near ones; docs/dop.md has the error. Raises VisibilityInputError.
    """
    points = positions("points_m", points_m)
    return solve_per_set(points, sources_of(anchor_positions_m, distant), mask, unknown, kind)


def solve_per_set(
    points: npt.NDArray[np.float64],
    sources: Sources,
    mask: npt.NDArray[np.uint64],
    unknown: npt.ArrayLike | None,
    kind: DopKind,
) -> Dop:
    """Dilutions of checked points and sources, one for each set; points of unknown set or place are left out of it."""
    mask, flags, count = checked_sets(mask, unknown, len(points), len(sources[0]))
    known = ~flags & ~np.isnan(points).any(axis=1)
    sets, of_set = np.unique(mask[known], axis=0, return_inverse=True)
    of_set = of_set.reshape(-1)
    size = np.bincount(of_set, minlength=len(sets))
    middle_m = np.column_stack([np.bincount(of_set, points[known, axis], len(sets)) / size for axis in range(3)])
    each = solve(middle_m, sources, sets, None, kind, None)
    dilutions = np.full((5, len(points)), np.nan)
    dilutions[:, known] = np.array([each.gdop, each.pdop, each.hdop, each.vdop, each.tdop])[:, of_set]
    gdop, pdop, hdop, vdop, tdop = dilutions
    reason = np.full(len(points), DopReason.UNKNOWN, np.uint8)
    reason[known] = each.reason[of_set]
    return Dop(gdop, pdop, hdop, vdop, tdop, reason, count, kind)
