"""Broadcast ephemerides: orbits with their disturbances, and clocks, good to metres for two hours around their time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields

import numpy as np
import numpy.typing as npt

from gnss.almanac import check_orbit, satellite_id
from gnss.errors import AlmanacError
from gnss.gps_time import WEEK_S, GpsTime, Instants
from gnss.kepler import (
    EARTH_MU_M3_PER_S2,
    EARTH_RATE_RAD_PER_S,
    eccentric_anomaly_rad,
    ecef_of_orbit_m,
    true_anomaly_rad,
)

__all__ = [
    "EPHEMERIS_USEFUL_S",
    "BroadcastEphemeris",
    "Ephemerides",
    "ephemeris_clocks_s",
    "ephemeris_positions_ecef_m",
]

Array = npt.NDArray[np.float64]

# half of the four hours that the control segment fits a set to
EPHEMERIS_USEFUL_S = 7200.0
# seconds of clock per metre^½ of an eccentric orbit: -2·√μ/c² (IS-GPS-200, 20.3.3.3.3.1)
RELATIVITY_S_PER_SQRT_M = -4.442807633e-10


@dataclass(frozen=True, slots=True)
class BroadcastEphemeris:
    """One set of orbit parameters of one satellite (IS-GPS-200, table 20-III), in radians, metres and seconds.

    toe: time of ephemeris. ``*_cos``, ``*_sin`` fields: amplitudes of the twice-per-orbit corrections.
    health: 0 = healthy; the orbit of an unhealthy one is never used and may be anything. clock_*: what the satellite's
    clock is ahead of GPS time, by a polynomial about toc, the time of clock (None = toe); group_delay_s: T_GD.
    Raises AlmanacError.
    """

    prn: int
    toe: GpsTime
    sqrt_semi_major_axis_sqrt_m: float
    eccentricity: float
    mean_anomaly_rad: float
    mean_motion_difference_rad_per_s: float
    argument_of_perigee_rad: float
    node_longitude_rad: float
    node_rate_rad_per_s: float
    inclination_rad: float
    inclination_rate_rad_per_s: float
    latitude_cos_rad: float
    latitude_sin_rad: float
    radius_cos_m: float
    radius_sin_m: float
    inclination_cos_rad: float
    inclination_sin_rad: float
    health: int = 0
    toc: GpsTime | None = None
    clock_bias_s: float = 0.0
    clock_drift_s_per_s: float = 0.0
    clock_ageing_s_per_s2: float = 0.0
    group_delay_s: float = 0.0

    def __post_init__(self) -> None:
        satellite = satellite_id(self.prn)
        if self.health == 0:
            check_orbit(satellite, {name: getattr(self, name) for name in PARAMETERS + CLOCK})

    @property
    def id(self) -> str:
        """The satellite's name, G and its number."""
        return satellite_id(self.prn)


PARAMETERS, CLOCK = (
    tuple(one.name for one in fields(BroadcastEphemeris) if one.type == "float" and (one.default is MISSING) == orbit)
    for orbit in (True, False)
)


@dataclass(frozen=True, slots=True)
class Ephemerides:
    """The sets of a navigation file; source names it, warnings tell what was passed over. Raises AlmanacError."""

    sets: tuple[BroadcastEphemeris, ...]
    source: str = ""
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.sets:
            raise AlmanacError(f"The navigation file {self.source} has no GPS ephemeris in it.".replace("  ", " "))

    @property
    def healthy_ids(self) -> tuple[str, ...]:
        """Satellites with at least one healthy set, sorted. Raises AlmanacError where there is none."""
        ids = {one.id for one in self.sets if one.health == 0}
        if not ids:
            raise AlmanacError(
                f"All satellites of the navigation file {self.source} are marked unhealthy; none can be used."
            )
        return tuple(sorted(ids))

    @property
    def unhealthy_ids(self) -> tuple[str, ...]:
        """Satellites that are left out, sorted: all their sets are unhealthy."""
        return tuple(sorted({one.id for one in self.sets} - {one.id for one in self.sets if one.health == 0}))


def ephemeris_positions_ecef_m(
    ephemerides: Ephemerides, ids: Sequence[str], times: Instants, max_age_s: float = EPHEMERIS_USEFUL_S
) -> Array:
    """(n_ids, n_times, 3) ECEF, metres, from the set nearest in time (IS-GPS-200, table 20-IV).

    NaN where that set is further than max_age_s away or unhealthy.
    Raises AlmanacError where no set at all is near any of the times.
    """
    positions_ecef_m = np.full((len(ids), times.week.size, 3), np.nan)
    for number, (sets, away_s) in enumerate(_nearest(ephemerides, ids, times, max_age_s)):
        usable = np.flatnonzero(np.isfinite(away_s))
        positions_ecef_m[number, usable] = _positions_ecef_m([sets[i] for i in usable], away_s[usable])
    return positions_ecef_m


def ephemeris_clocks_s(
    ephemerides: Ephemerides, ids: Sequence[str], times: Instants, max_age_s: float = EPHEMERIS_USEFUL_S
) -> Array:
    """(n_ids, n_times) seconds by which satellites' clocks are ahead of GPS time for C/A on L1, from the nearest set.

    With the relativistic part, less the group delay (IS-GPS-200, 20.3.3.3.3.1-2). NaN and errors as for
    ``ephemeris_positions_ecef_m``.
    """
    clocks_s = np.full((len(ids), times.week.size), np.nan)
    for number, (sets, away_s) in enumerate(_nearest(ephemerides, ids, times, max_age_s)):
        usable = np.flatnonzero(np.isfinite(away_s))
        used, elapsed_s = [sets[i] for i in usable], away_s[usable]
        p = _values(used, CLOCK)
        later_s = [(one.toc or one.toe).second_of_week - one.toe.second_of_week for one in used]
        weeks = [(one.toc or one.toe).week - one.toe.week for one in used]
        since_s = elapsed_s - np.array(later_s) - WEEK_S * np.array(weeks)
        drift = p["clock_drift_s_per_s"] + since_s * p["clock_ageing_s_per_s2"]
        stretched = np.array([one.eccentricity * one.sqrt_semi_major_axis_sqrt_m for one in used])
        turned_s = RELATIVITY_S_PER_SQRT_M * stretched * np.sin(_anomalies_rad(used, elapsed_s))
        clocks_s[number, usable] = p["clock_bias_s"] + since_s * drift + turned_s - p["group_delay_s"]
    return clocks_s


def _nearest(
    ephemerides: Ephemerides, ids: Sequence[str], times: Instants, max_age_s: float
) -> list[tuple[list[BroadcastEphemeris], Array]]:
    """For each satellite (sets nearest to n times, (n,) seconds since their time of ephemeris, NaN = of no use)."""
    found, nearest_s = [], math.inf
    for name in ids:
        sets = [one for one in ephemerides.sets if one.id == name]
        elapsed_s = times.since_s(
            np.array([one.toe.week for one in sets], np.int64)[:, None],
            np.array([one.toe.second_of_week for one in sets])[:, None],
        )
        # the last of equals: uploads of one time follow one another in the file
        chosen = len(sets) - 1 - np.argmin(np.abs(elapsed_s[::-1]), axis=0)
        away_s = np.take_along_axis(elapsed_s, chosen[None], axis=0)[0]
        nearest_s = min(nearest_s, float(np.abs(away_s).min()))
        unhealthy = np.array([one.health != 0 for one in sets])[chosen]
        usable = (np.abs(away_s) <= max_age_s) & ~unhealthy
        found.append(([sets[i] for i in chosen], np.where(usable, away_s, np.nan)))
    if not nearest_s <= max_age_s:
        raise AlmanacError(
            f"No ephemeris of {ephemerides.source or 'these'} is within {max_age_s / 3600.0:g} h of a time asked for; "
            f"the nearest is {nearest_s / 3600.0:.1f} h away."
        )
    return found


def _values(sets: Sequence[BroadcastEphemeris], names: Sequence[str]) -> dict[str, Array]:
    """Each (n,), or (1,) where all are of one set."""
    few = sets[:1] if all(one is sets[0] for one in sets) else sets
    return {name: np.array([getattr(one, name) for one in few], np.float64) for name in names}


def _anomalies_rad(sets: Sequence[BroadcastEphemeris], elapsed_s: Array) -> Array:
    """(n,) eccentric anomalies."""
    p = _values(sets, PARAMETERS)
    semi_major_axis_m = p["sqrt_semi_major_axis_sqrt_m"] ** 2
    mean_motion_rad_per_s = np.sqrt(EARTH_MU_M3_PER_S2 / semi_major_axis_m**3) + p["mean_motion_difference_rad_per_s"]
    return eccentric_anomaly_rad(p["mean_anomaly_rad"] + mean_motion_rad_per_s * elapsed_s, p["eccentricity"])


def _positions_ecef_m(sets: Sequence[BroadcastEphemeris], elapsed_s: Array) -> Array:
    """(n, 3) ECEF of one set per instant, elapsed_s after its time of ephemeris."""
    p = _values(sets, PARAMETERS)
    e = p["eccentricity"]
    semi_major_axis_m = p["sqrt_semi_major_axis_sqrt_m"] ** 2
    anomaly_rad = _anomalies_rad(sets, elapsed_s)
    argument_rad = true_anomaly_rad(anomaly_rad, e) + p["argument_of_perigee_rad"]
    cos_twice, sin_twice = np.cos(2.0 * argument_rad), np.sin(2.0 * argument_rad)
    toe_s = np.array([one.toe.second_of_week for one in sets], np.float64)
    return ecef_of_orbit_m(
        semi_major_axis_m * (1.0 - e * np.cos(anomaly_rad))
        + p["radius_cos_m"] * cos_twice
        + p["radius_sin_m"] * sin_twice,
        argument_rad + p["latitude_cos_rad"] * cos_twice + p["latitude_sin_rad"] * sin_twice,
        p["inclination_rad"]
        + p["inclination_rate_rad_per_s"] * elapsed_s
        + p["inclination_cos_rad"] * cos_twice
        + p["inclination_sin_rad"] * sin_twice,
        p["node_longitude_rad"]
        + (p["node_rate_rad_per_s"] - EARTH_RATE_RAD_PER_S) * elapsed_s
        - EARTH_RATE_RAD_PER_S * toe_s,
    )
