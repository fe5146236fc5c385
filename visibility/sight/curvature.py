"""Curvature of the ground and bending of the ray, as one lowering of the ground with distance."""

from __future__ import annotations

import math
from dataclasses import dataclass

from terrain import ElevationGrid, body_of
from visibility.errors import VisibilityInputError

__all__ = ["FLAT", "Curvature"]

RADIO_REFRACTION_K = 4.0 / 3.0
# no body that anybody stands on is smaller, and drops over less leave the range of float32
SMALLEST_EFFECTIVE_RADIUS_M = 1.0


@dataclass(frozen=True, slots=True)
class Curvature:
    """Ground at horizontal distance d from the anchor is lowered by d²/(2·k·R).

    radius_m: mean radius R of the body, metres; inf = flat.
    refraction_k: effective-radius factor k (4/3 for radio on Earth, 1 on airless bodies).
    Raises VisibilityInputError.
    """

    radius_m: float
    refraction_k: float = 1.0

    def __post_init__(self) -> None:
        if not self.radius_m > 0.0 or not (self.refraction_k > 0.0 and math.isfinite(self.refraction_k)):
            raise VisibilityInputError(
                f"Curvature needs a positive radius and factor, not {self.radius_m} m and {self.refraction_k}."
            )
        if self.radius_m * self.refraction_k < SMALLEST_EFFECTIVE_RADIUS_M:
            raise VisibilityInputError(
                f"Curvature needs radius times factor >= {SMALLEST_EFFECTIVE_RADIUS_M:g} m, not "
                f"{self.radius_m:g} m × {self.refraction_k:g}."
            )

    @property
    def drop_per_m2(self) -> float:
        """c in drop = c·d², 1/m."""
        return 0.0 if math.isinf(self.radius_m) else 1.0 / (2.0 * self.refraction_k * self.radius_m)

    def drop_m(self, distance_m: float) -> float:
        """How far the ground is lowered at a horizontal distance, metres."""
        return self.drop_per_m2 * distance_m * distance_m

    def sentence(self) -> str:
        """Which curvature was used, in words."""
        if math.isinf(self.radius_m):
            return "flat: no curvature"
        return f"radius {self.radius_m / 1000.0:.1f} km, refraction factor k = {self.refraction_k:.4g}"

    @classmethod
    def of(cls, grid: ElevationGrid) -> Curvature:
        """Curvature that a grid's CRS implies: its ellipsoid's mean radius, k = 4/3 on Earth, flat without a CRS."""
        if grid.crs is None:
            return FLAT
        body = body_of(grid.crs)
        return cls(body.radius_m, RADIO_REFRACTION_K if body.name == "Earth" else 1.0)

    @classmethod
    def given(cls, curvature: Curvature) -> Curvature:
        """The curvature that a caller gave; raises VisibilityInputError where it is none, True or False for example."""
        if not isinstance(curvature, cls):
            raise VisibilityInputError(
                "curvature must be a visibility.Curvature, visibility.FLAT or None (what the grid's CRS implies), "
                f"not {curvature!r}."
            )
        return curvature

    @classmethod
    def over(cls, grid: ElevationGrid, curvature: Curvature | None) -> Curvature:
        """The curvature that a caller gave, or None: what the grid's CRS implies. Raises VisibilityInputError."""
        return cls.of(grid) if curvature is None else cls.given(curvature)


FLAT = Curvature(math.inf)
