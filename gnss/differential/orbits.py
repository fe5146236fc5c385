"""Where satellites are: broadcast navigation files and precise orbits (SP3) together, as RTKLIB reads them."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gnss.errors import AlmanacFileError
from gnss.text_files import read_text

from .rinex_lines import check_navigation_lines
from .rtklib import CStruct, a_file, gtime, rtklib, satellite_numbers, seconds_of

__all__ = ["Orbits", "read_orbits"]

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
        """(3,) ECEF of a satellite at a time, of the frame of that time, metres; NaN where no orbit tells."""
        return self.state(whole_s, part_s, satellite)[0]

    def state(self, whole_s: int, part_s: float, satellite: str) -> tuple[npt.NDArray[np.float64], float]:
        """The same, and how many seconds the satellite's clock was ahead."""
        library = rtklib()
        state, clock, variance, health = (
            library.Arr1Ddouble(6),
            library.Arr1Ddouble(2),
            library.Arr1Ddouble(1),
            library.Arr1Dint(1),
        )
        time, kind = gtime(whole_s, part_s), PRECISE if self.precise else BROADCAST
        number = satellite_numbers()[satellite]
        if not library.satpos(time, time, number, kind, self.handle, state, clock, variance, health):
            return np.full(3, math.nan), math.nan
        return np.array([state[n] for n in range(3)]), float(clock[0])


def read_orbits(*paths: str | os.PathLike[str]) -> Orbits:
    """Read navigation files (RINEX 2 and 3), and SP3 files where there are, which are then used for positions.

    Raises AlmanacFileError, GnssLibraryError.
    """
    library = rtklib()
    handle = library.nav_t()
    precise = [path for path in paths if _is_sp3(path)]
    for path in paths:
        if path in precise:
            continue
        text = read_text(path, "RINEX navigation", MOST_BYTES)
        check_navigation_lines(text.splitlines(), Path(path).name)
        with a_file(text, "nav") as file:
            library.readrnx(file, 1, "", library.obs_t(), handle, library.sta_t())
    library.uniqnav(handle)
    names = ", ".join(Path(path).name for path in paths)
    for path in precise:
        _read_sp3(handle, path)
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


def _is_sp3(path: str | os.PathLike[str]) -> bool:
    """By its content: SP3 begins with #, a letter of its version, and P or V."""
    try:
        with Path(path).open("rb") as stream:
            head = stream.read(3)
    except OSError as error:
        raise AlmanacFileError(f"{Path(path).name} cannot be opened: {error.strerror}.") from error
    return len(head) == 3 and head[:1] == b"#" and head[1:2] in b"abcd" and head[2:3] in b"PV"


def _read_sp3(handle: CStruct, path: str | os.PathLike[str]) -> None:
    text = read_text(path, "SP3", MOST_BYTES)
    name = Path(path).name
    if not text.rstrip().endswith("EOF"):
        raise AlmanacFileError(f"{name} does not end with EOF: it is truncated.")
    with a_file(text, "sp3") as file:
        rtklib().readsp3(file, handle, 0)
    if handle.ne == 0:
        raise AlmanacFileError(f"{name} has no orbits that can be read.")
