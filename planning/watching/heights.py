"""How wrong a map's heights are, as ranges have it: the place that they alone give, held against the ground there.

One epoch's ranges know a height badly, but a map that is metres off is so for long. So a few sizes of its error, from
what was told to many times that, are weighed by how likely they make all that was seen of late.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from detection import EpochResult, GroundHeight
from planning.kernels.forecasts import free_place

__all__ = ["HeightCheck", "free_height"]

Floats = npt.NDArray[np.float64]

SCALES = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
LIKELY = np.array([0.8, 0.1, 0.05, 0.03, 0.01, 0.01])
LOOK_S = 2.0  # so far apart, the errors of two heights by ranges are independent
MEMORY_S = 120.0
STEPS = 3
FEWEST = 5  # ranges, so that one more than a place needs tells whether they meet
# A line that grazes the ground does so for a while: looks after one another have the same excess, and say so many
# times less of it than their number.
GRAZING_LOOKS = 4.0


class HeightCheck:
    """What a session has seen of its map's heights; changed in place. sigma_m: one sigma of them, as was told."""

    def __init__(self, sigma_m: float) -> None:
        self._told_m = sigma_m
        self._log_odds = np.log(LIKELY)
        self._last_s: float | None = None

    @property
    def scale(self) -> float:
        """Factor on the sigma that was told, in the geometric mean of what is likely; 1.0 at least."""
        odds = np.exp(self._log_odds - self._log_odds.max())
        return math.exp(float(odds @ np.log(SCALES) / odds.sum()))

    def note(self, off_m: float, variance_m2: float, time_s: float) -> None:
        """Take in by how much ranges alone have the antenna above the map's ground, and the variance of that."""
        since_s = LOOK_S if self._last_s is None else max(time_s - self._last_s, 0.0)
        self._last_s = time_s
        kept = math.exp(-since_s / MEMORY_S)
        spread_m2 = variance_m2 + (SCALES * self._told_m) ** 2
        told = -0.5 * (off_m**2 / spread_m2 + np.log(spread_m2 / spread_m2[0]))
        fresh = np.log(LIKELY)
        self._log_odds = fresh + kept * (self._log_odds - fresh) + min(since_s / LOOK_S, 1.0) * told


def free_height(
    result: EpochResult,
    anchors_m: Mapping[str, tuple[float, float, float]],
    p_direct: Mapping[str, float],
    p_sight: Mapping[str, float],
    ground: GroundHeight,
    sigma_m: float,
    harmless_m: float,
) -> tuple[float, float] | None:
    """(height over the ground, its variance) that ranges give without the ground.

    Of the ranges that the map has for direct; else of those that the verdicts left in, which a wrong height may have
    misled. sigma_m: one sigma of a range. harmless_m: by so much at most is a direct range too long whose line grazes
    the ground, anything up to that being as likely. None where ranges are too few, or do not meet in one place near the
    session's.
    """
    if result.position is None:
        return None
    direct = [v for v in result.verdicts if p_direct.get(v.anchor_id, 0.0) > 0.5]
    left_in = [v for v in result.verdicts if not v.off and v.anchor_id in anchors_m]
    for chosen in (direct, left_in):
        if len(chosen) >= FEWEST:
            told = [(anchors_m[v.anchor_id], v.range_m) for v in chosen]
            # where the map says nothing of a line it may graze
            seen = np.array([p_sight[v.anchor_id] for v in chosen])
            grazing = np.where(np.isnan(seen), 1.0, 1.0 - seen)
            # ranges that contradict a shadow do not graze, whatever the map has
            lasting_m2 = GRAZING_LOOKS * harmless_m**2 / 3.0 if chosen is direct else 0.0
            sigmas_m = np.sqrt(sigma_m**2 + grazing * lasting_m2)
            found = _free_height(told, result.position.position_m, ground, sigmas_m)
            if found is not None:
                return found
    return None


def _free_height(
    told: Sequence[tuple[tuple[float, float, float], float]], near_m: Floats, ground: GroundHeight, sigmas_m: Floats
) -> tuple[float, float] | None:
    anchors_m, ranges_m = np.array([one[0] for one in told]), np.array([one[1] for one in told])
    over, place_m = np.array([-ground.slope_east, -ground.slope_north, 1.0]), near_m.astype(np.float64)
    variance_m2, moved_m, misfit2 = free_place(anchors_m, ranges_m, sigmas_m, over, STEPS, place_m)
    if moved_m > 1.0 or misfit2 > 9.0 * len(told):
        return None
    off_m = float(over @ (place_m - [ground.east_m, ground.north_m, ground.altitude_m]))
    return off_m, variance_m2
