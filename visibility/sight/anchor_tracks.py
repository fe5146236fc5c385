"""Anchors that move: time-stamped tracks, and what else has a state at a time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from visibility.errors import AnchorError, VisibilityInputError
from visibility.sight.anchors import Anchor, Covariance, DistantAnchor
from visibility.sight.antenna_limits import ALL_ROUND, AntennaLimits
from visibility.sight.radios import Radio

__all__ = ["AnchorTrack", "MovingAnchor", "anchors_at"]


class MovingAnchor(Protocol):
    """Anything that is an anchor at a time: a track, a satellite."""

    def at(self, time_s: float) -> Anchor | DistantAnchor | None:
        """The anchor at a time; None while there is none (a satellite that has set). Raises VisibilityInputError."""


@dataclass(frozen=True, eq=False)
class AnchorTrack:
    """An anchor's way through the air, straight and even between time-stamped positions.

    times_s: (n,) ascending. positions_m: (n, 3) east, north, altitude in the grid's frame. The rest as for Anchor.
    Raises AnchorError.
    """

    id: str
    times_s: npt.NDArray[np.float64]
    positions_m: npt.NDArray[np.float64]
    ranging_sigma_m: float = 0.1
    pose_sigma_m: float = 0.0
    limits: AntennaLimits = field(default=ALL_ROUND)
    pose_covariance_m2: Covariance | None = None
    radio: Radio | None = None

    def __post_init__(self) -> None:
        times_s, positions_m = np.array(self.times_s, np.float64), np.array(self.positions_m, np.float64)
        if times_s.ndim != 1 or times_s.size == 0 or positions_m.shape != (times_s.size, 3):
            raise AnchorError(
                f"Anchor track {self.id} needs as many positions (n, 3) as times (n,), not {positions_m.shape} and "
                f"{times_s.shape}."
            )
        if not np.isfinite(times_s).all() or (np.diff(times_s) <= 0.0).any():
            raise AnchorError(f"Anchor track {self.id}: times_s must be finite and ascend.")
        for name, array in (("times_s", times_s), ("positions_m", positions_m)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        for east_m, north_m, altitude_m in positions_m.tolist():
            self._anchor(east_m, north_m, altitude_m)

    def at(self, time_s: float) -> Anchor:
        """The anchor at a time; raises VisibilityInputError outside the track's times."""
        first_s, last_s = float(self.times_s[0]), float(self.times_s[-1])
        if not first_s <= time_s <= last_s:
            raise VisibilityInputError(
                f"Anchor track {self.id} runs from {first_s:g} s to {last_s:g} s, so nothing is known of it at "
                f"{time_s:g} s; ask for times within the track."
            )
        east_m, north_m, altitude_m = (float(np.interp(time_s, self.times_s, axis_m)) for axis_m in self.positions_m.T)
        return self._anchor(east_m, north_m, altitude_m)

    def _anchor(self, east_m: float, north_m: float, altitude_m: float) -> Anchor:
        sigmas_m = self.ranging_sigma_m, self.pose_sigma_m
        at_m = east_m, north_m, altitude_m
        return Anchor(self.id, *at_m, *sigmas_m, self.limits, self.pose_covariance_m2, radio=self.radio)


def anchors_at(
    anchors: tuple[Anchor | DistantAnchor | MovingAnchor, ...], time_s: float
) -> tuple[Anchor | DistantAnchor, ...]:
    """What there is of a mixture of standing and moving anchors at a time, in the same order."""
    here = [anchor if isinstance(anchor, Anchor | DistantAnchor) else anchor.at(time_s) for anchor in anchors]
    return tuple(anchor for anchor in here if anchor is not None)
