"""The detector on real ranges with their truth, and its tolerances on simulated noise."""

from __future__ import annotations

import math
from dataclasses import replace
from unittest import mock

import numpy as np

from benchmarks.detection.measured_ranges import RANGING, RangeLog, labyrinth, plaza, starloc, starloc_sequences
from benchmarks.detection.replays import Replay, geometric_step, plain_fit, pooled, session
from benchmarks.report import Row, Table
from detection import DetectorSettings, RangeEpoch, detect_3d, false_positive_rate
from detection.kernels import misfits, subsets
from detection.motion import tracks
from detection.subset_search import Ranges, Rules

__all__ = ["false_positive_rates", "generality", "real_ranges"]

BAD_M = 0.5
TOLERANCE_M = 0.3  # of the geometric step: three sigma of a UWB range of 0.1 m
# What is bad is asked of the detector; everything else stays at its default.
ASKED = DetectorSettings(harmful_m=BAD_M)
NO_DATA = "The logs are not there; nothing was measured."
PROOF_COLUMNS = ("sequence", "way", "AUC", "caught at 1.7 %", "caught at 2 %", "flagged (caught / false)", "RMS error")


def real_ranges() -> Table:
    """STAR-loc: plain, the geometric step alone, the whole detector."""
    title, rows = "Detector on real UWB ranges (STAR-loc, 8 anchors, bad = off by more than 0.5 m)", []
    for sequence in starloc_sequences():
        logs = starloc(sequence)
        name = sequence.name
        rows.append(_row(name, "least squares of all", pooled([plain_fit(log, BAD_M) for log in logs])))
        alone = pooled([geometric_step(log, TOLERANCE_M, BAD_M) for log in logs])
        met = alone.area >= 0.935 and alone.caught(0.017) >= 0.73 and round(alone.rms_m, 2) <= 0.43
        rows.append(_row(name, "geometric step, side known", alone, "AUC ≥ 0.935, ≥ 73 % at 1.7 %, ≤ 0.43 m", met))
        sideless = pooled([geometric_step(log, TOLERANCE_M, BAD_M, None) for log in logs])
        rows.append(_row(name, "geometric step, side not known", sideless))
        fused = pooled([session(log, ASKED, BAD_M) for log in logs])
        rows.append(_row(name, "detector: ranking", fused, "AUC ≥ 0.988", fused.area >= 0.988))
        met = fused.caught(0.02) >= 0.92 and fused.rms_m <= 0.20
        rows.append(_row(name, "detector: catch and position", fused, "≥ 92 % at 2 %, ≤ 0.20 m", met))
        holds = fused.where_truth_holds()
        met = holds.area >= 0.988 and holds.caught(0.02) >= 0.92
        left_out = int(fused.wrong_truth.sum())
        rows.append(
            _row(name, f"detector, without {left_out} ranges of impossible truth", holds, "AUC ≥ 0.988, ≥ 92 %", met)
        )
    note = (
        "Ranges of each tag in rounds of up to 8. Every answer knows only what came before. Settings are the defaults, "
        "with `harmful_m` = 0.5. Truth is impossible where it speeds up by more than 10 m/s² (docs/detection-proof.md)."
    )
    return Table(title, PROOF_COLUMNS, rows, note if rows else NO_DATA)


def _row(name: str, way: str, replay: Replay, target: str = "", met: bool | None = None) -> Row:
    good = ~replay.bad
    flags = f"{replay.flagged[replay.bad].mean():.1%} / {replay.flagged[good].mean():.2%}"
    ranked = (f"{replay.area:.4f}", f"{replay.caught(0.017):.1%}", f"{replay.caught(0.02):.1%}", flags)
    if way.startswith("least"):
        ranked = ("–",) * 4
    return Row((name, way, *ranked, f"{replay.rms_m:.3f} m"), target, met)


def generality() -> Table:
    """The same detector, fed otherwise, with every number of its model halved and doubled, and on other logs."""
    rows = []
    logs = [log for sequence in starloc_sequences() for log in starloc(sequence)]
    if logs:
        rows += [
            _general("STAR-loc", "as it is", pooled([session(log, ASKED, BAD_M) for log in logs])),
            _general(
                "STAR-loc",
                "times of single ranges not told",
                pooled([session(_untimed(log), ASKED, BAD_M) for log in logs]),
            ),
            _general("STAR-loc", "one range an epoch", pooled([session(_single(log), ASKED, BAD_M) for log in logs])),
        ]
        for settings, what in (
            (replace(ASKED, range_sigma_m=0.05), "sigma of a range halved"),
            (replace(ASKED, range_sigma_m=0.2), "sigma of a range doubled"),
            (replace(ASKED, acceleration_m_per_s2=0.625), "accelerations halved"),
            (replace(ASKED, acceleration_m_per_s2=2.5), "accelerations doubled"),
            (replace(ASKED, excess_m=0.35), "typical excess halved"),
            (replace(ASKED, excess_m=1.4), "typical excess doubled"),
        ):
            rows.append(_general("STAR-loc", what, pooled([session(log, settings, BAD_M) for log in logs])))
        for name in MODEL:
            for factor, word in ((0.5, "halved"), (2.0, "doubled")):
                with mock.patch.object(tracks, name, getattr(tracks, name) * factor):
                    replay = pooled([session(log, ASKED, BAD_M) for log in logs])
                rows.append(_general("STAR-loc", f"`{name}` {word}", replay))
    if RANGING.exists():
        walker = labyrinth()
        settings = DetectorSettings(dimension=2, harmful_m=0.3, max_speed_m_per_s=3.0)
        rows.append(_general("labyrinth", "bad = more than 0.3 m", session(walker, settings, 0.3)))
        mower = plaza()
        # raw ranges of this radio scatter by about 0.5 m, says its maker's resolution and any still stretch
        settings = DetectorSettings(dimension=2, range_sigma_m=0.5, harmful_m=2.0, max_speed_m_per_s=3.0)
        rows.append(_general("plaza 1", "bad = more than 1.5 m", session(mower, settings, 1.5)))
    columns = ("log", "what", "bad ranges", "AUC", "AUC where truth holds", "caught at 2 %", "RMS error")
    return Table("Detector away from its defaults and on other logs", columns, rows, "" if rows else NO_DATA)


# Numbers of the track's model, as tracks.py has them
MODEL = (
    "NOISE", "SHARED", "CLEARED", "CREEP", "CREEP_OF_ITSELF", "BACK_PER_S", "MEAN", "CLIMB_FORGOTTEN_PER_S",
    "ANEW_PER_S", "NEW_SIGMA", "FAR_SHARE", "FAR_SIGMA",
)  # fmt: skip


def _general(log: str, what: str, replay: Replay) -> Row:
    if not replay.bad.any():
        return Row((log, what, "none", "–", "–", "–", f"{replay.rms_m:.3f} m"))
    return Row(
        (
            log, what, f"{int(replay.bad.sum())} of {len(replay.bad)}", f"{replay.area:.4f}",
            f"{replay.where_truth_holds().area:.4f}", f"{replay.caught(0.02):.1%}", f"{replay.rms_m:.3f} m",
        )
    )  # fmt: skip


def _untimed(log: RangeLog) -> RangeLog:
    epochs = tuple(
        replace(epoch, ranges=tuple(replace(one, time_s=None) for one in epoch.ranges)) for epoch in log.epochs
    )
    return replace(log, epochs=epochs)


def _single(log: RangeLog) -> RangeLog:
    """One epoch per range; its place is that of the round, so positions are up to a round away from their truth."""
    epochs, errors_m, places_m, wrong = [], [], [], []
    for epoch, errors, place_m, is_wrong in zip(
        log.epochs, log.errors_m, log.places_m, log.truth_is_wrong, strict=True
    ):
        for one, error_m in zip(epoch.ranges, errors, strict=True):
            epochs.append(RangeEpoch(epoch.time_s if one.time_s is None else one.time_s, (replace(one, time_s=None),)))
            errors_m.append(np.array([error_m]))
            places_m.append(place_m)
            wrong.append(is_wrong)
    return replace(
        log, epochs=tuple(epochs), errors_m=tuple(errors_m), places_m=np.array(places_m), truth_is_wrong=np.array(wrong)
    )


def false_positive_rates(epochs: int = 250_000, searched: int = 4000) -> Table:
    """Clear ranges beyond k sigma on simulated noise, against what k promises."""
    rng = np.random.default_rng(1)
    anchors_m = np.array(
        [(0, 0, 120), (400, 30, 60), (380, 420, 140), (-20, 390, 80), (240, 150, 160), (90, 250, 40), (300, 300, 90),
         (60, 90, 70)], float,
    )  # fmt: skip
    true_m = np.linalg.norm(anchors_m - (150.0, 160.0, 2.0), axis=1)
    sigmas_m, everyone = np.full(8, 0.1), (1 << 8) - 1
    rules = Rules(False, True, True, 4, (math.nan, math.nan, 0.0))
    statistics, excess_m, work = np.empty((epochs, 8)), np.empty(8), (np.empty(8), np.empty(8))
    wide = 100.0  # sigmas of tolerance, so that the whole set is fitted whatever its noise
    for row in statistics:
        ranges = Ranges(anchors_m, true_m + 0.1 * rng.normal(size=8), sigmas_m, wide * sigmas_m, np.zeros(8))
        _, place, *_ = subsets.place_of(ranges, everyone, rules, work)
        misfits.statistics(ranges, everyone, False, place, True, excess_m, row)
    statistics *= wide
    rows = []
    for k, promised in ((2.0, 0.05), (3.0, 0.003), (4.0, 0.00006)):
        count, expected = int((statistics > k).sum()), false_positive_rate(k) * statistics.size
        met = abs(count - expected) <= 4.0 * math.sqrt(expected)
        # one range of an epoch pulls at the others: counts of an epoch are not quite independent, hence 4 sigma
        bounds = f"{expected / statistics.size:.4%} ± {4.0 * math.sqrt(expected) / statistics.size:.4%}"
        flagged = sum(
            int(
                detect_3d(
                    anchors_m, true_m + 0.1 * rng.normal(size=8), 0.1 * k, sigma_m=0.1, studentised=True
                ).off.sum()
            )
            for _ in range(searched)
        )
        cells = (f"{k:g}", f"{promised:.3%}", f"{count / statistics.size:.4%}", f"{flagged / (8 * searched):.3%}")
        rows.append(Row(cells, bounds, met))
    note = (
        f"{statistics.size:,} clear ranges of 8 anchors, each against the place that all fit. Flagged: how many the "
        "search then calls occluded: fewer, since of explanations that fit about equally well it believes none."
    )
    return Table("False positives of the geometric step on noise", ("k", "seed 000", "measured", "flagged"), rows, note)
