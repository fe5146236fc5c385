"""Ten million readings with all that readings may suffer: ``python -m benchmarks.navigation.long_drive [STEPS]``."""

from __future__ import annotations

import sys
import time

import numpy as np

from benchmarks import report
from benchmarks.report import Row, Table
from navigation.inertial import (
    IMU_PRESETS,
    InertialStart,
    TangentFrame,
    imu_log,
    join,
    navigate,
    position_fixes,
    standing_still,
    standstill,
)

__all__ = ["long_drive"]

PIECE, STEP_S = 100_000, 0.05
FRAME, NOISE = TangentFrame(0.6, 0.2, 300.0), IMU_PRESETS["ADIS16405"]


def long_drive(steps: int = 10_000_000) -> Table:
    """A still unit read 20 times a second for days: gaps, saturated axes, fixes that are away or wrong for an hour."""
    rng, began_s = np.random.default_rng(9), time.perf_counter()
    gravity = -FRAME.gravity_m_per_s2()
    start = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0))
    finite, positive, now_s, told = True, True, 0.0, 0
    for piece in range(-(-steps // PIECE)):
        steps_s = np.full(PIECE, STEP_S)
        steps_s[rng.integers(1, PIECE, 20)] = rng.exponential(5.0, 20) + STEP_S
        steps_s[0] = 0.0
        times_s = now_s + np.cumsum(steps_s)
        forces = gravity + rng.normal(0.0, 0.02, (PIECE, 3)) + 0.05
        rates = rng.normal(0.0, 0.003, (PIECE, 3)) + 0.01
        forces[rng.integers(0, PIECE, 10)] = NOISE.force_range_m_per_s2
        log = imu_log(times_s, forces, rates, noise=NOISE)
        at_s = np.arange(times_s[0] + 1.0, times_s[-1], 10.0)
        wrong_m = 500.0 if piece % 4 == 2 else 0.0
        fixes = position_fixes(at_s, rng.normal(0.0, 3.0, (len(at_s), 3)) + wrong_m, 3.0, gate_sigma=5.0)
        still = standing_still(log)[np.searchsorted(log.times_s, at_s)]
        helped = join() if piece % 4 == 1 else join(fixes, standstill(at_s[still]))
        track = navigate(log, start, helped, NOISE, FRAME)
        finite &= bool(np.isfinite(track.position_m).all() and np.isfinite(track.sigmas).all())
        positive &= bool(np.linalg.eigvalsh(track.covariance)[0] > -1e-9 * np.trace(track.covariance))
        told += len(log.warnings)
        if not finite or not positive:
            break
        start, now_s = track.end(), float(times_s[-1])
    rate = steps / (time.perf_counter() - began_s)
    rows = (
        Row((f"{steps:,} readings, places and sigmas", "finite" if finite else "not finite"), "finite", finite),
        Row(("covariances", "positive" if positive else "not positive"), "positive", positive),
        Row(("sentences about gaps and saturated axes", f"{told}")),
        Row(("readings a second, making them up included", f"{rate:,.0f}")),
    )
    note = f"{now_s / 86400.0:.1f} days; for an hour and a half in six nothing helps, for as long fixes are 500 m off."
    return Table("Readings without end", ("what", "found"), rows, note)


if __name__ == "__main__":
    print(report.as_text(long_drive(int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000)))
