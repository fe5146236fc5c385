"""Where an almanac says that its satellites are: De Vivo et al., table II (IS-GPS-200, 20.3.3.5.2.1)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from gnss.almanac import AlmanacEntry
from gnss.errors import AlmanacError
from gnss.gps_time import Instants
from gnss.kepler import (
    EARTH_MU_M3_PER_S2,
    EARTH_RATE_RAD_PER_S,
    eccentric_anomaly_rad,
    ecef_of_orbit_m,
    true_anomaly_rad,
)

__all__ = ["ALMANAC_USEFUL_S", "almanac_positions_ecef_m"]

Array = npt.NDArray[np.float64]

# beyond four weeks manoeuvres and drift are no longer a few kilometres
ALMANAC_USEFUL_S = 28 * 86_400.0


def almanac_positions_ecef_m(
    entries: Sequence[AlmanacEntry], times: Instants, max_age_s: float = ALMANAC_USEFUL_S
) -> Array:
    """(n_satellites, n_times, 3) ECEF, metres, of each entry at each instant, healthy or not.

    max_age_s: how far from its time of applicability an entry may be used; inf = any.
    Raises AlmanacError for an almanac of another time.
    """
    week = np.array([entry.applicable.week for entry in entries], np.int64)[:, None]
    second_of_week = _column(entry.applicable.second_of_week for entry in entries)
    elapsed_s = times.since_s(week, second_of_week)
    _check_age(entries, elapsed_s, max_age_s)

    e = _column(entry.eccentricity for entry in entries)
    semi_major_axis_m = _column(entry.semi_major_axis_m for entry in entries)
    mean_motion_rad_per_s = np.sqrt(EARTH_MU_M3_PER_S2 / semi_major_axis_m**3)
    mean_anomaly_rad = _column(entry.mean_anomaly_rad for entry in entries) + mean_motion_rad_per_s * elapsed_s
    anomaly_rad = eccentric_anomaly_rad(mean_anomaly_rad, e)
    argument_rad = true_anomaly_rad(anomaly_rad, e) + _column(entry.argument_of_perigee_rad for entry in entries)
    node_rad = (
        _column(entry.node_longitude_rad for entry in entries)
        + (_column(entry.node_rate_rad_per_s for entry in entries) - EARTH_RATE_RAD_PER_S) * elapsed_s
        - EARTH_RATE_RAD_PER_S * second_of_week
    )
    return ecef_of_orbit_m(
        semi_major_axis_m * (1.0 - e * np.cos(anomaly_rad)),
        argument_rad,
        _column(entry.inclination_rad for entry in entries),
        node_rad,
    )


def _check_age(entries: Sequence[AlmanacEntry], elapsed_s: Array, max_age_s: float) -> None:
    worst = np.unravel_index(int(np.argmax(np.abs(elapsed_s))), elapsed_s.shape)
    oldest_s = float(elapsed_s[worst])
    if math.isnan(max_age_s) or abs(oldest_s) > max_age_s:
        entry = entries[int(worst[0])]
        raise AlmanacError(
            f"The almanac is of GPS week {entry.applicable.week} ({entry.applicable.utc():%Y-%m-%d}), "
            f"{abs(oldest_s) / 86_400.0:.0f} days {'before' if oldest_s > 0.0 else 'after'} the time asked for (limit "
            f"{max_age_s / 86_400.0:g} days); take one of that time, or check the reference date of its week."
        )


def _column(values: Iterable[float]) -> Array:
    column: Array = np.array(list(values), np.float64)[:, None]
    return column
