"""A drive on a circle under the made-up constellation, as requests have it: readings and RINEX files."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gnss import ecef_to_enu_m
from tests.gnss.differential import world

__all__ = ["ZERO_GPS_S", "drive_by_satellites", "true_enu_m"]

SECONDS, RADIUS_M, STEP_S = 31, 25.0, 0.05
GRAVITY_M_PER_S2 = 9.8064  # of WGS 84 at 47° north, 500 m up
ZERO_GPS_S = world.START.week * 604_800.0 + world.START.second_of_week
TURN_RAD_PER_S = math.pi / (SECONDS - 1)


def true_enu_m(times_s: np.ndarray) -> np.ndarray:
    """(n, 3) of the antenna from the middle of the circle; times_s from the first epoch."""
    turn = TURN_RAD_PER_S * np.asarray(times_s)
    return RADIUS_M * np.stack([np.sin(turn), np.cos(turn), np.zeros_like(turn)], axis=-1)


def drive_by_satellites(zero_s: float = 0.0, **changes: Any) -> dict[str, Any]:
    """Half a circle to the right, level; readings at times from zero_s on. An epoch of RINEX a second."""
    rng = np.random.default_rng(11)
    heard = world.heard(world.circle_m(SECONDS, RADIUS_M), rng, clock_m=30.0)
    assert np.allclose(ecef_to_enu_m(world.PLACE, world.circle_m(SECONDS, RADIUS_M)), true_enu_m(np.arange(SECONDS)))
    times_s = np.arange(0.0, SECONDS - 1.0 + STEP_S / 2.0, STEP_S)
    inwards = RADIUS_M * TURN_RAD_PER_S**2
    return {
        "readings": {
            "times_s": (zero_s + times_s).tolist(),
            "forces": [[0.0, -inwards, GRAVITY_M_PER_S2]] * len(times_s),
            "rates": [[0.0, 0.0, -TURN_RAD_PER_S]] * len(times_s),
        },
        "satellites": {
            "observations": world.observation_text(heard, world.base_m()),
            "orbits": [world.navigation_text()],
        },
        "settings": {"imu": "tactical"},
        **changes,
    }
