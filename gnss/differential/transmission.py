"""Where satellites were when they sent what was measured, and how wrong their clocks were."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError
from gnss.kepler import EARTH_RATE_RAD_PER_S

from .observations import Observations
from .orbits import Orbits

__all__ = ["LIGHT_M_PER_S", "Sent", "sent_by"]

Array = npt.NDArray[np.float64]
LIGHT_M_PER_S = 299_792_458.0


@dataclass(frozen=True, slots=True, eq=False)
class Sent:
    """One row for each of the observations.

    position_ecef_m: (n, 3) of the satellite when it sent, turned with the Earth during its signal's flight, metres.
    clock_m: (n,) what its clock was ahead, times the speed of light. NaN without code or orbit.
    """

    position_ecef_m: Array
    clock_m: Array


def sent_by(observed: Observations, orbits: Orbits, receiver_ecef_m: npt.ArrayLike) -> Sent:
    """What the satellites of the rows did when they sent.

    The time of sending is that of reception less the code, so that the receiver's clock does not enter.
    receiver_ecef_m: (3,) where about the receiver was; a kilometre turns the satellite by 0.2 m. Raises GnssInputError.
    """
    receiver_m = np.array(receiver_ecef_m, np.float64)
    if receiver_m.shape != (3,) or not np.isfinite(receiver_m).all():
        raise GnssInputError("receiver_ecef_m must be three finite numbers of metres.")
    position_m, clock_m = np.full((len(observed), 3), np.nan), np.full(len(observed), np.nan)
    codes_m = np.where(np.isnan(observed.code_m[:, 0]), observed.code_m[:, 1], observed.code_m[:, 0])
    for row in np.flatnonzero(np.isfinite(codes_m)):
        part_s = float(observed.part_s[row]) - float(codes_m[row]) / LIGHT_M_PER_S
        found_m, clock_s = orbits.state(int(observed.whole_s[row]), part_s, str(observed.satellite[row]))
        turn = EARTH_RATE_RAD_PER_S * float(np.linalg.norm(found_m - receiver_m)) / LIGHT_M_PER_S
        x_m, y_m, z_m = found_m
        position_m[row] = (
            math.cos(turn) * x_m + math.sin(turn) * y_m,
            math.cos(turn) * y_m - math.sin(turn) * x_m,
            z_m,
        )
        clock_m[row] = LIGHT_M_PER_S * clock_s
    return Sent(position_m, clock_m)
