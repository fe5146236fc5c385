"""What a replica should follow: delays of a satellite's signal foretold from ephemerides and a trajectory."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gnss.broadcast_ephemeris import Ephemerides, ephemeris_clocks_s, ephemeris_positions_ecef_m
from gnss.errors import GnssInputError
from gnss.gps_time import WEEK_S, GpsTime, Instants
from gnss.kepler import EARTH_RATE_RAD_PER_S

from .codes import SPEED_OF_LIGHT_M_PER_S

__all__ = ["foretold_delays_s"]

Array = npt.NDArray[np.float64]
FLIGHT_S = 0.075  # from about there on, three rounds leave less than a femtosecond
ROUNDS = 3


def foretold_delays_s(
    ephemerides: Ephemerides,
    satellite: str,
    start: GpsTime,
    times_s: npt.ArrayLike,
    antennas_ecef_m: npt.ArrayLike,
    *,
    clock_s: npt.ArrayLike = 0.0,
) -> Array:
    """(k,) delays for ``measure_channel``: flight over the Earth that turns meanwhile, and both clocks.

    start: of sample 0 by the receiver's clock. times_s: (k,) from there on. antennas_ecef_m: (k, 3) or (3,), the
    trajectory with its lever arm turned and added. clock_s: (k,) or one, by how much the receiver's clock is ahead of
    GPS; the satellite's is that of the ephemerides. Air is left out: it delays by tens of metres at most, a tenth of a
    chip. Raises GnssInputError, and AlmanacError where no ephemeris is near.
    """
    times = np.atleast_1d(np.asarray(times_s, np.float64))
    antennas = np.asarray(antennas_ecef_m, np.float64)
    if times.ndim != 1 or antennas.shape not in ((3,), (len(times), 3)):
        raise GnssInputError(f"Each of {times.size} times needs an antenna's place, not shape {antennas.shape}.")
    if not np.isfinite(antennas).all():
        raise GnssInputError("The antenna's places must be finite.")
    clock = np.broadcast_to(np.asarray(clock_s, np.float64), times.shape)
    flight = np.full(len(times), FLIGHT_S)
    for _ in range(ROUNDS):
        weeks, seconds = np.divmod(start.second_of_week + times - clock - flight, WEEK_S)
        sent = Instants(start.week + weeks.astype(np.int64), seconds)
        places = ephemeris_positions_ecef_m(ephemerides, [satellite], sent)[0]
        if not np.isfinite(places).all():
            raise GnssInputError(f"{satellite} is unhealthy, or its ephemerides are not near all of the times.")
        turned = EARTH_RATE_RAD_PER_S * flight
        east = places[:, 0] * np.cos(turned) + places[:, 1] * np.sin(turned)
        north = places[:, 1] * np.cos(turned) - places[:, 0] * np.sin(turned)
        away = np.column_stack([east, north, places[:, 2]]) - antennas
        flight = np.linalg.norm(away, axis=1) / SPEED_OF_LIGHT_M_PER_S
    delays: Array = flight + clock - ephemeris_clocks_s(ephemerides, [satellite], sent)[0]
    return delays
