"""The quality monitor: its rates of alarms, faults found and named, and its speed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table
from benchmarks.timing import best_of_each_s
from gnss.differential import read_observations, read_orbits, sent_by
from navigation.monitor import EpochVerdict, Use, judge_epochs, phase_differences, phase_rows, predict_protection

__all__ = ["monitor_speed", "real_phases", "steps_found"]

Array = npt.NDArray[np.float64]
SEED = 21
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
L1_M = 299_792_458.0 / 1575.42e6
LEAST_HEARD = 5  # one more than unknowns, so that one can be named
SATELLITES = 12
SIGMA_M = 0.002 * math.sqrt(2.0)  # of a difference of two phases of 2 mm


def steps_found(epochs: int = 40_000) -> Table:
    """Alarms of right phase differences, and steps of one satellite found and named."""
    rng = np.random.default_rng(SEED)
    rows = _skies(rng, epochs, SATELLITES)
    measured = np.einsum("emn,en->em", rows, rng.normal(0.0, 5.0, (epochs, 4)))
    measured += rng.normal(0.0, SIGMA_M, measured.shape)
    table = []
    for rate in (1e-2, 1e-3):
        alarms = judge_epochs(rows, measured, SIGMA_M, false_alarm=rate, most_excluded=0).alarm
        off = abs(alarms.mean() - rate) / math.sqrt(rate * (1.0 - rate) / epochs)
        cells = (f"no fault, chi-square at {rate:g}", f"{alarms.mean():.5f} alarmed", "")
        table.append(Row(cells, "within 3 sigma of the rate", bool(off <= 3.0)))
    elements = judge_epochs(rows, measured, SIGMA_M, elements_sigma=3.0, most_excluded=0).alarm
    rate = 1.0 - math.erf(3.0 / math.sqrt(2.0)) ** (SATELLITES - 4)
    off = abs(elements.mean() - rate) / math.sqrt(rate * (1.0 - rate) / epochs)
    cells = ("no fault, 3 sigma of each element as printed", f"{elements.mean():.5f} alarmed", "")
    table.append(Row(cells, f"within 3 sigma of {rate:.5f}", bool(off <= 3.0)))
    which = rng.integers(0, SATELLITES, epochs)
    for what, step_m, found_at_least, named_at_least in (
        ("30 mm", 0.03, 0.99, 0.98),
        ("half a cycle", 0.095, 1.0, 0.98),
    ):
        wrong = measured.copy()
        wrong[np.arange(epochs), which] += step_m
        told = judge_epochs(rows, wrong, SIGMA_M)
        named = (told.use[np.arange(epochs), which] == Use.EXCLUDED) & (told.verdict != EpochVerdict.UNEXPLAINED)
        found, right = float(told.alarm.mean()), float(named.mean())
        cells = (f"step of {what}", f"{found:.4f} found", f"{right:.4f} named")
        met = found >= found_at_least and right >= named_at_least
        table.append(Row(cells, f"≥ {found_at_least:g} found, ≥ {named_at_least:g} named", met))
    note = (
        f"{epochs:,} made-up epochs of {SATELLITES} satellites with a clock, phases with 2 mm of noise, skies in which "
        "no satellite loses more than 70 % of its error into the position."
    )
    return Table("Parity of phase differences", ("what", "alarms", "satellite"), table, note)


def real_phases() -> Table:
    """Carrier phases of a still receiver over a real sky: alarms, and steps put on each satellite in turn."""
    folder = DATA / "rtk" / "simulated"
    title = "Parity of a still receiver's phases (gps-sdr-sim, 1 Hz)"
    if not folder.is_dir():
        return Table(title, ("what",), (Row(("the data are not here",)),))
    observed, orbits = read_observations(folder / "base.obs"), read_orbits(folder / "base.nav")
    place_m = np.loadtxt(folder / "base.csv", delimiter=",", max_rows=1)[1:]
    sent = sent_by(observed, orbits, place_m)
    names, column = np.unique(observed.satellite, return_inverse=True)
    epochs = int(observed.epoch[-1]) + 1
    phases_m, slipped = np.full((epochs, len(names)), np.nan), np.zeros((epochs, len(names)), np.bool_)
    satellites_m = np.broadcast_to(place_m + 2e7, (epochs, len(names), 3)).copy()
    phases_m[observed.epoch, column] = observed.phase_cycles[:, 0] * L1_M + sent.clock_m
    slipped[observed.epoch, column] = observed.slip[:, 0] & 1 == 1
    satellites_m[observed.epoch, column] = sent.position_ecef_m
    changes_m, units = phase_differences(phases_m, satellites_m, place_m)
    heard = np.isfinite(changes_m) & ~slipped[1:]
    rows, right = phase_rows(units), np.where(heard, changes_m, 0.0)
    sigmas_m = np.where(heard, SIGMA_M, np.inf)
    alarms = judge_epochs(rows, right, sigmas_m, false_alarm=1e-3).alarm
    cells = ("no step, chi-square at 0.001", f"{int(alarms.sum())} of {len(alarms)} alarmed", "")
    # four sigmas of a binomial count; the set is short
    table = [Row(cells, "≤ 2 of 281", bool(alarms.sum() <= 2))]
    for what, step_m in (("30 mm", 0.03), ("half a cycle", 0.095)):
        told = []
        for number in range(len(names)):
            stepped = right.copy()
            stepped[:, number] += step_m
            found = judge_epochs(rows, stepped, sigmas_m)
            of = heard[:, number] & (heard.sum(axis=1) > LEAST_HEARD)
            told.append(np.stack([found.alarm[of], found.use[of, number] == Use.EXCLUDED]))
        alarmed, named = np.concatenate(told, axis=1).mean(axis=1)
        cells = (f"step of {what}", f"{alarmed:.4f} found", f"{named:.4f} named")
        table.append(Row(cells, "≥ 0.99 found, ≥ 0.98 named", bool(alarmed >= 0.99 and named >= 0.98)))
    note = (
        "2 mm of noise are stated for each phase, nothing is fitted; satellites and clocks come from broadcast orbits."
    )
    return Table(title, ("what", "alarms", "satellite"), table, note)


def monitor_speed(epochs: int = 200_000) -> Table:
    """Epochs a second, and points of a protection level a second."""
    rng = np.random.default_rng(SEED)
    rows = rng.normal(size=(epochs, 12, 4))
    measured = rng.normal(size=(epochs, 12))
    anchors_m = rng.uniform(-1000.0, 1000.0, (8, 3))
    points_m = rng.uniform(-500.0, 500.0, (2000, 3))
    best_s = best_of_each_s(
        {
            "parity": lambda: judge_epochs(rows, measured, 1.0),
            "protection": lambda: predict_protection(points_m, anchors_m, 0.95, 0.5),
        },
        rounds=5,
    )
    rate, points = epochs / best_s["parity"], len(points_m) / best_s["protection"]
    table = (
        Row(("parity of 12 measurements, 4 unknowns", f"{rate:,.0f} epochs/s"), "≥ 100 000 epochs/s", rate >= 1e5),
        Row(("protection levels, 8 anchors, up to 3 faults", f"{points:,.0f} points/s")),
    )
    note = "Through the Python functions, checks of their arguments included."
    return Table("Speed of the quality monitor", ("what", "measured"), table, note)


def _skies(rng: np.random.Generator, epochs: int, count: int) -> Array:
    """(epochs, count, 4) rows of satellites above 10 degrees, where each can be tested by the others."""
    kept: list[Array] = []
    while sum(map(len, kept)) < epochs:
        up = rng.uniform(np.sin(np.radians(10.0)), 1.0, (epochs, count))
        azimuth = rng.uniform(0.0, 2.0 * np.pi, (epochs, count))
        flat = np.sqrt(1.0 - up**2)
        rows = np.stack([-flat * np.sin(azimuth), -flat * np.cos(azimuth), -up, np.ones_like(up)], axis=2)
        left = 1.0 - np.einsum("emn,enm->em", rows, np.linalg.pinv(rows))
        kept.append(rows[left.min(axis=1) > 0.3])
    return np.concatenate(kept)[:epochs]
