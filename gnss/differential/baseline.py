"""Where a rover is from a base: double differences of code and phase, ambiguities fixed by LAMBDA (RTKLIB's filter).

Takasu and Yasuda (2009), "Development of the low-cost RTK-GPS receiver with an open source program package RTKLIB";
Teunissen (1995), the least-squares ambiguity decorrelation adjustment.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError

from .observations import FREQUENCIES, Observations
from .orbits import Orbits
from .rows import by_satellite, check_orbits, epochs_of, rtklib_row
from .rtklib import SYSTEMS, CStruct, default_options, rtklib, seconds_of

__all__ = ["Baseline", "BaselineSettings", "Fix", "solve_baseline"]

Array = npt.NDArray[np.float64]
AMBIGUITIES = {"none": 0, "continuous": 1, "instantaneous": 2, "fix-and-hold": 3}
KINEMATIC, STATIC = 2, 3  # RTKLIB's modes
FROM_BROADCAST, SAASTAMOINEN = 1, 1
MOST_AGE_S = 30.0  # a base's epoch serves the rover for so long


class Fix(IntEnum):
    """How far an epoch was solved."""

    NONE = 0  # no solution
    FIXED = 1  # ambiguities are whole numbers, checked by the ratio test
    FLOAT = 2  # they are not
    CODE = 4  # code differences alone


@dataclass(frozen=True, slots=True)
class BaselineSettings:
    """How a baseline is solved.

    moving: the rover drives; else it stands. frequencies: 1 or 2. elevation_mask_rad: satellites below are left out.
    systems: letters as RINEX has them. ambiguities: how whole numbers are sought and kept; least_ratio: of the second
    best to the best, below which nothing is fixed. Raises GnssInputError.
    """

    moving: bool = True
    frequencies: int = 1
    elevation_mask_rad: float = math.radians(15.0)
    systems: tuple[str, ...] = ("G",)
    ambiguities: Literal["none", "continuous", "instantaneous", "fix-and-hold"] = "continuous"
    least_ratio: float = 3.0

    def __post_init__(self) -> None:
        if self.frequencies not in range(1, FREQUENCIES + 1):
            raise GnssInputError(f"frequencies must be 1 or {FREQUENCIES}, not {self.frequencies}.")
        if not 0.0 <= self.elevation_mask_rad < math.pi / 2:
            raise GnssInputError(f"elevation_mask_rad must lie in 0…π/2, not {self.elevation_mask_rad:g}.")
        if not self.systems or set(self.systems) - set(SYSTEMS):
            raise GnssInputError(f"systems must be some of {', '.join(SYSTEMS)}, not {self.systems!r}.")
        if self.ambiguities not in AMBIGUITIES:
            raise GnssInputError(f"ambiguities must be one of {', '.join(AMBIGUITIES)}, not {self.ambiguities!r}.")
        if not 1.0 <= self.least_ratio < math.inf:
            raise GnssInputError(f"least_ratio must be at least 1, not {self.least_ratio:g}.")


@dataclass(frozen=True, slots=True, eq=False)
class Baseline:
    """From the base to the rover, at each of the rover's epochs.

    time_s: (t,) GPS time since 1980-01-06, seconds; where there is a solution, less the error of the receiver's clock.
    fix: (t,) of Fix. baseline_ecef_m: (t, 3), covariance_m2: (t, 3, 3), both ECEF and NaN without a solution.
    ratio: (t,) of the second best ambiguities to the best, 0 = not sought.
    satellites: (t,) used. base_ecef_m: (3,). warnings: what to know, in sentences.
    """

    time_s: Array
    fix: npt.NDArray[np.int8]
    baseline_ecef_m: Array
    covariance_m2: Array
    ratio: Array
    satellites: npt.NDArray[np.int64]
    base_ecef_m: Array
    warnings: tuple[str, ...] = ()

    @property
    def rover_ecef_m(self) -> Array:
        """(t, 3) where the rover is, as far as the base is where it is said to be."""
        rover: Array = self.base_ecef_m + self.baseline_ecef_m
        return rover


class _Epoch(NamedTuple):
    time_s: float
    fix: Fix
    baseline_m: Array
    covariance_m2: Array
    ratio: float
    satellites: int


def solve_baseline(
    rover: Observations,
    base: Observations,
    orbits: Orbits,
    base_ecef_m: npt.ArrayLike | None = None,
    settings: BaselineSettings = BaselineSettings(),
    hidden: npt.ArrayLike | None = None,
) -> Baseline:
    """The baseline at each of the rover's epochs.

    base_ecef_m: (3,) where the base's antenna is; None takes its file's header, which is told. hidden: (rows of rover,)
    whether a satellite is predicted hidden there (``hidden_rows``); those rows are left out.
    Raises GnssInputError where no epoch can have a solution, GnssLibraryError.
    """
    base_m, warnings = _base_m(base, base_ecef_m)
    if hidden is not None:
        rover = rover.kept(~np.asarray(hidden, np.bool_))
    if not (len(rover) and len(base)):
        raise GnssInputError("Rover and base need observations; none are left.")
    _check_times(rover, base, orbits)
    library, filter_ = rtklib(), rtklib().rtk_t()
    library.rtkinit(filter_, _options(settings, orbits, base_m, rover, base))
    told = []
    try:
        for rows, (array, count) in zip(epochs_of(rover), _pairs(rover, base), strict=True):
            # a struct keeps its last solution where an epoch has none
            filter_.sol.stat = 0
            library.rtkpos(filter_, array.ptr, count, orbits.handle)
            told.append(_solved(filter_, float(rover.time_s[rows.start])))
    finally:
        library.rtkfree(filter_)
    fix = np.array([one.fix for one in told], np.int8)
    if not fix.any():
        warnings.append("No epoch has a solution: too few satellites are common to rover and base.")
    return Baseline(
        np.array([one.time_s for one in told]),
        fix,
        np.array([one.baseline_m for one in told]),
        np.array([one.covariance_m2 for one in told]),
        np.array([one.ratio for one in told]),
        np.array([one.satellites for one in told], np.int64),
        base_m,
        (*rover.warnings, *base.warnings, *warnings),
    )


def _base_m(base: Observations, given: npt.ArrayLike | None) -> tuple[Array, list[str]]:
    if given is not None:
        base_m = np.array(given, np.float64)
        if base_m.shape != (3,) or not np.isfinite(base_m).all():
            raise GnssInputError("base_ecef_m must be three finite numbers of metres.")
        return base_m, []
    if not np.isfinite(base.position_ecef_m).all():
        raise GnssInputError(f"{base.source} does not say where the base is: give base_ecef_m.")
    return base.position_ecef_m, [
        f"The base stands where {base.source} says in its header, which is often metres off; baselines hardly suffer, "
        "positions are off by as much."
    ]


def _check_times(rover: Observations, base: Observations, orbits: Orbits) -> None:
    first_s, last_s = float(rover.time_s[0]), float(rover.time_s[-1])
    apart_s = max(first_s - float(base.time_s[-1]), float(base.time_s[0]) - last_s)
    if apart_s > MOST_AGE_S:
        raise GnssInputError(f"{rover.source} and {base.source} lie {apart_s:.0f} s apart: no time is common to both.")
    check_orbits(rover, orbits)


def _options(
    settings: BaselineSettings, orbits: Orbits, base_m: Array, rover: Observations, base: Observations
) -> CStruct:
    options = default_options()
    options.mode = KINEMATIC if settings.moving else STATIC
    options.nf = settings.frequencies
    options.elmin = settings.elevation_mask_rad
    options.navsys = sum(SYSTEMS[letter] for letter in set(settings.systems))
    options.modear = AMBIGUITIES[settings.ambiguities]
    options.thresar[0] = settings.least_ratio
    options.ionoopt, options.tropopt = FROM_BROADCAST, SAASTAMOINEN
    options.sateph = int(orbits.precise)
    options.maxtdiff = MOST_AGE_S
    for n in range(3):
        options.rb[n] = float(base_m[n])
        for station, observed in enumerate((rover, base)):
            options.antdel[station, n] = float(observed.antenna_enu_m[n])
    return options


def _pairs(rover: Observations, base: Observations) -> Iterator[tuple[CStruct, int]]:
    """Each of the rover's epochs with the base's nearest in time, as an array of RTKLIB's rows and their number."""
    rovers, bases = epochs_of(rover), epochs_of(base)
    at_s = np.array([base.time_s[rows.start] for rows in bases])
    for rows in rovers:
        nearest = int(np.argmin(np.abs(at_s - rover.time_s[rows.start])))
        both = [(rover, n, 1) for n in by_satellite(rover, rows)]
        both += [(base, n, 2) for n in by_satellite(base, bases[nearest])]
        array = rtklib().Arr1Dobsd_t(len(both))
        for place, (observed, row, receiver) in enumerate(both):
            array[place] = rtklib_row(observed, row, receiver)
        yield array, len(both)


def _solved(filter_: CStruct, time_s: float) -> _Epoch:
    solution = filter_.sol
    fix = Fix(solution.stat) if solution.stat in set(Fix) else Fix.NONE
    if fix is Fix.NONE:
        return _Epoch(time_s, fix, np.full(3, np.nan), np.full((3, 3), np.nan), 0.0, 0)
    baseline_m = np.array([solution.rr[n] - filter_.rb[n] for n in range(3)])
    xx, yy, zz, xy, yz, zx = (float(solution.qr[n]) for n in range(6))
    covariance_m2 = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    at_s = sum(seconds_of(solution.time))
    return _Epoch(at_s, fix, baseline_m, covariance_m2, float(solution.ratio), int(solution.ns))
