"""The altitude layers of a control volume."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.errors import VisibilityInputError

__all__ = ["AltitudeLayers", "altitude_layers"]

MOST_LAYERS = 100_000


@dataclass(frozen=True, eq=False)
class AltitudeLayers:
    """Layers of a control volume, from low to high.

    altitudes_m: (layers,) float64, ascending; altitudes, or heights above each post's ground if ``above_ground``.
    Raises VisibilityInputError.
    """

    altitudes_m: npt.NDArray[np.float64]
    above_ground: bool = False

    def __post_init__(self) -> None:
        altitudes_m = np.array(self.altitudes_m, np.float64)
        if altitudes_m.ndim != 1 or altitudes_m.size == 0:
            raise VisibilityInputError(f"Layers must be a list of altitudes, not of shape {altitudes_m.shape}.")
        if not np.isfinite(altitudes_m).all() or (np.diff(altitudes_m) <= 0.0).any():
            raise VisibilityInputError("Layer altitudes must be finite and ascend.")
        if self.above_ground and altitudes_m[0] < 0.0:
            raise VisibilityInputError(f"Layers above ground must be >= 0 m, not {altitudes_m[0]:g} m.")
        altitudes_m.setflags(write=False)
        object.__setattr__(self, "altitudes_m", altitudes_m)

    def __len__(self) -> int:
        return int(self.altitudes_m.size)


def altitude_layers(lowest_m: float, highest_m: float, step_m: float, *, above_ground: bool = False) -> AltitudeLayers:
    """Layers every ``step_m`` from lowest_m up to highest_m, which is one of them only where the steps end on it.

    Raises VisibilityInputError, also for more than MOST_LAYERS layers.
    """
    if not (math.isfinite(step_m) and step_m > 0.0):
        raise VisibilityInputError(f"step_m must be a number of metres > 0, not {step_m}.")
    if not (math.isfinite(lowest_m) and math.isfinite(highest_m) and lowest_m <= highest_m):
        raise VisibilityInputError(f"Layers must go from a low to a higher altitude, not {lowest_m} to {highest_m} m.")
    layers = math.floor((highest_m - lowest_m) / step_m * (1.0 + 1e-12)) + 1
    if layers > MOST_LAYERS:
        raise VisibilityInputError(
            f"{layers:,} layers every {step_m:g} m are more than the limit of {MOST_LAYERS:,}; take a larger step_m."
        )
    return AltitudeLayers(lowest_m + np.arange(layers, dtype=np.float64) * step_m, above_ground)
