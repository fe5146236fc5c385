"""Where satellites are: broadcast navigation files and precise orbits (SP3) together, as RTKLIB reads them."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gnss.errors import AlmanacFileError
from gnss.text_files import read_text

from .rinex_lines import check_navigation_lines
from .rtklib import CStruct, a_file, gtime, rtklib, satellite_numbers, seconds_of

__all__ = ["Orbits", "check_orbit_text", "parse_orbits", "read_orbits"]

MOST_BYTES = 200_000_000
BROADCAST, PRECISE = 0, 1  # RTKLIB's EPHOPT


@dataclass(frozen=True, slots=True, eq=False)
class Orbits:
    """Orbits and clocks of satellites, held by RTKLIB.

    handle: RTKLIB's, not to be changed. precise: SP3 is used. first_s, last_s: GPS time since 1980-01-06 between which
    they serve, seconds.
    """

    handle: CStruct
    precise: bool
    first_s: float
    last_s: float
    source: str

    def positions_ecef_m(self, whole_s: int, part_s: float, satellite: str) -> npt.NDArray[np.float64]:
        """(3,) ECEF of a satellite at a time, of the frame of that time, metres; NaN where no orbit tells, or it is
        unhealthy."""
        return self.state(whole_s, part_s, satellite)[0]

    def state(self, whole_s: int, part_s: float, satellite: str) -> tuple[npt.NDArray[np.float64], float]:
        """The same, and how many seconds the satellite's clock was ahead; where SP3 lacks that, the broadcast's."""
        position_m, clock_s = self._state(whole_s, part_s, satellite, PRECISE if self.precise else BROADCAST)
        if self.precise and clock_s == 0.0:
            clock_s = self._state(whole_s, part_s, satellite, BROADCAST)[1]
        return position_m, clock_s

    def _state(self, whole_s: int, part_s: float, satellite: str, kind: int) -> tuple[npt.NDArray[np.float64], float]:
        library = rtklib()
        state, clock, variance, health = (
            library.Arr1Ddouble(6),
            library.Arr1Ddouble(2),
            library.Arr1Ddouble(1),
            library.Arr1Dint(1),
        )
        time, number = gtime(whole_s, part_s), satellite_numbers()[satellite]
        found = library.satpos(time, time, number, kind, self.handle, state, clock, variance, health)
        if not found or health[0] > 0:
            return np.full(3, math.nan), math.nan
        return np.array([state[n] for n in range(3)]), float(clock[0])


def read_orbits(*paths: str | os.PathLike[str]) -> Orbits:
    """Read navigation files (RINEX 2 and 3), and SP3 files where there are, which are then used for positions.

    Raises AlmanacFileError, GnssLibraryError.
    """
    return parse_orbits([(read_text(path, "navigation or SP3", MOST_BYTES), Path(path).name) for path in paths])


def parse_orbits(files: Sequence[tuple[str, str]]) -> Orbits:
    """The same of (text, name) of each file. Raises AlmanacFileError, GnssLibraryError."""
    library = rtklib()
    handle = library.nav_t()
    for text, name in files:
        check_orbit_text(text, name)
        if _is_sp3(text):
            continue
        with a_file(text, "nav") as file:
            library.readrnx(file, 1, "", library.obs_t(), handle, library.sta_t())
    library.uniqnav(handle)
    names = ", ".join(name for _, name in files)
    precise = [(text, name) for text, name in files if _is_sp3(text)]
    for text, name in precise:
        _read_sp3(handle, text, name)
    if handle.n + handle.ng + handle.ne == 0:
        raise AlmanacFileError(f"{names or 'No file'}: no orbit in it.")
    times = [seconds_of(handle.eph[n].toe) for n in range(handle.n)]
    times += [seconds_of(handle.geph[n].toe) for n in range(handle.ng)]
    reach_s = 7200.0  # a broadcast set serves so long before and after its time
    seconds = [whole + part for whole, part in times]
    served = [(min(seconds) - reach_s, max(seconds) + reach_s)] if seconds else []
    if precise:
        of_sp3 = [sum(seconds_of(handle.peph[n].time)) for n in range(handle.ne)]
        served.append((min(of_sp3), max(of_sp3)))
    first_s, last_s = max(first for first, _ in served), min(last for _, last in served)
    if first_s > last_s:
        raise AlmanacFileError(f"{names} are of different days: no time has both broadcast and precise orbits.")
    return Orbits(handle, bool(precise), first_s, last_s, names)


def check_orbit_text(text: str, name: str) -> None:
    """Whether a navigation or SP3 file is one, and whole. Raises AlmanacFileError."""
    if not _is_sp3(text):
        check_navigation_lines(text.splitlines(), name)
    elif not text.rstrip().endswith("EOF"):
        raise AlmanacFileError(f"{name} does not end with EOF: it is truncated.")


def _is_sp3(text: str) -> bool:
    """By its content: SP3 begins with #, a letter of its version, and P or V."""
    return len(text) > 2 and text[0] == "#" and text[1] in "abcd" and text[2] in "PV"


def _read_sp3(handle: CStruct, text: str, name: str) -> None:
    with a_file(text, "sp3") as file:
        rtklib().readsp3(file, handle, 0)
    if handle.ne == 0:
        raise AlmanacFileError(f"{name} has no orbits that can be read.")
