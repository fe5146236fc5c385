"""Observations as RTKLIB takes them: epoch by epoch, row by row, of a time that the orbits serve."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gnss.errors import GnssInputError

from .observations import FREQUENCIES, STRENGTH_UNIT_DB_HZ, Observations
from .orbits import Orbits
from .rtklib import CStruct, gtime, rtklib, satellite_numbers

__all__ = ["by_satellite", "check_orbits", "epochs_of", "rtklib_row"]


def epochs_of(observed: Observations) -> list[slice]:
    """The rows of each epoch."""
    begins = np.flatnonzero(np.r_[True, np.diff(observed.epoch) > 0])
    return [slice(int(a), int(b)) for a, b in pairwise([*begins, len(observed)])]


def by_satellite(observed: Observations, rows: slice) -> list[int]:
    """The rows in the order in which RTKLIB looks for what rover and base have in common."""
    return sorted(range(rows.start, rows.stop), key=lambda n: satellite_numbers()[str(observed.satellite[n])])


def rtklib_row(observed: Observations, row: int, receiver: int) -> CStruct:
    """One row as RTKLIB has it; receiver: 1 rover, 2 base."""
    told = rtklib().obsd_t()
    told.time = gtime(int(observed.whole_s[row]), float(observed.part_s[row]))
    told.sat, told.rcv = satellite_numbers()[str(observed.satellite[row])], receiver
    for f in range(FREQUENCIES):
        told.P[f] = float(np.nan_to_num(observed.code_m[row, f]))
        told.L[f] = float(np.nan_to_num(observed.phase_cycles[row, f]))
        told.D[f] = float(np.nan_to_num(observed.doppler_hz[row, f]))
        told.SNR[f] = round(float(np.nan_to_num(observed.strength_db_hz[row, f])) / STRENGTH_UNIT_DB_HZ)
        told.code[f], told.LLI[f] = int(observed.signal[row, f]), int(observed.slip[row, f])
    return told


def check_orbits(observed: Observations, orbits: Orbits) -> None:
    """Raises GnssInputError where the orbits serve at no time of the observations."""
    first_s, last_s = float(observed.time_s[0]), float(observed.time_s[-1])
    if orbits.first_s > last_s or orbits.last_s < first_s:
        days = abs((orbits.first_s + orbits.last_s) / 2.0 - first_s) / 86_400.0
        raise GnssInputError(f"{orbits.source} is of another time than {observed.source}, {days:.1f} days away.")
