"""Whether a range arrives, and straight: the signal of anchors with radios, over ground, roofs and trees.

A range that came says more than that power sufficed: where the straight way is too weak but the open air would not be,
it came round by a reflection, and is too long.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import Curvature
from visibility.signal import Radio, free_space_loss_db, signals

__all__ = ["REFLECTED_DB", "Arrivals", "arrivals"]

Floats = npt.NDArray[np.float64]

# what a way round costs more than the straight one through open air: half the field lost where it turns (6 dB), and as
# much again for what is longer and rough
REFLECTED_DB = 12.0
LEAST_SPREAD_DB = 1e-3  # a radio without spread has a step for a probability


@dataclass(frozen=True, slots=True, eq=False)
class Arrivals:
    """The signal of k anchors at m places; (m, k), NaN of anchors without a radio and where it is not known.

    margin_db: of the straight way, with diffraction and trees; open_margin_db: the same through open air.
    p_usable: probability that enough arrives by the straight way. spread_db: (k,). notes: what to know, sentences.
    """

    margin_db: Floats
    open_margin_db: Floats
    p_usable: Floats
    spread_db: Floats
    notes: tuple[str, ...]

    def straight(self, p_direct: Floats) -> Floats:
        """(m, k) probability that a range which arrived came straight, p_direct: where power is no question.

        p_direct itself where the signal is not known.
        """
        from scipy.special import expit, log_ndtr

        spread_db = np.maximum(self.spread_db, LEAST_SPREAD_DB)
        enough = log_ndtr(self.margin_db / spread_db)
        with np.errstate(divide="ignore"):
            came_straight = np.log(p_direct) + enough
            came_round = np.log1p(-p_direct * np.exp(enough))
        came_round = came_round + log_ndtr((self.open_margin_db - REFLECTED_DB) / spread_db)
        return np.where(np.isnan(enough), p_direct, expit(came_straight - came_round))


def arrivals(
    grid: ElevationGrid,
    points_m: Floats,
    anchors_m: Floats,
    radios: Sequence[Radio | None],
    curvature: Curvature | None = None,
) -> Arrivals:
    """What arrives at points (m, 3) of anchors (k, 3), each with a radio or without. Raises SignalError."""
    m, k = len(points_m), len(anchors_m)
    margin_db, open_margin_db, p_usable = (np.full((m, k), np.nan) for _ in range(3))
    spread_db, notes = np.full(k, np.nan), dict[str, None]()
    for radio in dict.fromkeys(one for one in radios if one is not None):
        of = [number for number, one in enumerate(radios) if one == radio]
        ends_m = np.tile(anchors_m[of], (m, 1))
        found = signals(grid, np.repeat(points_m, len(of), axis=0), ends_m, radio, curvature=curvature)
        distance_m = np.linalg.norm(anchors_m[None, of] - points_m[:, None], axis=2)
        margin_db[:, of] = found.margin_db.reshape(m, -1)
        p_usable[:, of] = found.probability.reshape(m, -1)
        open_margin_db[:, of] = radio.allowed_loss_db - free_space_loss_db(distance_m, radio.frequency_hz)
        spread_db[of] = radio.spread_db
        notes |= dict.fromkeys(found.warnings)
    return Arrivals(margin_db, open_margin_db, p_usable, spread_db, tuple(notes))
