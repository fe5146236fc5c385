"""What a GNSS receiver measured: RINEX observation files, versions 2 and 3, as arrays."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gnss.errors import AlmanacFileError, GnssInputError
from gnss.text_files import read_text

from .rinex_lines import check_lines
from .rtklib import CStruct, a_file, rtklib, satellite_names, seconds_of

__all__ = ["FREQUENCIES", "STRENGTH_UNIT_DB_HZ", "Observations", "parse_observations", "read_observations"]

FREQUENCIES = 2  # kept: L1 and L2 or their like of other systems
STRENGTH_UNIT_DB_HZ = 0.001  # of RTKLIB
MOST_BYTES = 500_000_000

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Rows of one satellite at one epoch, by time and then by satellite; NaN where something was not measured.

    whole_s, part_s: (n,) GPS time since 1980-01-06 as whole seconds and the rest. satellite: (n,) names, "G05".
    code_m, phase_cycles, doppler_hz: (n, 2) on two frequencies. strength_db_hz: (n, 2). signal: (n, 2) RTKLIB's number
    of the signal, 0 = none. slip: (n, 2) loss-of-lock indicators as RINEX has them, 0 = none.
    position_ecef_m: (3,) as the header says, often metres off, NaN = none. antenna_enu_m: (3,) of the antenna from the
    marker. warnings: what to know, in sentences.
    """

    whole_s: npt.NDArray[np.int64]
    part_s: Array
    satellite: npt.NDArray[np.str_]
    code_m: Array
    phase_cycles: Array
    doppler_hz: Array
    strength_db_hz: Array
    signal: npt.NDArray[np.uint8]
    slip: npt.NDArray[np.uint8]
    position_ecef_m: Array
    antenna_enu_m: Array
    source: str = "observations"
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.whole_s)

    @property
    def time_s(self) -> Array:
        """(n,) GPS time since 1980-01-06, seconds, good to 0.1 µs."""
        time_s: Array = self.whole_s + self.part_s
        return time_s

    @property
    def epoch(self) -> npt.NDArray[np.intp]:
        """(n,) number of the epoch that a row belongs to, from 0."""
        if len(self) == 0:
            return np.zeros(0, np.intp)
        begins = np.r_[False, np.diff(self.time_s) > 1e-3]
        return np.cumsum(begins)

    def kept(self, keep: npt.ArrayLike) -> Observations:
        """The rows where keep, (n,) of bool, holds. Raises GnssInputError."""
        rows = np.asarray(keep)
        if rows.dtype != np.bool_ or rows.shape != (len(self),):
            raise GnssInputError(f"keep must be {len(self)} of true and false, not {rows.dtype} of {rows.shape}.")
        of_rows = ("whole_s", "part_s", "satellite", "code_m", "phase_cycles", "doppler_hz", "strength_db_hz", "signal")
        return replace(self, **{name: getattr(self, name)[rows] for name in (*of_rows, "slip")})


def read_observations(path: str | os.PathLike[str]) -> Observations:
    """Read a RINEX observation file, version 2 or 3. Raises AlmanacFileError, GnssLibraryError."""
    return parse_observations(read_text(path, "RINEX observation", MOST_BYTES), Path(path).name)


def parse_observations(text: str, source: str = "observation file") -> Observations:
    """The observations in a file's text. Raises AlmanacFileError for one that is cut short, damaged or no such file."""
    epochs = check_lines(text.splitlines(), source)
    library = rtklib()
    kept, station = library.obs_t(), library.sta_t()
    with a_file(text, "obs") as path:
        state = library.readrnx(path, 1, "", kept, library.nav_t(), station)
    if state < 0 or kept.n == 0:
        raise AlmanacFileError(f"{source} has no observations that can be read: damaged, or of signals unknown here.")
    names = satellite_names()
    rows = [kept.data[n] for n in range(kept.n)]
    times = [seconds_of(row.time) for row in rows]
    order = np.lexsort(([row.sat for row in rows], [part for _, part in times], [whole for whole, _ in times]))

    def measured(field: str, unit: float = 1.0) -> Array:
        values = np.array([[getattr(rows[n], field)[f] for f in range(FREQUENCIES)] for n in order], np.float64)
        return np.where(values == 0.0, np.nan, values * unit)  # RTKLIB has zero where nothing was measured

    told = Observations(
        whole_s=np.array([times[n][0] for n in order], np.int64),
        part_s=np.array([times[n][1] for n in order]),
        satellite=np.array([names[rows[n].sat] for n in order]),
        code_m=measured("P"),
        phase_cycles=measured("L"),
        doppler_hz=measured("D"),
        strength_db_hz=measured("SNR", STRENGTH_UNIT_DB_HZ),
        signal=np.array([[rows[n].code[f] for f in range(FREQUENCIES)] for n in order], np.uint8),
        slip=np.array([[rows[n].LLI[f] for f in range(FREQUENCIES)] for n in order], np.uint8),
        position_ecef_m=_position_m(station),
        antenna_enu_m=np.array([float(getattr(station, "del")[n]) for n in range(3)]),
        source=source,
    )
    read = int(told.epoch[-1]) + 1
    if read == epochs:
        return told
    return replace(told, warnings=(f"{source} has {epochs} epochs, of which {read} hold what can be used.",))


def _position_m(station: CStruct) -> Array:
    position_m = np.array([float(station.pos[n]) for n in range(3)])
    return position_m if np.linalg.norm(position_m) > 1.0 else np.full(3, np.nan)
