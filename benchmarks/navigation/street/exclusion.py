"""Which pseudoranges come round corners: our exclusions beside gnss_lib_py's and RTKLIB's way, on the same rows."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.navigation.street.log import SMARTLOC, StreetLog, street_log, turned_while_sent
from benchmarks.report import Row, Table
from navigation.monitor import Use, judge_epochs
from navigation.monitor.chi_square import chi_square_limits
from navigation.pseudoranges import StreetStart, follow_street

__all__ = ["exclusion"]

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
WRONG_M, REFERENCE_ELEVATION = 15.0, 50.0
THRESHOLDS = (30.0, 100.0, 300.0, 1000.0, 3000.0)  # the last is the library's own
RATES = (1e-3, 1e-6, 1e-12)
UNKNOWNS, ROUNDS = 4, 8
PEER_S = 200.0


def exclusion(every: int = 5) -> Table:
    """Recall of wrong ranges at the precision that each peer has, on every fifth epoch of smartLoc."""
    title = "Exclusion on identical rows: smartLoc"
    columns = ("exclusion", "precision", "recall", "recall of an excess for each satellite")
    if not SMARTLOC.is_dir():
        return Table(title, columns, (Row(("the data are not here", "", "", "")),))
    log = street_log()
    wrong = _wrong(log)
    track = follow_street(log.ranges, log.wheels, StreetStart((0.0, 0.0, 0.0), log.heading_rad), log.frame)
    epochs, epoch = np.unique(log.ranges.times_s, return_inverse=True)
    taken = epoch % every == 0
    rows_m = log.frame.from_centred_m(turned_while_sent(log)), log.ranges.measured_m, log.ranges.sigmas_m
    told: list[tuple[str, Flags, bool]] = []
    excluded = _rtklib_style(epoch, taken, *rows_m)
    told.append(("RTKLIB's way: one at most", excluded, True))
    peer, reason = _gnss_lib_py(epoch[taken], log.ranges.measured_m[taken], turned_while_sent(log)[taken])
    for threshold, one in zip(THRESHOLDS, peer, strict=False):
        excluded = np.zeros(len(wrong), bool)
        excluded[taken] = one
        told.append((f"gnss_lib_py, residuals, threshold {threshold:g}", excluded, True))
    for rate in RATES:
        told.append((f"our parity, up to 6, false alarms at {rate:g}", _parity(epoch, taken, rate, *rows_m), False))
    rows = []
    for what, excluded, is_peer in told:
        precision, recall = _scores(excluded[taken], wrong[taken])
        ours = _recall_at(precision, track.hidden[taken], wrong[taken])
        cells = (what, f"{precision:.2f}", f"{recall:.3f}", f"{ours:.3f}")
        rows.append(
            Row(cells, "a better recall at equal precision" if is_peer else "", ours > recall if is_peer else None)
        )
    if reason:
        rows.append(Row((reason, "", "", "")))
    note = (
        f"{len(epochs[::every])} epochs, {int(taken.sum())} pseudoranges, {100.0 * wrong[taken].mean():.0f} % of them "
        f"wrong by more than {WRONG_M:.0f} m against the true place and the clock that satellites above "
        f"{REFERENCE_ELEVATION:.0f}° tell. The others look at one epoch; the excess for each satellite at all before "
        "it, and at the wheels."
    )
    return Table(title, columns, tuple(rows), note)


def _wrong(log: StreetLog) -> Flags:
    """(m,) whether each range is wrong."""
    places_m = log.frame.from_centred_m(turned_while_sent(log))
    epoch = np.unique(log.ranges.times_s, return_inverse=True)[1]
    away_m = places_m - log.place_m[epoch]
    length_m = np.linalg.norm(away_m, axis=1)
    off_m = log.ranges.measured_m - length_m
    high = np.degrees(np.arcsin(away_m[:, 2] / length_m)) > REFERENCE_ELEVATION
    clock_m = np.array([np.median(off_m[high & (epoch == one)]) for one in range(epoch.max() + 1)])
    wrong: Flags = np.abs(off_m - clock_m[epoch]) > WRONG_M
    return wrong


def _solved(places_m: Array, measured_m: Array, sigmas_m: Array) -> Array:
    """(m,) residuals of a fix in sigmas."""
    state = np.array([0.0, 0.0, 0.0, float(np.median(measured_m - np.linalg.norm(places_m, axis=1)))])
    residual = measured_m
    for _ in range(ROUNDS):
        away = state[:3] - places_m
        length = np.linalg.norm(away, axis=1)
        rows = np.column_stack([away / length[:, None], np.ones(len(away))])
        residual = measured_m - length - state[3]
        state = state + np.linalg.lstsq(rows / sigmas_m[:, None], residual / sigmas_m, rcond=None)[0]
    residuals: Array = residual / sigmas_m
    return residuals


def _rtklib_style(epoch: npt.NDArray[np.int64], taken: Flags, places: Array, measured: Array, sigmas: Array) -> Flags:
    """RTKLIB's raim_fde: where the chi-square test of 0.1 % fails, the one whose absence leaves the least residuals."""
    limits = chi_square_limits(1e-3, 64)
    excluded = np.zeros(len(epoch), bool)
    for number in np.unique(epoch[taken]):
        mine = np.flatnonzero(epoch == number)
        if len(mine) < UNKNOWNS + 2:
            continue
        whole = _solved(places[mine], measured[mine], sigmas[mine])
        if whole @ whole <= limits[len(mine) - UNKNOWNS]:
            continue
        left = [np.delete(mine, one) for one in range(len(mine))]
        sums = [float(np.sum(_solved(places[rest], measured[rest], sigmas[rest]) ** 2)) for rest in left]
        excluded[mine[int(np.argmin(sums))]] = True
    return excluded


def _parity(
    epoch: npt.NDArray[np.int64], taken: Flags, rate: float, places: Array, measured: Array, sigmas: Array
) -> Flags:
    """Our monitor's exclusions about a robust place, the sets of up to six."""
    excluded = np.zeros(len(epoch), bool)
    for number in np.unique(epoch[taken]):
        mine = np.flatnonzero(epoch == number)
        length = np.linalg.norm(places[mine], axis=1)
        rows = np.column_stack([-places[mine] / length[:, None], np.ones(len(mine))])
        told = judge_epochs(
            rows[None], (measured[mine] - length)[None], sigmas[mine], false_alarm=rate, most_excluded=6
        )
        excluded[mine] = told.use[0] == Use.EXCLUDED
    return excluded


def _gnss_lib_py(epoch: npt.NDArray[np.int64], measured: Array, places: Array) -> tuple[list[Flags], str]:
    """(exclusions at each threshold, why there are none)."""
    python = os.environ.get("GNSS_LIB_PY_PYTHON", sys.executable)
    script = Path(__file__).with_name("peer_exclusion.py")
    with tempfile.TemporaryDirectory() as folder:
        rows, found = Path(folder) / "rows.npz", Path(folder) / "found.npz"
        np.savez(rows, epoch=epoch, measured_m=measured, places_m=places, thresholds=np.array(THRESHOLDS))
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        command = [python, str(script), str(rows), str(found)]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=PEER_S, env=environment, check=False)
        if ran.returncode:
            last = (ran.stderr.strip().splitlines() or ["it ended without a word"])[-1]
            return [], f"gnss_lib_py did not run (GNSS_LIB_PY_PYTHON names a Python that has it): {last}"
        return list(np.load(found)["excluded"]), ""


def _scores(excluded: Flags, wrong: Flags) -> tuple[float, float]:
    right = float((excluded & wrong).sum())
    return right / max(float(excluded.sum()), 1.0), right / max(float(wrong.sum()), 1.0)


def _recall_at(precision: float, hidden: Array, wrong: Flags) -> float:
    """The most recall of the most likely hidden at that precision or better."""
    order = np.argsort(-hidden, kind="stable")
    right = np.cumsum(wrong[order])
    enough = right / np.arange(1, len(order) + 1) >= precision
    return float(right[enough].max(initial=0)) / max(float(wrong.sum()), 1.0)
