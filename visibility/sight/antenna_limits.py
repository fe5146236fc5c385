"""What an anchor's antenna can reach: ranges, a sector, elevations."""

from __future__ import annotations

import math
from dataclasses import dataclass

from visibility.errors import AnchorError
from visibility.sight.kernels import reach as kernel

__all__ = ["ALL_ROUND", "AntennaLimits", "limits_of"]

# so many turns are a rounding of none, or of the one that is all round
ROUNDED_TURNS = 1e-12


@dataclass(frozen=True, slots=True)
class AntennaLimits:
    """What an anchor's antenna can reach.

    min_range_m, max_range_m: slant range, metres; inf = unlimited.
    azimuth_from_rad, azimuth_to_rad: sector clockwise from grid north; both None, and a whole turn, = all round.
    min_elevation_rad, max_elevation_rad: above the anchor's horizontal.
    Raises AnchorError.
    """

    min_range_m: float = 0.0
    max_range_m: float = math.inf
    azimuth_from_rad: float | None = None
    azimuth_to_rad: float | None = None
    min_elevation_rad: float = -math.pi / 2
    max_elevation_rad: float = math.pi / 2

    def __post_init__(self) -> None:
        if not 0.0 <= self.min_range_m < self.max_range_m:
            raise AnchorError(f"Range limits must satisfy 0 <= {self.min_range_m} m < {self.max_range_m} m.")
        if not -math.pi / 2 <= self.min_elevation_rad < self.max_elevation_rad <= math.pi / 2:
            raise AnchorError(
                "Elevation limits must satisfy -90 deg <= min < max <= 90 deg, not "
                f"{math.degrees(self.min_elevation_rad):g} and {math.degrees(self.max_elevation_rad):g} deg."
            )
        if (self.azimuth_from_rad is None) != (self.azimuth_to_rad is None):
            raise AnchorError("An azimuth sector needs both its start and its end.")
        if not all(angle is None or math.isfinite(angle) for angle in (self.azimuth_from_rad, self.azimuth_to_rad)):
            raise AnchorError("Azimuth limits must be finite angles.")
        if self.azimuth_from_rad is not None and self.azimuth_to_rad is not None:
            turns = (self.azimuth_to_rad - self.azimuth_from_rad) / (2.0 * math.pi)
            if abs(turns - round(turns)) < ROUNDED_TURNS and round(turns) != 1:
                start_deg, end_deg = math.degrees(self.azimuth_from_rad), math.degrees(self.azimuth_to_rad)
                raise AnchorError(
                    f"The azimuth sector from {start_deg:.6g} to {end_deg:.6g} deg is empty; leave both out, or give 0 "
                    "and 360 deg, for all round."
                )


ALL_ROUND = AntennaLimits()


def limits_of(limits: AntennaLimits) -> kernel.Limits:
    """Limits as the kernels take them; an unlimited angle becomes an infinite tangent."""
    azimuth_from_rad, azimuth_width_rad = 0.0, 2.0 * math.pi
    if limits.azimuth_from_rad is not None and limits.azimuth_to_rad is not None:
        azimuth_from_rad = limits.azimuth_from_rad
        azimuth_width_rad = limits.azimuth_to_rad - limits.azimuth_from_rad
        if not 0.0 < azimuth_width_rad <= 2.0 * math.pi * (1.0 + ROUNDED_TURNS):
            azimuth_width_rad %= 2.0 * math.pi
    lowest = -math.inf if limits.min_elevation_rad <= -math.pi / 2 else math.tan(limits.min_elevation_rad)
    highest = math.inf if limits.max_elevation_rad >= math.pi / 2 else math.tan(limits.max_elevation_rad)
    return kernel.Limits(
        min_range_m=limits.min_range_m,
        max_range_m=limits.max_range_m,
        azimuth_from_rad=azimuth_from_rad,
        azimuth_width_rad=azimuth_width_rad,
        tan_min_elevation=lowest,
        tan_max_elevation=highest,
    )
