"""What logs of drives come to: readings, fixes, ranges and speeds, as a request for a navigation has them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from service.files.range_log import Row

__all__ = ["DriveRows"]

Three = tuple[float, float, float]
Field = float | str | list[float]
MAX_SPEED_STEP_S = 5.0
WEEK_S, LONG_FALL_S = 604_800.0, 3600.0


@dataclass(slots=True)
class DriveRows:
    """Gathered one after the other, from any number of files. axes, force_unit, rate_unit: as the log's kind has them.

    told: what was decided and passed over, in sentences. streams: of a log of messages, what each is taken for.
    no_sigmas: how many sigmas of fixes are not above zero.
    """

    times_s: list[float] = field(default_factory=list)
    forces: list[Three] = field(default_factory=list)
    rates: list[Three] = field(default_factory=list)
    fixes: list[dict[str, Field]] = field(default_factory=list)
    ranges: list[dict[str, Field]] = field(default_factory=list)
    speeds: list[dict[str, Field]] = field(default_factory=list)
    axes: str | None = None
    force_unit: str | None = None
    rate_unit: str | None = None
    told: list[str] = field(default_factory=list)
    streams: dict[str, str] = field(default_factory=dict)
    no_sigmas: int = 0

    def take(self, rows: Iterable[Row]) -> None:
        """Ranges, and motions of wheels as speeds in the middle of their time."""
        failed = 0
        for row in rows:
            if row.measured is not None:
                one = row.measured
                if not math.isfinite(one.range_m):
                    failed += 1
                    continue
                told: dict[str, Field] = {"time_s": row.time_s, "anchor_id": one.anchor_id, "range_m": one.range_m}
                self.ranges.append(told | ({} if one.sigma_m is None else {"sigma_m": one.sigma_m}))
            elif row.motion is not None and row.motion.wheel_m is not None:
                duration_s = row.motion.duration_s
                if 0.0 < duration_s <= MAX_SPEED_STEP_S:
                    forward = row.motion.wheel_m[0] / duration_s
                    self.speeds.append({"time_s": row.time_s - duration_s / 2.0, "forward_m_per_s": forward})
        if failed:
            self.told.append(f"Ranges that failed were passed over: {failed}.")

    def unroll_week(self) -> None:
        """Seconds of a GPS week that begin anew go on instead, in everything that was measured."""
        falls = [n for n in range(1, len(self.times_s)) if self.times_s[n] - self.times_s[n - 1] < LONG_FALL_S - WEEK_S]
        if len(falls) != 1:
            return
        before_s = self.times_s[0] - WEEK_S / 2.0
        self.times_s = [one + WEEK_S if one < before_s else one for one in self.times_s]
        for rows in (self.fixes, self.ranges, self.speeds):
            for row in rows:
                time_s = row["time_s"]
                if isinstance(time_s, float) and time_s < before_s:
                    row["time_s"] = time_s + WEEK_S
        self.told.append(f"At reading {falls[0]} the seconds of a GPS week begin anew; from there on a week was added.")

    def readings(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """(times (k,), forces (k, 3), rates (k, 3)) in the order of their times, in the log's units."""
        times_s = np.array(self.times_s, np.float64)
        order = np.argsort(times_s, kind="stable")
        forces, rates = (np.array(three, np.float64).reshape(-1, 3)[order] for three in (self.forces, self.rates))
        return times_s[order], forces, rates

    def fields(self) -> dict[str, object]:
        """As a request has them."""
        return {
            "readings": {"times_s": self.times_s, "forces": self.forces, "rates": self.rates},
            "fixes": self.fixes,
            "ranges": self.ranges,
            "speeds": self.speeds,
        }
