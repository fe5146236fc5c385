"""Range changes against odometry over a session: a trusted range of each anchor, and a window of violations (step 7).

A range that stays too long changes only once, at the onset. So each new range is held against the last one that was
trusted, and against all the way driven since; then a lasting occlusion violates again and again, as the window asks.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from .odometry import Motion
from .settings import DetectorSettings

__all__ = ["Change", "Trusted"]


@dataclass(frozen=True, slots=True)
class Change:
    """What odometry says of one range.

    over_m: by how much the change exceeds what the motion allows, NaN = nothing to compare with; tolerance_m: ε of the
    test. violated: beyond it. confirmed: in enough of the window. high: by more than twice the tolerance. shorter: the
    range fell by more than the rover moved, so it was the trusted one that was too long.
    """

    over_m: float
    tolerance_m: float
    violated: bool
    confirmed: bool
    high: bool
    shorter: bool = False


@dataclass(slots=True)
class Trusted:
    """The last trusted range of an anchor, the motion since, and the window of violations; changed in place.

    direction: unit vector (east, north, up) from the rover to the anchor then, for the law of cosines; None = unknown.
    """

    window: deque[bool]
    range_m: float = math.nan
    variance_m2: float = 0.0
    direction: tuple[float, float, float] | None = None
    length_m: float = 0.0
    motion_variance_m2: float = 0.0
    displacement_m: tuple[float, float] | None = (0.0, 0.0)
    across_m: float = 0.0
    broken: bool = field(default=False)  # odometry was missing or unreliable since

    def drive(self, motion: Motion | None) -> None:
        """Add a reliable increment to the motion since the trusted range; None = there is none."""
        if motion is None:
            self.broken = True
            return
        self.length_m += motion.length_m
        self.motion_variance_m2 += motion.sigma_m**2
        self.across_m += motion.across_m  # a heading errs one way
        if self.displacement_m is None or motion.displacement_m is None:
            self.displacement_m = None
        else:
            self.displacement_m = (
                self.displacement_m[0] + motion.displacement_m[0],
                self.displacement_m[1] + motion.displacement_m[1],
            )

    def trust(self, range_m: float, sigma_m: float, direction: tuple[float, float, float] | None) -> None:
        """Take a range as the one to compare with from now on."""
        self.range_m, self.variance_m2, self.direction = range_m, sigma_m**2, direction
        self.length_m, self.motion_variance_m2, self.displacement_m, self.broken = 0.0, 0.0, (0.0, 0.0), False
        self.across_m = 0.0

    def judge(self, range_m: float, sigma_m: float, settings: DetectorSettings, scale: float) -> Change | None:
        """Hold a new range against the trusted one; None where there is none, or no odometry to bridge the time.

        The noise of both ranges belongs to the tolerance as much as that of the odometry does.
        """
        if math.isnan(self.range_m) or self.broken:
            return None
        variance_m2 = self.variance_m2 + sigma_m**2 + self.motion_variance_m2
        expected_m = self._expected_m()
        if expected_m is not None:
            variance_m2 += self.across_m**2
        tolerance_m = scale * settings.k_odometry * math.sqrt(variance_m2)
        if settings.odometry_tolerance_m is not None:
            tolerance_m = scale * settings.odometry_tolerance_m
        change_m = range_m - self.range_m
        over_m = abs(change_m) - self.length_m
        if expected_m is not None:
            # the triangle test stays the bound; the law of cosines is sharper where the way is known
            over_m = max(over_m, abs(range_m - expected_m))
            change_m = range_m - expected_m
        violated = over_m > tolerance_m
        self.window.append(violated)
        confirmed = sum(self.window) >= settings.persistence * (self.window.maxlen or 1)
        high = confirmed and over_m > 2.0 * tolerance_m
        return Change(over_m, tolerance_m, violated, confirmed, high, violated and change_m < 0.0)

    def _expected_m(self) -> float | None:
        if self.direction is None or self.displacement_m is None:
            return None
        east_m, north_m = self.displacement_m
        along_m = east_m * self.direction[0] + north_m * self.direction[1]
        return math.sqrt(max(self.range_m**2 + east_m**2 + north_m**2 - 2.0 * self.range_m * along_m, 0.0))
