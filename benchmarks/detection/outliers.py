"""Sessions among ranges that are off by anything: 3 m to 1000 km, too long and too short, passing and lasting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from benchmarks.detection.occlusion_scenarios import ring
from benchmarks.report import Row, Table
from detection import Detector, DetectorSettings, PlanningStatus, RangeEpoch, RangeMeasurement, detect_epoch
from detection.simulation import RangingNoise, SimulatedDrive, draw_epochs, drive_along

__all__ = ["KINDS", "Followed", "follow_drives", "outliers"]

Floats = npt.NDArray[np.float64]

SIGMA_M = 0.05
NEAR_M = 0.3  # so near to its epoch's own consensus a session stays
LEAST_M, MOST_M = 3.0, 1e6
WRAPS_M = (655.35, 65535.0)  # 0xFFFF of centimetres, of metres
SPEED_M_PER_S = 1.5
EPOCHS_A_DRIVE = 250
SEED = 2026  # seeds 5 to 8, 98 and 99 chose what detection/motion/tracks.py and tracking.py hold; this one is new
MAY_LEAVE, CONFIRMED = 0.005, (PlanningStatus.CHECKED, PlanningStatus.DEGRADED)

# (ranges (n, k), how many of a row may be off, generator): changes them in place
Spoil = Callable[[Floats, int, np.random.Generator], None]


@dataclass(frozen=True, slots=True)
class Followed:
    """Over all epochs (n,): from the epoch's own consensus and from the truth, m; sigma, m; whether it was confirmed.

    NaN without a position, or where the epoch by itself confirms none.
    """

    from_consensus_m: Floats
    from_truth_m: Floats
    alone_from_truth_m: Floats
    sigma_m: Floats
    confirmed: npt.NDArray[np.bool_]

    @property
    def near(self) -> float:
        """Share of the epochs with a consensus of their own that the session stays near."""
        has = np.isfinite(self.from_consensus_m)
        return float((self.from_consensus_m[has] <= NEAR_M).mean())

    @property
    def misled(self) -> int:
        """How many epochs were confirmed and more than three sigma off the truth."""
        return int((self.confirmed & (self.from_truth_m > 3.0 * self.sigma_m)).sum())


def _off_m(range_m: float, generator: np.random.Generator) -> float:
    """A range that is off by a size of any magnitude; too short only as far as it stays one."""
    short = range_m > 2.0 * LEAST_M and generator.random() < 0.5
    most_m = range_m - 0.5 if short else MOST_M
    size_m = float(np.exp(generator.uniform(np.log(LEAST_M), np.log(most_m))))
    return range_m - size_m if short else range_m + size_m


def _passing(ranges_m: Floats, most: int, generator: np.random.Generator) -> None:
    """Any anchor, another one in each epoch."""
    for row in ranges_m:
        for k in generator.choice(len(row), int(generator.integers(0, most + 1)), replace=False):
            row[k] = _off_m(float(row[k]), generator)


def _lasting(ranges_m: Floats, most: int, generator: np.random.Generator) -> None:
    """The same anchors all the time, each off by a constant."""
    for k in generator.choice(ranges_m.shape[1], most, replace=False):
        ranges_m[:, k] += _off_m(float(ranges_m[:, k].min()), generator) - float(ranges_m[:, k].min())


def _swapped(ranges_m: Floats, most: int, generator: np.random.Generator) -> None:
    """Two anchors under each other's name; with room for one only, one of them says what the other should."""
    a, b = generator.choice(ranges_m.shape[1], 2, replace=False)
    told = ranges_m[:, [b, a]].copy()
    ranges_m[:, a] = told[:, 0]
    if most > 1:
        ranges_m[:, b] = told[:, 1]


def _wrapped(ranges_m: Floats, most: int, generator: np.random.Generator) -> None:
    """What counters say when they run over, in passing."""
    for row in ranges_m:
        for k in generator.choice(len(row), int(generator.integers(0, most + 1)), replace=False):
            row[k] = generator.choice(WRAPS_M)


KINDS: dict[str, Spoil] = {
    "passing, any anchor": _passing,
    "lasting, constant": _lasting,
    "ids swapped": _swapped,
    "655.35 m, 65535 m": _wrapped,
}
# (anchors, how many may be off in one epoch): so many that the others still check one another twice
ROOMS = ((6, 1), (8, 2))


def follow_drives(spoil: Spoil, every_s: float, drives: int, generator: np.random.Generator) -> Followed:
    """Sessions over so many drives, and each of their epochs by itself."""
    found: list[tuple[float, float, float, float, bool]] = []
    for number in range(drives):
        count, most = ROOMS[number % len(ROOMS)]
        drive = _drive(count, every_s, generator)
        settings = DetectorSettings(range_sigma_m=SIGMA_M, max_range_m=10.0 * MOST_M)
        detector = Detector(drive.anchors, settings)
        epochs = _spoilt(drive, spoil, most, generator)
        for epoch, place_m in zip(epochs, drive.places_m, strict=True):
            answer, alone = detector.process(epoch), detect_epoch(drive.anchors, epoch, settings)
            own = alone.position
            if own is not None and not own.checked:
                own = None
            at = answer.position
            found.append(
                (
                    np.nan if at is None or own is None else float(np.linalg.norm(at.position_m - own.position_m)),
                    np.nan if at is None else float(np.linalg.norm(at.position_m - place_m)),
                    np.nan if own is None else float(np.linalg.norm(own.position_m - place_m)),
                    np.nan if at is None else float(np.sqrt(np.trace(at.covariance_m2))),
                    answer.planning in CONFIRMED,
                )
            )
    columns = np.array(found, np.float64).T
    return Followed(columns[0], columns[1], columns[2], columns[3], columns[4] > 0.0)


def _drive(count: int, every_s: float, generator: np.random.Generator) -> SimulatedDrive:
    middle_m = generator.uniform(-120.0, 120.0, size=2)
    corners_m = [[*(middle_m + generator.uniform(-60.0, 60.0, size=2)).tolist(), 2.0] for _ in range(40)]
    whole = drive_along(ring(count), corners_m, SPEED_M_PER_S, every_s)
    kept = slice(0, EPOCHS_A_DRIVE)
    return replace(whole, times_s=whole.times_s[kept], places_m=whole.places_m[kept], excess_m=whole.excess_m[kept])


def _spoilt(drive: SimulatedDrive, spoil: Spoil, most: int, generator: np.random.Generator) -> list[RangeEpoch]:
    drawn = draw_epochs(drive, RangingNoise(SIGMA_M, wheel_sigma_m=None), generator)
    ranges_m = np.array([[one.range_m for one in epoch.ranges] for epoch in drawn])
    spoil(ranges_m, most, generator)
    ids = [anchor.id for anchor in drive.anchors]
    return [
        replace(epoch, ranges=tuple(RangeMeasurement(name, r) for name, r in zip(ids, row, strict=True)))
        for epoch, row in zip(drawn, ranges_m.tolist(), strict=True)
    ]


def outliers(epochs: int = 100_000) -> Table:
    """A session against its own epochs, kind by kind."""
    generator, rows = np.random.default_rng(SEED), []
    drives = max(2, round(epochs / EPOCHS_A_DRIVE / (2 * len(KINDS))))
    for every_s in (1.0, 0.1):
        for kind, spoil in KINDS.items():
            found = follow_drives(spoil, every_s, drives, generator)
            cells = (
                f"{1.0 / every_s:.0f} Hz", kind, f"{len(found.sigma_m):,}", f"{found.near:.2%}",
                _rms(found.from_truth_m), _rms(found.alone_from_truth_m), f"{found.confirmed.mean():.1%}",
                str(found.misled),
            )  # fmt: skip
            met = found.near >= 1.0 - MAY_LEAVE and found.misled == 0
            rows.append(Row(cells, f"≥ {1.0 - MAY_LEAVE:.1%}, 0", met))
    columns = (
        "rate", "off are", "epochs", f"within {NEAR_M:g} m of its epoch", "session, RMS", "epoch alone, RMS",
        "confirmed", "confirmed and > 3σ off",
    )  # fmt: skip
    note = (
        f"6 anchors, one off at a time, and 8 anchors, two; sizes of {LEAST_M:g} m to {MOST_M:.0e} m, either sign; "
        f"ranging noise {SIGMA_M:g} m, a rover at {SPEED_M_PER_S:g} m/s that turns on the spot, no odometry. Of its "
        "epoch: of the place that the epoch by itself confirms. σ is the root of the trace of the covariance."
    )
    return Table("A session among gross outliers", columns, rows, note)


def _rms(off_m: Floats) -> str:
    return f"{float(np.sqrt(np.nanmean(off_m**2))):.2f} m"
