"""Inertial navigation: NaveGo's made-up drive, outages with a stated unit, and speed."""

from __future__ import annotations

import numpy as np

from benchmarks.navigation.inertial_sets import SYNTHETIC, InertialCase, navego_synthetic, outage_drive
from benchmarks.report import Row, Table
from benchmarks.timing import best_of_s
from navigation.inertial import IMU_PRESETS, join, navigate, ranges_to_anchors

__all__ = ["inertial_speed", "made_up_drive", "outages"]

# python-ins 1.0.1 on the same files: north, east, down in metres, heading in degrees, seconds of computing
PEER = (0.229, 0.360, 0.511, 0.403, 333.0)


def made_up_drive() -> Table:
    """NaveGo's synthetic ADIS16405 against python-ins' figures, after its first minute."""
    if not SYNTHETIC.is_dir():
        return Table("NaveGo's made-up drive", ("what",), (Row(("the data are not here",)),))
    case = navego_synthetic()
    seconds = best_of_s(lambda: navigate(case.log, case.start, case.measurements, case.noise, case.frame), rounds=3)
    track = navigate(case.log, case.start, case.measurements, case.noise, case.frame, smoother=True)
    late = track.times_s > 60.0
    errors_m = (track.position_m - case.position_m)[late]
    heading_rad = _between(track.angles_rad[late, 0], case.heading_rad[late])
    found = [*_rms(errors_m)[[1, 0, 2]], np.degrees(float(_rms(heading_rad)))]
    smooth = track.smoothed
    rows = []
    smoothed = (
        _rms((smooth.position_m - case.position_m[smooth.reading])[smooth.times_s > 60.0]) if smooth else np.zeros(3)
    )
    for name, ours, peer, after in zip(
        ("north", "east", "down"), found[:3], PEER[:3], smoothed[[1, 0, 2]], strict=True
    ):
        cells = (f"{name}, rms", f"{ours:.3f} m", f"{peer:.3f} m", f"{after:.3f} m")
        rows.append(Row(cells, "≤ 1.1 × python-ins", bool(ours <= 1.1 * peer)))
    cells = ("heading, rms", f"{found[3]:.3f}°", f"{PEER[3]:.3f}°", "")
    rows.append(Row(cells, "≤ 1.1 × python-ins", bool(found[3] <= 1.1 * PEER[3])))
    cells = ("437 s at 200 Hz", f"{seconds:.2f} s", f"{PEER[4]:.0f} s", "")
    rows.append(Row(cells, "≤ 1 s", seconds <= 1.0))
    note = (
        "ADIS16405 with turn-on biases of 3 °/s and 50 mg, fixes of 5, 5, 10 m and 0.05 m/s at 5 Hz, loosely coupled."
    )
    return Table("NaveGo's made-up drive", ("what", "filter", "python-ins 1.0.1", "our smoother"), rows, note)


def outages(drives: int = 20) -> Table:
    """Sixty seconds without fixes, KF-GINS' unit: what the errors are at their ends."""
    positions, headings = [], []
    for seed in range(drives):
        case = outage_drive(seed, IMU_PRESETS["Leador-A15"])
        ends = _ends_of_outages(case)
        track = navigate(case.log, case.start, case.measurements, case.noise, case.frame)
        positions.append((track.position_m - case.position_m)[ends])
        headings.append(_between(track.angles_rad[ends, 0], case.heading_rad[ends]))
    east, north, up = _rms(np.concatenate(positions))
    flat, turned = float(np.hypot(east, north)), float(np.degrees(_rms(np.concatenate(headings))))
    rows = (
        Row(("horizontal, rms", f"{flat:.3f} m"), "≤ 0.65 m", flat <= 0.65),
        Row(("height, rms", f"{up:.3f} m"), "≤ 0.60 m", bool(up <= 0.60)),
        Row(("heading, rms", f"{turned:.4f}°"), "≤ 0.020°", turned <= 0.020),
    )
    note = (
        f"{sum(map(len, positions))} outages of 60 s in {drives} made-up drives of 10 minutes at 10 m/s; "
        "the unit of KF-GINS' own data (0.003 °/√h, 0.03 m/s/√h, 0.027 °/h, 15 mGal, 300 ppm), fixes of 2 cm at 1 Hz. "
        "Targets are its paper's table 2."
    )
    return Table("Sixty seconds without fixes", ("at the end", "error"), rows, note)


def inertial_speed(seconds: float = 120.0) -> Table:
    """How much faster than time a log is navigated, 24 states and 12 ranges ten times a second."""
    rng = np.random.default_rng(0)
    case = outage_drive(3, IMU_PRESETS["Leador-A15"], seconds)
    at = np.repeat(np.arange(1.0, seconds - 1.0, 0.1), 12)
    places = np.stack([np.interp(at, case.log.times_s, case.position_m[:, axis]) for axis in range(3)], axis=1)
    anchors_m = np.tile(rng.uniform(-900.0, 900.0, (12, 3)), (len(at) // 12, 1))
    measured = join(ranges_to_anchors(at, anchors_m, np.linalg.norm(places - anchors_m, axis=1), 0.3))
    taken_s = best_of_s(lambda: navigate(case.log, case.start, measured, case.noise, case.frame), rounds=3)
    ratio = seconds / taken_s
    row = Row(
        (f"{seconds:.0f} s at 200 Hz, 21 states, 12 ranges at 10 Hz", f"{ratio:,.0f} × real time"),
        "≥ 100 ×",
        ratio >= 100,
    )
    return Table("Speed of inertial navigation", ("what", "one core"), (row,))


def _ends_of_outages(case: InertialCase) -> list[int]:
    """Readings just before the first fix after 60 s without one."""
    measured = case.measurements
    times = np.unique(measured.times_s[~np.isnan(measured.values)])
    back = np.flatnonzero(np.diff(times) > 59.0) + 1
    return [int(np.searchsorted(case.log.times_s, times[i])) - 1 for i in back]


def _between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.asarray((first - second + np.pi) % (2.0 * np.pi) - np.pi)


def _rms(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))
