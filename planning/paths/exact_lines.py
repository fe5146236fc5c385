"""What places get of anchors that stand, by exact sight lines or signals, line by line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from visibility import UNKNOWN, VISIBLE, DistantAnchor, MinimumVisibleAltitude, visible_sets
from visibility.sight import doubted
from visibility.sight.sight_points import points_within_reach
from visibility.signal import reception

__all__ = ["Enough", "Received", "exact_lines"]

Floats = npt.NDArray[np.float64]


class Enough(NamedTuple):
    """How many lines that are in sight by that much answer for a point: of its others nothing is asked then.

    order: numbers of all anchors, those first that are in sight most.
    """

    lines: int
    margin_m: float
    order: tuple[int, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Received:
    """What n points get of k anchors: visible, unknown (n, k) bool; margin_m (n, k) clearance of the sight line."""

    visible: npt.NDArray[np.bool_]
    unknown: npt.NDArray[np.bool_]
    margin_m: Floats


def exact_lines(minimum: MinimumVisibleAltitude, points_m: Floats, enough: Enough | None = None) -> Received:
    """What points (n, 3) get of the anchors of maps, line by line: by their signals where they have radios.

    enough: when a point is asked about no further anchor, which counts as hidden then.
    """
    k = len(minimum.anchors)
    visible, unknown = np.zeros((len(points_m), k), np.bool_), np.zeros((len(points_m), k), np.bool_)
    margin_m = np.full((len(points_m), k), np.nan)
    distant = any(isinstance(anchor, DistantAnchor) for anchor in minimum.anchors)
    of_maps = visible_sets(minimum, points_m).visible() if distant else visible
    all_points, sure = points_m, np.zeros(len(points_m), np.int64)
    for number in range(k) if enough is None else enough.order:
        anchor = minimum.anchors[number]
        if isinstance(anchor, DistantAnchor):
            visible[:, number] = of_maps[:, number]
            sure += visible[:, number]
            continue
        at = np.arange(len(sure)) if enough is None else np.flatnonzero(sure < enough.lines)
        if len(at) == 0:
            continue
        points_m = all_points[at]
        eye_m = np.broadcast_to([anchor.east_m, anchor.north_m, anchor.altitude_m], points_m.shape)
        got = reception(
            *(minimum.grid, eye_m, points_m, anchor.radio),
            curvature=minimum.curvature,
            unknown=minimum.unknown,
            clearance=True,
        )
        assert got.clearance_m is not None, "it was asked for"
        within = points_within_reach(anchor, points_m, minimum.curvature)
        told = ~doubted(anchor.doubts, points_m)
        visible[at, number] = (got.verdict == VISIBLE) & within & told
        unknown[at, number] = ((got.verdict == UNKNOWN) | ((got.verdict == VISIBLE) & ~told)) & within
        margin_m[at, number] = got.clearance_m
        if enough is not None:
            sure[at] += visible[at, number] & (got.clearance_m >= enough.margin_m)
    return Received(visible, unknown, margin_m)
