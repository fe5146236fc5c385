"""What logs of drives come to: readings, fixes, ranges and speeds, as a request for a navigation has them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from service.files.range_log import Row

__all__ = ["DriveRows"]

Three = tuple[float, float, float]
Field = float | str | list[float]
MAX_SPEED_STEP_S = 5.0


@dataclass(slots=True)
class DriveRows:
    """Gathered one after the other, from any number of files. axes, force_unit, rate_unit: as the log's kind has them.

    told: what was decided and passed over, in sentences.
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
            self.told.append(f"{failed} ranges that failed were passed over.")

    def fields(self) -> dict[str, object]:
        """As a request has them."""
        return {
            "readings": {"times_s": self.times_s, "forces": self.forces, "rates": self.rates},
            "fixes": self.fixes,
            "ranges": self.ranges,
            "speeds": self.speeds,
        }
