"""Where a rover's ranges contradicted what a map has of an anchor, and how far sight is trusted around there.

A doubt weighs along its stretch as much as it is sure, and falls off beside it. Maps of sight have the anchor for
unknown where it weighs more than the map; probabilities of sight are mixed with the opposite by its weight.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.errors import VisibilityInputError

__all__ = ["SightDoubt", "doubt_weight", "doubted", "forget_where_doubted", "sentence_of_doubts", "weighed_sight"]

Floats = npt.NDArray[np.float64]

OUTWEIGHS = 0.5  # a doubt of more weight is likelier right than the map


@dataclass(frozen=True, slots=True)
class SightDoubt:
    """A stretch along which ranges of an anchor contradicted a map.

    places_m: (east, north) along it, at least one. probability: that the map is wrong there. has_sight: whether it is
    sight that the map has and the ranges deny, else a shadow. reach_m: one sigma of how far beside the stretch the
    doubt still holds. Raises VisibilityInputError.
    """

    places_m: tuple[tuple[float, float], ...]
    probability: float
    has_sight: bool = True
    reach_m: float = 30.0

    def __post_init__(self) -> None:
        if not self.places_m or not all(math.isfinite(metres) for place_m in self.places_m for metres in place_m):
            raise VisibilityInputError("A doubt needs the places where it arose, at least one, all finite.")
        if not 0.0 <= self.probability <= 1.0:
            raise VisibilityInputError(f"A doubt's probability must be between 0 and 1, not {self.probability}.")
        if not (math.isfinite(self.reach_m) and self.reach_m > 0.0):
            raise VisibilityInputError(f"A doubt's reach_m must be a number > 0 m, not {self.reach_m}.")

    def weight(self, points_m: Floats) -> Floats:
        """(n,) how much it weighs at points (n, 2 or more: east, north), 0..1; NaN points weigh nothing."""
        off_m = _distance_m(np.array(self.places_m, np.float64), points_m[:, :2])
        weight: Floats = self.probability * np.exp(-0.5 * (off_m / self.reach_m) ** 2)
        return np.nan_to_num(weight)

    @property
    def furthest_m(self) -> float:
        """How far from its stretch it outweighs a map; 0 where it never does."""
        if self.probability <= OUTWEIGHS:
            return 0.0
        return self.reach_m * math.sqrt(2.0 * math.log(self.probability / OUTWEIGHS))


def doubt_weight(doubts: Iterable[SightDoubt], points_m: Floats, *, has_sight: bool) -> Floats:
    """(n,) the most that any doubt of this kind weighs at points (n, 2 or more: east, north)."""
    weight = np.zeros(len(points_m))
    for doubt in doubts:
        if doubt.has_sight == has_sight:
            np.maximum(weight, doubt.weight(points_m), out=weight)
    return weight


def doubted(doubts: Iterable[SightDoubt], points_m: Floats) -> npt.NDArray[np.bool_]:
    """(n,) whether sight that a map has at points (n, 2 or more: east, north) is likelier none."""
    return doubt_weight(doubts, points_m, has_sight=True) > OUTWEIGHS


def weighed_sight(p_sight: Floats, doubts: Iterable[SightDoubt], points_m: Floats) -> Floats:
    """(n,) a map's probabilities of sight at points, mixed with the opposite by the weight of doubts; NaN stays NaN."""
    kept = tuple(doubts)
    lost = doubt_weight(kept, points_m, has_sight=True)
    won = doubt_weight(kept, points_m, has_sight=False)
    mixed: Floats = p_sight * (1.0 - lost) + (1.0 - p_sight) * won
    return mixed


def forget_where_doubted(
    grid: ElevationGrid, doubts: tuple[SightDoubt, ...], altitude_m: npt.NDArray[np.float32]
) -> None:
    """Set minimum visible altitudes (rows, cols) in place to NaN, unknown, over the posts where sight is doubted."""
    east_m = grid.origin_east_m + grid.cell_east_m * np.arange(grid.cols)
    north_m = grid.origin_north_m - grid.cell_north_m * np.arange(grid.rows)
    for doubt in doubts:
        if not doubt.has_sight:
            continue
        (west_m, south_m), (most_east_m, most_north_m) = (
            side(doubt.places_m, axis=0) + way * doubt.furthest_m for side, way in ((np.min, -1.0), (np.max, 1.0))
        )
        rows = np.flatnonzero((north_m >= south_m) & (north_m <= most_north_m))
        cols = np.flatnonzero((east_m >= west_m) & (east_m <= most_east_m))
        if not (len(rows) and len(cols)):
            continue
        box = (slice(rows[0], rows[-1] + 1), slice(cols[0], cols[-1] + 1))
        posts_m = np.stack(np.meshgrid(east_m[box[1]], north_m[box[0]]), axis=-1)
        altitude_m[box][doubted((doubt,), posts_m.reshape(-1, 2)).reshape(posts_m.shape[:2])] = np.nan


def sentence_of_doubts(anchor_id: str, doubts: tuple[SightDoubt, ...]) -> tuple[str, ...]:
    """What to know of an anchor whose sight is doubted; nothing of one whose is not."""
    lost = [doubt for doubt in doubts if doubt.has_sight and doubt.furthest_m > 0.0]
    if not lost:
        return ()
    furthest_m = max(doubt.furthest_m for doubt in lost)
    stretches = "1 stretch" if len(lost) == 1 else f"{len(lost)} stretches"
    return (
        f"Ranges of anchor {anchor_id} contradicted its sight along {stretches}: up to {furthest_m:.0f} m from there "
        "its sight is unknown.",
    )


def _distance_m(line_m: Floats, points_m: Floats) -> Floats:
    """(n,) from points (n, 2) to a line (m, 2)."""
    nearest_m2 = ((points_m - line_m[0]) ** 2).sum(axis=1)
    for begin_m, end_m in pairwise(line_m):
        step_m = end_m - begin_m
        share = ((points_m - begin_m) @ step_m / max(float(step_m @ step_m), 1e-12)).clip(0.0, 1.0)
        off_m = points_m - begin_m - share[:, None] * step_m
        nearest_m2 = np.minimum(nearest_m2, (off_m * off_m).sum(axis=1))
    distance_m: Floats = np.sqrt(nearest_m2)
    return distance_m
