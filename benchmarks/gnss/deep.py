"""Deep integration in a wood: a second against 20 ms, monitor on and off (seed 002, figures 4.6 to 4.8)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.gnss.deep_drive import BEGIN, MOTION, NAVIGATION, DeepDrive, Wood
from benchmarks.report import Row, Table
from navigation.deep import DeepRules, DeepTrack, integrate

__all__ = ["DENSE", "LESS_DENSE", "Driven", "drive_through", "in_a_wood"]

Array = npt.NDArray[np.float64]
FROM_S = 45.0  # the wood begins; errors are told from ten seconds later on
DENSE = Wood(FROM_S, 25.0, 2.0, 0.05)
LESS_DENSE = Wood(FROM_S, 25.0, 1.4, 0.05)


@dataclass(frozen=True, eq=False)
class Driven:
    """A drive with what was made of it: off_m (e, 3) east, north, up."""

    drive: DeepDrive
    track: DeepTrack
    off_m: Array

    @property
    def late(self) -> npt.NDArray[np.bool_]:
        """(e,) seconds that are told."""
        return self.track.times_s > FROM_S + 10.0


def drive_through(drive: DeepDrive, rules: DeepRules) -> Driven:
    """The loop closed over one drive."""
    track = integrate(
        drive.correlate,
        drive.log,
        drive.start,
        drive.noise,
        drive.frame,
        drive.ephemerides,
        BEGIN,
        drive.prns,
        drive.clock,
        rules,
    )
    return Driven(drive, track, track.position_m - drive.drive.position(track.times_s))


def in_a_wood(seeds: Sequence[int] = (1, 2), duration_s: float = 120.1) -> Table:
    """Errors of position under the open sky and in two woods."""
    rows: list[Row] = []
    if MOTION.exists() and NAVIGATION.exists():
        cases = (
            ("open sky", "1 s", Wood(), "tactical", DeepRules(), ""),
            ("dense wood", "1 s", DENSE, "tactical", DeepRules(), "≤ 0.5 m"),
            ("", "1 s, monitor off", DENSE, "tactical", DeepRules(monitored=False), ""),
            ("", "20 ms", DENSE, "tactical", DeepRules(bits=1), ""),
            ("", "1 s, lower unit", DENSE, "lower", DeepRules(), ""),
            ("less dense wood", "1 s", LESS_DENSE, "tactical", DeepRules(), "≤ 0.5 m"),
            ("", "1 s, monitor off", LESS_DENSE, "tactical", DeepRules(monitored=False), ""),
            ("", "20 ms", LESS_DENSE, "tactical", DeepRules(bits=1), ""),
        )
        for place, how, wood, unit, rules, target in cases:
            driven = [drive_through(DeepDrive(seed, duration_s, wood, unit), rules) for seed in seeds]
            rows.append(_row(place, how, driven, target))
    note = (
        f"gps-sdr-sim's circle (8.3 m/s, 100 m), {len(seeds)} drives of {duration_s:.0f} s, the first {FROM_S:g} s "
        "without trees; errors from ten seconds in the wood on. Losses by Weissberger's model over crowns of 25 m with "
        f"gaps, times {DENSE.factor:g} and {LESS_DENSE.factor:g}; in a twentieth of the seconds a satellite begins to "
        "be heard by a reflection only (5 to 60 m longer, 1 to 4 s). A tactical unit (10 °/h, 3 °/√h, 1 mg), an "
        "oscillator of 3e-11 at 1 s; each range errs by a constant of 0.15 m that air and orbits leave. Channels are "
        "simulated as correlators' sums. Of 20 ms each sum is judged by itself, and those detected in "
        "a second are averaged."
    )
    if not rows:
        note = "The motion and ephemerides are not beside this checkout."
    columns = ("sky", "summed", "median C/N0", "satellites used", "rms", "horizontal", "largest")
    return Table("Deep integration in a wood", columns, rows, note)


def _row(place: str, how: str, driven: Sequence[Driven], target: str) -> Row:
    off_m = np.concatenate([one.off_m[one.late] for one in driven])
    strengths = [
        heard.cn0_db_hz
        for one in driven
        for second, late in zip(one.track.heard, one.late, strict=True)
        for heard in second
        if late and np.isfinite(heard.cn0_db_hz)
    ]
    rms_m = float(np.sqrt((off_m**2).sum(axis=1).mean()))
    flat_m = float(np.sqrt((off_m[:, :2] ** 2).sum(axis=1).mean()))
    largest_m = float(np.linalg.norm(off_m, axis=1).max())
    used = float(np.mean([one.track.used[one.late].mean() for one in driven]))
    cells = (
        place,
        how,
        f"{np.median(strengths):.1f} dB-Hz" if strengths else "–",
        f"{used:.1f} of {len(driven[0].drive.prns)}",
        f"{rms_m:.2f} m",
        f"{flat_m:.2f} m",
        f"{largest_m:.2f} m",
    )
    return Row(cells, target, rms_m <= 0.5 if target else None)
