"""The condition of the safety bubble: no nearer to anything than its radius, or which way to go (eq. 25)."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from .errors import BubbleError
from .inputs import numbers, positions

__all__ = ["BubbleCheck", "BubbleVerdict", "check_bubbles"]

Array = npt.NDArray[np.float64]

# rounding of heights kept as float32 puts nothing under the ground
GROUND_ROUNDING_M = 1e-3


class BubbleVerdict(enum.IntEnum):
    """VIOLATED: the surface is nearer than the radius. OK: it is not. UNKNOWN: unknown ground is nearer than that."""

    VIOLATED = 0
    OK = 1
    UNKNOWN = 255


@dataclass(frozen=True, eq=False)
class BubbleCheck:
    """The answer to ``check_bubbles``, for n points.

    margin_m: (n,) clearance less radius. verdict: (n,) BubbleVerdict, uint8. push: (n, 3) unit vector away from the
        nearest place, straight up where the point lies on it. push_m: (n,) how far to go that way, 0 where all is well.
    """

    margin_m: Array
    verdict: npt.NDArray[np.uint8]
    push: Array
    push_m: Array

    @property
    def first_violation(self) -> int | None:
        """Number of the first point whose bubble touches the surface; None where none does."""
        violated = self.verdict == BubbleVerdict.VIOLATED
        return int(np.argmax(violated)) if violated.any() else None

    def count(self, verdict: BubbleVerdict) -> int:
        """How many points have this verdict."""
        return int(np.count_nonzero(self.verdict == verdict))


def check_bubbles(
    points_m: npt.ArrayLike,
    radius_m: npt.ArrayLike,
    clearance_m: npt.ArrayLike,
    nearest_m: npt.ArrayLike,
    unknown_m: npt.ArrayLike = np.inf,
    *,
    under_ground: Literal["refuse", "violated"] = "refuse",
) -> BubbleCheck:
    """Whether d >= r at each point (De Vivo et al., eq. 25), and the push that would make it so.

    points_m: (n, 3); radius_m: (n,); clearance_m: (n,) signed distance to the nearest surface, negative below it;
    nearest_m: (n, 3) its place; unknown_m: (n,) how near unknown ground is, inf = nowhere: within the radius it makes a
    point that is not violated unknown.
    under_ground: a planned point below the ground is a mistake and refused; an estimate may lie there, and is violated
        then, with a push up through the surface.
    Raises BubbleError, carrying the index of the point.
    """
    points = positions("points_m", points_m, BubbleError)
    n = len(points)
    radius, clearance = (
        numbers("radius_m", radius_m, (n,), BubbleError),
        numbers("clearance_m", clearance_m, (n,), BubbleError),
    )
    nearest = numbers("nearest_m", nearest_m, (n, 3), BubbleError)
    unknown = np.array(np.broadcast_to(unknown_m, (n,)), np.float64)
    if np.isnan(clearance).any():
        first = int(np.argmax(np.isnan(clearance)))
        raise BubbleError(
            f"Point {first} has no clearance: it lies outside the DEM or over unknown ground.", index=first
        )
    if not (np.isfinite(radius) & (radius >= 0.0)).all():
        first = int(np.argmax(~(np.isfinite(radius) & (radius >= 0.0))))
        raise BubbleError(f"Point {first} has a radius of {radius[first]}; it must be zero or more.", index=first)
    below = clearance < -GROUND_ROUNDING_M
    if under_ground == "refuse" and below.any():
        first = int(np.argmax(below))
        raise BubbleError(f"Point {first} lies {-clearance[first]:.2f} m under the ground.", index=first)
    margin = clearance - radius
    verdict = np.where(margin >= 0.0, BubbleVerdict.OK, BubbleVerdict.VIOLATED).astype(np.uint8)
    verdict[(margin >= 0.0) & (unknown < radius)] = BubbleVerdict.UNKNOWN
    away = (points - nearest) * np.where(below, -1.0, 1.0)[:, None]
    length = np.linalg.norm(away, axis=1)
    push = np.tile([0.0, 0.0, 1.0], (n, 1))
    off = length > 0.0
    push[off] = away[off] / length[off, None]
    return BubbleCheck(margin, verdict, push, np.maximum(-margin, 0.0))
