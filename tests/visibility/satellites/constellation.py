"""Satellites that the tests share: made-up ones, and the files of the shared data."""

import math
from pathlib import Path

import pytest

from gnss import Almanac, AlmanacEntry, GpsTime

FILES = Path(__file__).parents[3] / "../shared/data/almanac"

# 12 h of a sidereal day, as GPS flies it
GPS_SQRT_A = 5153.7
NOON = GpsTime(1877, 388_800.0)  # 2015-12-31 12:00:00 GPS


def shared_file(name):
    """A file of the shared data; the test is skipped where that folder is absent."""
    path = FILES / name
    if not path.exists():
        pytest.skip(f"{name} of the shared data is not here")
    return path


def satellite(prn=1, **fields):
    """A GPS-like satellite of the reference week."""
    usual = {
        "applicable": GpsTime(1877, 503_808.0),
        "eccentricity": 0.005,
        "inclination_rad": math.radians(55.0),
        "node_rate_rad_per_s": -8e-9,
        "sqrt_semi_major_axis_sqrt_m": GPS_SQRT_A,
        "node_longitude_rad": 0.4,
        "argument_of_perigee_rad": 0.5,
        "mean_anomaly_rad": 0.9,
    }
    return AlmanacEntry(prn=prn, **{**usual, **fields})


def walker(unhealthy=(), **fields):
    """24 satellites, six planes of four, evenly spread."""
    return Almanac(
        tuple(
            satellite(
                prn=1 + 4 * plane + slot,
                node_longitude_rad=plane * math.pi / 3.0,
                mean_anomaly_rad=slot * math.pi / 2.0 + plane * math.pi / 12.0,
                health=63 if 1 + 4 * plane + slot in unhealthy else 0,
                **fields,
            )
            for plane in range(6)
            for slot in range(4)
        ),
        "walker",
    )
