"""A drive with its truth: where the rover was when, and by how much each range was too long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..epochs import RangingAnchor, check_anchors
from ..errors import DetectionInputError

__all__ = ["SimulatedDrive", "drive_along"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedDrive:
    """The truth of a drive of n epochs among k anchors.

    times_s: (n,), rising. places_m: (n, 2) or (n, 3) of the antenna: east, north, up, the frame of the anchors.
    excess_m: (n, k), by how much the way of the signal is longer than the straight line: 0 in sight, positive behind an
        obstacle (over terrain: ``visibility.lines_of_sight(..., excess_path=True)``), NaN where no range is heard.
    p_sight: (n, k), what a map predicts, 0 to 1, NaN = no prediction; None = no map.
    Raises DetectionInputError.
    """

    anchors: tuple[RangingAnchor, ...]
    times_s: Floats
    places_m: Floats
    excess_m: Floats
    p_sight: Floats | None = None

    def __post_init__(self) -> None:
        check_anchors(self.anchors)
        count, shape = len(self.times_s), (len(self.times_s), len(self.anchors))
        if self.places_m.shape not in ((count, 2), (count, 3)):
            raise DetectionInputError(f"places_m must be ({count}, 2) or ({count}, 3), not {self.places_m.shape}.")
        for name, table in (("excess_m", self.excess_m), ("p_sight", self.p_sight)):
            if table is not None and table.shape != shape:
                raise DetectionInputError(f"{name} must be {shape}, a row per epoch and a column per anchor.")
        if not (np.isfinite(self.times_s).all() and (np.diff(self.times_s) > 0.0).all()):
            raise DetectionInputError("times_s must be finite and rise from epoch to epoch.")
        if not np.isfinite(self.places_m).all():
            raise DetectionInputError("places_m must be finite.")
        if np.isinf(self.excess_m).any() or (self.excess_m < 0.0).any():
            raise DetectionInputError("excess_m must be 0, positive, or NaN where no range is heard.")

    @property
    def anchor_places_m(self) -> Floats:
        """(k, 2) or (k, 3), as the rover's places."""
        places = [(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in self.anchors]
        return np.array(places, dtype=np.float64).reshape(-1, 3)[:, : self.places_m.shape[1]]

    @property
    def distances_m(self) -> Floats:
        """(n, k), the straight lines."""
        apart_m = self.places_m[:, None, :] - self.anchor_places_m[None, :, :]
        distances_m: Floats = np.linalg.norm(apart_m, axis=2)
        return distances_m


def drive_along(
    anchors: Sequence[RangingAnchor], waypoints_m: npt.ArrayLike, speed_m_per_s: float, every_s: float = 1.0
) -> SimulatedDrive:
    """A drive from waypoint to waypoint at constant speed with every anchor in sight; an epoch every so many seconds.

    waypoints_m: (w, 2) or (w, 3). Raises DetectionInputError.
    """
    corners_m = np.array(waypoints_m, dtype=np.float64)
    if corners_m.ndim != 2 or len(corners_m) < 2:
        raise DetectionInputError("A drive needs at least two waypoints.")
    if not (speed_m_per_s > 0.0 and every_s > 0.0):
        raise DetectionInputError("speed_m_per_s and every_s must be > 0.")
    gone_m = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(corners_m, axis=0), axis=1))))
    times_s = np.arange(0.0, gone_m[-1] / speed_m_per_s + 1e-9, every_s)
    places_m = np.column_stack(
        [np.interp(times_s * speed_m_per_s, gone_m, corners_m[:, axis]) for axis in range(corners_m.shape[1])]
    )
    return SimulatedDrive(tuple(anchors), times_s, places_m, np.zeros((len(times_s), len(anchors))))
