"""What one receiver heard, put right for a filter: codes and phases without the satellites' clocks and the air."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError

from .observations import Observations
from .orbits import Orbits
from .rows import by_satellite, check_orbits, epochs_of, rtklib_row
from .rtklib import CStruct, default_options, gtime, rtklib, satellite_numbers
from .transmission import LIGHT_M_PER_S, sent_by

__all__ = ["ReceiverRanges", "receiver_ranges"]

Array = npt.NDArray[np.float64]
BROADCAST_IONOSPHERE, SAASTAMOINEN, SINGLE = 1, 1, 0  # of RTKLIB's options
GPS_BIT, ROBUST_PLACE = 0x01, 4  # its number of GPS, and of the option to leave out a satellite that disagrees
L1_HZ, HUMIDITY = 1575.42e6, 0.7
LOWEST_RAD = math.radians(5.0)  # below, the models of the air are of no use
JUMP_M = LIGHT_M_PER_S * 1e-3  # receivers keep their clocks near GPS time by jumps of whole milliseconds
# how many satellites tell a clock's jump
LEAST_COMMON = 3
# so many epochs and seconds tell a drift, which from so much on is one
LEAST_EPOCHS, LEAST_DRIFT_M_PER_S = 30, 0.05


@dataclass(frozen=True, slots=True, eq=False)
class ReceiverRanges:
    """Rows of one satellite at one epoch, by time: those with an orbit, at 5 degrees of elevation or more.

    time_s: (n,) GPS time since 1980-01-06, of an epoch the same, where its receiver's clock is known without the error
    of that. satellite: (n,) names. position_ecef_m: (n, 3) where
    it was when it sent, in the frame of the instant when the signal comes in. code_m: (n,) NaN = none, or of another
    system than GPS, whose clock is another. phase_m: (n,) cycles times wavelength, NaN = none. Both are ranges with the
    receiver's clock in them, whose jumps by whole milliseconds are taken out; a phase is off by whole cycles.
    arc: (n,) whole numbers; where a satellite's changes, whole cycles were lost. elevation_rad: (n,). place_ecef_m:
    (3,) where code puts the receiver at the first epoch that has four. warnings: in sentences.
    """

    time_s: Array
    satellite: npt.NDArray[np.str_]
    position_ecef_m: Array
    code_m: Array
    phase_m: Array
    arc: npt.NDArray[np.int64]
    elevation_rad: Array
    place_ecef_m: Array
    warnings: tuple[str, ...] = ()


def receiver_ranges(observed: Observations, orbits: Orbits) -> ReceiverRanges:
    """The first frequency's codes and phases, put right for satellites' clocks and group delays, and for the air:
    troposphere (Saastamoinen), ionosphere (Klobuchar, with the navigation file's coefficients).

    Raises GnssInputError where the orbits are of another time or no epoch tells a place, GnssLibraryError.
    """
    if not len(observed):
        raise GnssInputError(f"{observed.source} has no observations.")
    check_orbits(observed, orbits)
    place_m = _first_place_m(observed, orbits)
    sent = sent_by(observed, orbits, place_m)
    air = [_air(observed, row, place_m, sent.position_ecef_m[row], orbits) for row in range(len(observed))]
    elevation, troposphere, ionosphere, wavelength = np.array(air).T
    is_gps = np.char.startswith(observed.satellite, "G")
    delay_m = _group_delays_m(orbits, observed.satellite)
    code_m = np.where(is_gps, observed.code_m[:, 0], np.nan) + sent.clock_m - delay_m - troposphere - ionosphere
    phase_m = observed.phase_cycles[:, 0] * wavelength + sent.clock_m - troposphere + ionosphere
    range_m = np.linalg.norm(sent.position_ecef_m - place_m, axis=1)
    time_s = _times_s(observed, code_m - range_m)
    code_m, phase_m = _without_jumps(observed, code_m, phase_m, range_m)
    arc = _arcs(observed)
    apart_m_per_s = _drift_apart_m_per_s(observed, code_m - phase_m, arc)
    phase_m += apart_m_per_s * (observed.time_s - observed.time_s[0])
    there = np.isfinite(sent.clock_m) & (elevation >= LOWEST_RAD) & ~(np.isnan(code_m) & np.isnan(phase_m))
    if not np.isfinite(code_m[there]).any():
        raise GnssInputError(f"{observed.source} has no codes of GPS satellites that {orbits.source} tells of.")
    warnings = list(observed.warnings)
    without = sorted(set(observed.satellite[~np.isfinite(sent.clock_m)].tolist()))
    if without:
        warnings.append(f"Satellites without an orbit at some time, not used then: {', '.join(without)}.")
    if apart_m_per_s:
        warnings.append(
            f"Codes and phases drift apart by {apart_m_per_s:.2f} m/s, which was made up for in the phases."
        )
    return ReceiverRanges(
        time_s[there],
        observed.satellite[there],
        sent.position_ecef_m[there],
        code_m[there],
        phase_m[there],
        arc[there],
        elevation[there],
        place_m,
        tuple(warnings),
    )


def _first_place_m(observed: Observations, orbits: Orbits) -> Array:
    """(3,) ECEF by code alone, at the first epoch that tells it (RTKLIB's single point positioning)."""
    library, options = rtklib(), default_options()
    options.mode, options.nf, options.navsys = SINGLE, 1, GPS_BIT
    options.ionoopt, options.tropopt, options.sateph = BROADCAST_IONOSPHERE, SAASTAMOINEN, int(orbits.precise)
    options.elmin = LOWEST_RAD
    options.posopt[ROBUST_PLACE] = 1
    filter_ = library.rtk_t()
    library.rtkinit(filter_, options)
    try:
        for rows in epochs_of(observed):
            heard = by_satellite(observed, rows)
            array = library.Arr1Dobsd_t(len(heard))
            for place, row in enumerate(heard):
                array[place] = rtklib_row(observed, row, 1)
            filter_.sol.stat = 0
            library.rtkpos(filter_, array.ptr, len(heard), orbits.handle)
            if filter_.sol.stat:
                return np.array([float(filter_.sol.rr[n]) for n in range(3)])
    finally:
        library.rtkfree(filter_)
    raise GnssInputError(
        f"At no epoch of {observed.source} codes of four GPS satellites that {orbits.source} tells of make a place."
    )


def _air(
    observed: Observations, row: int, place_m: Array, satellite_m: Array, orbits: Orbits
) -> tuple[float, float, float, float]:
    """(elevation, delays in the troposphere and of code in the ionosphere, wavelength) of a row, NaN without orbit."""
    library = rtklib()
    number = satellite_numbers()[str(observed.satellite[row])]
    hertz = library.sat2freq(number, int(observed.signal[row, 0]), orbits.handle)
    wavelength = LIGHT_M_PER_S / hertz if hertz > 0.0 else math.nan
    if not np.isfinite(satellite_m).all():
        return math.nan, math.nan, math.nan, wavelength
    place, towards, angles = library.Arr1Ddouble(3), library.Arr1Ddouble(3), library.Arr1Ddouble(2)
    line = (satellite_m - place_m) / np.linalg.norm(satellite_m - place_m)
    library.ecef2pos(_vector(library, place_m), place)
    for n in range(3):
        towards[n] = float(line[n])
    elevation = float(library.satazel(place, towards, angles))
    time = gtime(int(observed.whole_s[row]), float(observed.part_s[row]))
    wet_and_dry = float(library.tropmodel(time, place, angles, HUMIDITY))
    electrons = float(library.ionmodel(time, orbits.handle.ion_gps, place, angles))
    return elevation, wet_and_dry, electrons * (L1_HZ / hertz) ** 2 if hertz > 0.0 else math.nan, wavelength


def _vector(library: CStruct, values: Array) -> CStruct:
    told = library.Arr1Ddouble(3)
    for n in range(3):
        told[n] = float(values[n])
    return told


def _group_delays_m(orbits: Orbits, names: npt.NDArray[np.str_]) -> Array:
    """(n,) by which a satellite's code on L1 comes later than its clock tells, as its broadcast sets have it; 0 where
    none does."""
    delays: dict[int, list[float]] = {}
    for n in range(orbits.handle.n):
        one = orbits.handle.eph[n]
        delays.setdefault(int(one.sat), []).append(LIGHT_M_PER_S * float(one.tgd[0]))
    means = {number: float(np.mean(told)) for number, told in delays.items()}
    numbers = satellite_numbers()
    return np.array([means.get(numbers[str(name)], 0.0) for name in names])


def _times_s(observed: Observations, clock_m: Array) -> Array:
    """(n,) when, without what the receiver's clock is ahead by codes."""
    time_s = observed.time_s
    for rows in epochs_of(observed):
        known = clock_m[rows][np.isfinite(clock_m[rows])]
        time_s[rows] = time_s[rows.start] - (float(np.median(known)) / LIGHT_M_PER_S if len(known) else 0.0)
    return time_s


def _without_jumps(observed: Observations, code_m: Array, phase_m: Array, range_m: Array) -> tuple[Array, Array]:
    """Codes and phases without the clock's jumps by whole milliseconds; phases where they jump as well."""
    code_m, phase_m = code_m.copy(), phase_m.copy()
    before: dict[str, tuple[float, float]] = {}
    steps = {"code": 0, "phase": 0}
    for rows in epochs_of(observed):
        now = {
            str(observed.satellite[n]): (float(code_m[n] - range_m[n]), float(phase_m[n] - range_m[n]))
            for n in range(rows.start, rows.stop)
        }
        for place, (kind, values) in enumerate((("code", code_m), ("phase", phase_m))):
            moved = [now[one][place] - before[one][place] for one in now.keys() & before.keys()]
            moved = [one for one in moved if math.isfinite(one)]
            if len(moved) >= LEAST_COMMON:
                steps[kind] += round(float(np.median(moved)) / JUMP_M)
            values[rows] -= steps[kind] * JUMP_M
        before |= now
    return code_m, phase_m


def _drift_apart_m_per_s(observed: Observations, apart_m: Array, arc: npt.NDArray[np.int64]) -> float:
    """By how much all codes grow beyond their phases in a second, 0 where that is nothing: receivers whose codes have
    another clock than their phases. What ionosphere and detours do differs from satellite to satellite, and is less."""
    slopes = []
    for name in np.unique(observed.satellite):
        for number in np.unique(arc[observed.satellite == name]):
            rows = (observed.satellite == name) & (arc == number) & np.isfinite(apart_m)
            time_s = observed.time_s[rows]
            if rows.sum() >= LEAST_EPOCHS and np.ptp(time_s) >= LEAST_EPOCHS:
                slopes.append(float(np.polyfit(time_s - time_s[0], apart_m[rows] - apart_m[rows][0], 1)[0]))
    if len(slopes) < LEAST_COMMON:
        return 0.0
    middle = float(np.median(slopes))
    spread = float(np.median(np.abs(np.array(slopes) - middle))) / math.sqrt(len(slopes))
    return middle if abs(middle) > max(LEAST_DRIFT_M_PER_S, 5.0 * spread) else 0.0


def _arcs(observed: Observations) -> npt.NDArray[np.int64]:
    """(n,) one more wherever the receiver says that it lost whole cycles."""
    arcs, count = np.zeros(len(observed), np.int64), dict[str, int]()
    for row, (name, slip) in enumerate(zip(observed.satellite.tolist(), observed.slip[:, 0].tolist(), strict=True)):
        count[name] = count.get(name, 0) + (slip & 1)
        arcs[row] = count[name]
    return arcs
