"""A depth sensor: where its pixels look, and how coarse its depths are."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import numbers

__all__ = ["KINECT", "DepthSensor", "TargetPixels"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class DepthSensor:
    """A pinhole that tells depth along its axis by a whole number d, linear in inverse depth: 1/z = offset - step·d.

    Its frame is right, down, forward. noise_steps: one sigma of a number before it is rounded. Raises MeasurementError.
    """

    focal_px: float
    centre_col_px: float
    centre_row_px: float
    offset_per_m: float = 3.3309
    step_per_m: float = 0.00307
    noise_steps: float = 0.2

    def __post_init__(self) -> None:
        values = dataclasses.astuple(self)
        if not (all(map(math.isfinite, values)) and min(self.focal_px, self.step_per_m, self.noise_steps) > 0.0):
            raise MeasurementError("A depth sensor needs finite numbers; focal_px, step_per_m, noise_steps above zero.")

    def rays(self, cols: npt.ArrayLike, rows: npt.ArrayLike) -> Array:
        """(n, 3) directions right, down, forward of pixels, forward part 1."""
        right = (np.asarray(cols, np.float64) - self.centre_col_px) / self.focal_px
        down = (np.asarray(rows, np.float64) - self.centre_row_px) / self.focal_px
        return np.stack([right, down, np.ones_like(right)], axis=-1)

    def numbers_of(self, depths_m: npt.ArrayLike) -> Array:
        """The whole numbers nearest to depths, as floats; NaN stays."""
        told: Array = np.rint((self.offset_per_m - 1.0 / np.asarray(depths_m, np.float64)) / self.step_per_m)
        return told

    def depths_m(self, values: npt.ArrayLike) -> Array:
        """Depths of numbers; NaN from where on there is none."""
        inverse = self.offset_per_m - self.step_per_m * np.asarray(values, np.float64)
        return np.where(inverse > 0.0, 1.0 / np.where(inverse > 0.0, inverse, 1.0), np.nan)

    def step_m(self, depth_m: npt.ArrayLike) -> Array:
        """From one depth that can be told to the next, about there: step·z²; infinite where no number holds that."""
        with np.errstate(over="ignore"):
            step: Array = self.step_per_m * np.asarray(depth_m, np.float64) ** 2
        return step

    def with_levels_of(self, depths_m: npt.ArrayLike) -> DepthSensor:
        """The sensor whose numbers fall best on measured depths: what it adds to each of them is taken from these.

        For files that tell depths of a sensor whose offset is not known; the step is taken as it is.
        """
        phases = np.exp(2j * np.pi * ((self.offset_per_m - 1.0 / np.asarray(depths_m)) / self.step_per_m))
        shift = float(np.angle(phases.mean())) / (2.0 * np.pi) * self.step_per_m
        return dataclasses.replace(self, offset_per_m=self.offset_per_m - shift)


# intrinsics are those usually taken for the infrared camera of Microsoft's Kinect for Xbox 360
KINECT = DepthSensor(580.0, 319.5, 239.5)


@dataclass(frozen=True, eq=False)
class TargetPixels:
    """The pixels of a depth image that show one target: cols, rows (n,) and depths_m (n,) along the axis.

    Pixels without a depth (NaN, or 0 as files have it) are left out. Raises MeasurementError.
    """

    cols: Array
    rows: Array
    depths_m: Array

    def __post_init__(self) -> None:
        count = np.size(self.depths_m)
        table = [numbers(name, getattr(self, name), (count,)) for name in ("cols", "rows", "depths_m")]
        kept = np.isfinite(table[2]) & (table[2] != 0.0)
        if not np.isfinite(np.concatenate(table[:2])).all() or (table[2][kept] < 0.0).any() or np.isinf(table[2]).any():
            raise MeasurementError("Pixels of a target need finite columns and rows, and depths above zero.")
        for name, values in zip(("cols", "rows", "depths_m"), table, strict=True):
            object.__setattr__(self, name, values[kept])

    def points_m(self, sensor: DepthSensor) -> Array:
        """(n, 3) right, down, forward."""
        points: Array = sensor.rays(self.cols, self.rows) * self.depths_m[:, None]
        return points
