"""A recording of a receiver that drives a half circle under the made-up constellation, with a clock that drifts."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from tests.gnss.differential import world
from tests.reference import gps_signals

RATE_HZ = 2.1e6
OFFSET_S, DRIFT = 123.4e-6, 2.1e-7
HALF_TURN_S = 10.0


def antenna_m(times_s):
    """(k, 3) ECEF: 25 m about the world's place, a half turn in ten seconds."""
    turn = np.pi * np.asarray(times_s) / HALF_TURN_S
    enu = np.stack([25.0 * np.sin(turn), 25.0 * np.cos(turn), np.zeros(len(turn))], axis=1)
    return world.enu_to_ecef_m(world.PLACE, enu)


def true_delays(name, times_s):
    """From satellite to samples by the definition: flight, and the receiver's clock; the satellites' are right."""
    known = np.linspace(times_s[0] - 0.01, times_s[-1] + 0.01, max(8, int(20 * (times_s[-1] - times_s[0])) + 8))
    ahead = OFFSET_S + DRIFT * known
    flights = []
    for second, place_m, clock_s in zip(known, antenna_m(known), ahead, strict=True):
        flights.append(world.sent_from(name, world.START.plus(float(second - clock_s)), place_m)[1] / world.LIGHT)
    relative = np.array([gps_relativity(name, second) for second in known])
    return CubicSpline(known, flights + ahead - relative)(times_s)


def gps_relativity(name, second):
    """IS-GPS-200, 20.3.3.3.3.1: -4.442807633e-10 e sqrt(A) sin E, E by iteration."""
    one = next(one for one in world.ORBITS.sets if one.id == name)
    a = one.sqrt_semi_major_axis_sqrt_m**2
    mean = one.mean_anomaly_rad + np.sqrt(3.986005e14 / a**3) * (second - 0.075)
    anomaly = mean
    for _ in range(20):
        anomaly = mean + one.eccentricity * np.sin(anomaly)
    return -4.442807633e-10 * one.eccentricity * one.sqrt_semi_major_axis_sqrt_m * np.sin(anomaly)


def recorded(strengths, duration_s, seed=1):
    """(complex samples over noise of unit power, bits by satellite): strengths by name, dB-Hz."""
    rng, t = np.random.default_rng(seed), np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    values, bits = gps_signals.noise(rng, len(t)), {}
    for name, cn0_db_hz in strengths.items():
        bits[name] = rng.choice([-1, 1], 101)
        delays_s = true_delays(name, t)
        values += gps_signals.signal(int(name[1:]), delays_s, RATE_HZ, cn0_db_hz, bits[name], rng.uniform(0.0, 6.0))
    return values, bits
