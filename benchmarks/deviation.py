"""How far one answer lies from the exact one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["WILD_M", "Deviation", "deviation", "pooled"]

# an altitude this far outside everything that the exact answer holds in the post's 3 x 3 neighbourhood is wild:
# no shadow edge moved by a cell can explain it
WILD_M = 10.0


@dataclass(frozen=True, eq=False)
class Deviation:
    """One anchor, or several pooled.

    misclassified: share of posts called otherwise than by exact, per receiver height above ground, per anchor.
    error_m: absolute altitude error of every post that exact calls hidden (to a receiver on the ground).
    wild: posts whose altitude lies more than WILD_M outside the exact altitudes of their 3 x 3 neighbourhood.
    """

    misclassified: dict[float, tuple[float, ...]]
    error_m: npt.NDArray[np.float32]
    wild: int
    posts: int

    def percentile_m(self, percent: float) -> float:
        return float(np.percentile(self.error_m, percent)) if self.error_m.size else 0.0

    @property
    def largest_m(self) -> float:
        return float(self.error_m.max(initial=0.0))

    def mean(self, receiver_m: float) -> float:
        return float(np.mean(self.misclassified[receiver_m]))

    def worst(self, receiver_m: float) -> float:
        return max(self.misclassified[receiver_m])


def deviation(
    ground_m: npt.NDArray[np.float32],
    altitude_m: npt.NDArray[np.floating],
    exact_m: npt.NDArray[np.floating],
    own_post: tuple[int, int],
    receivers_m: tuple[float, ...],
) -> Deviation:
    """Of one anchor's altitude_m from exact_m, both (rows, cols); its own post and unknown posts do not count."""
    counted = np.isfinite(exact_m)
    counted[own_post] = False
    posts = int(np.count_nonzero(counted))
    answer_m = altitude_m.astype(np.float32)
    misclassified: dict[float, tuple[float, ...]] = {}
    for receiver_m in receivers_m:
        receiver_altitude_m = ground_m + np.float32(receiver_m)
        differs = (receiver_altitude_m >= answer_m) != (receiver_altitude_m >= exact_m)
        misclassified[receiver_m] = (float(np.count_nonzero(differs & counted)) / posts,)
    hidden = counted & (exact_m > ground_m)
    error_m = np.abs(answer_m[hidden] - exact_m[hidden]).astype(np.float32)
    low_m, high_m = _neighbourhood(exact_m, np.fmin), _neighbourhood(exact_m, np.fmax)
    wild = counted & ((answer_m < low_m - WILD_M) | (answer_m > high_m + WILD_M))
    return Deviation(misclassified, error_m, int(np.count_nonzero(wild)), posts)


def pooled(parts: list[Deviation]) -> Deviation:
    """Several anchors as one: shares side by side, errors together."""
    receivers_m = parts[0].misclassified
    return Deviation(
        {receiver_m: tuple(s for part in parts for s in part.misclassified[receiver_m]) for receiver_m in receivers_m},
        np.concatenate([part.error_m for part in parts]),
        sum(part.wild for part in parts),
        sum(part.posts for part in parts),
    )


def _neighbourhood(values: npt.NDArray[np.floating], pick: np.ufunc) -> npt.NDArray[np.floating]:
    padded = np.pad(values, 1, mode="edge")
    along_rows = pick(pick(padded[:-2], padded[1:-1]), padded[2:])
    picked: npt.NDArray[np.floating] = pick(pick(along_rows[:, :-2], along_rows[:, 1:-1]), along_rows[:, 2:])
    return picked
