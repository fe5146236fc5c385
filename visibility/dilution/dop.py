"""Dilution of precision: how the geometry of the visible anchors turns ranging errors into position errors.

One value per visible set is the shortcut of De Vivo et al., II-C.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.dilution.dop_questions import (
    DopKind,
    DopReason,
    Sources,
    kind_code,
    numbers,
    pack_sets,
    set_words,
    sources_of,
    unit_normals,
)
from visibility.dilution.kernels import dop as kernel
from visibility.errors import VisibilityInputError
from visibility.sight.sight_points import checked_positions

__all__ = ["Dop", "dop", "dop_at_points", "dop_per_visible_set"]


@dataclass(frozen=True, eq=False)
class Dop:
    """Dilutions of precision at one place (numpy scalars) or at n of them ((n,) arrays).

    gdop, pdop, hdop, vdop, tdop: of everything solved for, of the position, its horizontal and vertical part, and the
        clock (in metres of range); gdop² = pdop² + tdop². +inf = no fix, NaN = unknown; ``reason`` tells which. tdop is
        0 where no clock is solved for, that is for every kind but "pseudorange".
    reason: DopReason, uint8. count: visible anchors, int64.
    """

    gdop: npt.NDArray[np.float64]
    pdop: npt.NDArray[np.float64]
    hdop: npt.NDArray[np.float64]
    vdop: npt.NDArray[np.float64]
    tdop: npt.NDArray[np.float64]
    reason: npt.NDArray[np.uint8]
    count: npt.NDArray[np.int64]
    kind: DopKind

    def reasons(self) -> dict[DopReason, int]:
        """How many places there are of each reason."""
        return {reason: int(np.count_nonzero(self.reason == reason)) for reason in DopReason}


def dop(
    anchor_positions_m: npt.ArrayLike,
    receiver_m: npt.ArrayLike,
    kind: DopKind = "ranging",
    *,
    visible: npt.ArrayLike | None = None,
    surface_normal: npt.ArrayLike | None = None,
    distant: npt.ArrayLike | None = None,
) -> Dop:
    """Dilution of precision of ranges from k anchors to a receiver, or to n receivers (De Vivo et al., eqs. 16-18).

    anchor_positions_m: (k, 3) east, north, altitude, metres. receiver_m: (3,) or (n, 3), same frame. An anchor exactly
        at the receiver gives no direction and is left out.
    kind: "ranging" solves for the position only (two-way ranging, or one clock for all); "pseudorange" also for the
        receiver's clock; "tdoa" uses differences of arrival with the correlation that their shared reference gives
        them, so it does not depend on which anchor is the reference, and its position is that of pseudoranges.
    visible: (k,) or (n, k) bool; None = all.
    surface_normal: (3,) or (n, 3) east, north, up: the receiver stands on ground with this normal, and only its motion
        along the ground is unknown. Any length.
    distant: (k,) bool, or one for all: such rows of anchor_positions_m are directions towards a source so far away that
        rays are parallel, a satellite's for example.
    Raises VisibilityInputError.
    """
    points_m = checked_positions(
        "receiver_m", np.atleast_2d(numbers("receiver_m", receiver_m, "east, north, altitude"))
    )
    sources = sources_of(anchor_positions_m, distant)
    mask = visible_sets_of(visible, len(points_m), len(sources.anchors))
    found = solve(points_m, sources, mask, None, kind, surface_normal)
    return found if np.ndim(receiver_m) == 2 else _only(found)


def dop_at_points(
    points_m: npt.ArrayLike,
    anchor_positions_m: npt.ArrayLike,
    mask: npt.NDArray[np.uint64],
    kind: DopKind = "ranging",
    *,
    unknown: npt.ArrayLike | None = None,
    surface_normal: npt.ArrayLike | None = None,
    distant: npt.ArrayLike | None = None,
) -> Dop:
    """Dilution of precision at n points (n, 3), each with its own visible set as bits (``pack_sets``).

    mask: (n, words) uint64, bit a of word a // 64 = anchor a is visible; bits beyond the k anchors are ignored.
    unknown: (n,) bool, points whose visible set is not known: NaN. The rest as for ``dop``.
    Raises VisibilityInputError.
    """
    return solve(
        checked_positions("points_m", points_m),
        sources_of(anchor_positions_m, distant),
        mask,
        unknown,
        kind,
        surface_normal,
    )


def visible_sets_of(visible: npt.ArrayLike | None, points: int, anchors: int) -> npt.NDArray[np.uint64]:
    """Bit masks (points, words) of ``visible`` as ``dop`` takes it; raises VisibilityInputError."""
    seen = np.ones((points, anchors), np.bool_)
    if visible is not None:
        if np.shape(visible) not in (seen.shape, seen.shape[1:]):
            raise VisibilityInputError(
                f"visible must tell of each of the {anchors} anchors whether it is seen, for one receiver or for all "
                f"{points}, not shape {np.shape(visible)}."
            )
        seen[:] = np.asarray(visible, np.bool_)
    return pack_sets(seen)


def checked_sets(
    mask: npt.NDArray[np.uint64], unknown: npt.ArrayLike | None, points: int, anchors: int
) -> tuple[npt.NDArray[np.uint64], npt.NDArray[np.bool_], npt.NDArray[np.int64]]:
    """(mask, unknown, number of visible anchors) of so many points; raises VisibilityInputError."""
    words = set_words(anchors)
    if mask.dtype != np.uint64 or mask.shape != (points, words):
        raise VisibilityInputError(
            f"mask must be uint64 of shape ({points}, {words}) for {points} points and {anchors} anchors, "
            f"not {mask.dtype} {mask.shape}."
        )
    flags = np.zeros(points, np.bool_)
    if unknown is not None:
        if np.shape(unknown) != (points,):
            raise VisibilityInputError(f"unknown must be ({points},), one for each point, not {np.shape(unknown)}.")
        flags[:] = np.asarray(unknown, np.bool_)
    mask = np.ascontiguousarray(mask)
    if anchors % 64 or anchors == 0:
        mask = mask.copy()
        mask[:, -1] &= np.uint64((1 << (anchors % 64)) - 1)
    return mask, flags, np.bitwise_count(mask).sum(axis=1, dtype=np.int64)


def solve(
    points_m: npt.NDArray[np.float64],
    sources: Sources,
    mask: npt.NDArray[np.uint64],
    unknown: npt.ArrayLike | None,
    kind: DopKind,
    surface_normal: npt.ArrayLike | None,
) -> Dop:
    """Dilutions at checked points; raises VisibilityInputError where sets or normals do not fit them."""
    points = len(points_m)
    mask, flags, count = checked_sets(mask, unknown, points, len(sources.anchors))
    normals = unit_normals(surface_normal, points)
    dilutions, reason = np.empty((points, 5)), np.empty(points, np.uint8)
    kernel.dop_at_points(points_m, sources, mask, flags, kind_code(kind), normals, dilutions, reason)
    gdop, pdop, hdop, vdop, tdop = dilutions.T
    return Dop(gdop, pdop, hdop, vdop, tdop, reason, count, kind)


def _only(found: Dop) -> Dop:
    """The answer about one place, as numpy scalars."""
    dilutions = (found.gdop[0], found.pdop[0], found.hdop[0], found.vdop[0], found.tdop[0])
    return Dop(*dilutions, found.reason[0], found.count[0], found.kind)


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
    points = checked_positions("points_m", points_m)
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
