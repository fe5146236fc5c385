"""What ranges of a log are off together or by anchor, estimated while the rover drives, each with its sigma.

A range is taken as ``scale`` times the distance plus an offset, of the tag or of each anchor. Nothing is applied unless
somebody does: ``Calibration.applied``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..epochs import RangeEpoch, RangingAnchor
from ..errors import DetectionInputError
from ..settings import DetectorSettings
from .diagnosis import EpochNote, blocks_of, places_of
from .systematic import Block, shared_fit

__all__ = ["Calibrated", "Calibration", "calibrate", "calibration_of"]

Floats = npt.NDArray[np.float64]
Calibrated = Literal["offset", "scale", "anchors"]

MOST_BLOCKS = 240
ROUNDS = 4
BEYOND = 3.0  # sigmas from which a range hardly pulls any more
DETERMINED = 1e-4  # of the best known combination of offsets, how well the worst has to be


@dataclass(frozen=True, slots=True)
class Calibration:
    """By how much ranges are off: range = ``scale`` · distance + offset.

    offsets_m, offset_sigmas_m: by anchor; an anchor that is not in it has none. scale_sigma: 0 where scale is not
    estimated. Raises DetectionInputError.
    """

    scale: float = 1.0
    scale_sigma: float = 0.0
    offsets_m: Mapping[str, float] = field(default_factory=dict)
    offset_sigmas_m: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scale) and self.scale > 0.0):
            raise DetectionInputError(f"scale must be a number > 0, not {self.scale}.")
        if not all(map(math.isfinite, self.offsets_m.values())):
            raise DetectionInputError("Offsets must be finite metres.")

    def applied(self, epoch: RangeEpoch) -> RangeEpoch:
        """The epoch with its ranges set right."""
        offsets_m = self.offsets_m
        ranges = [
            replace(one, range_m=(one.range_m - offsets_m.get(one.anchor_id, 0.0)) / self.scale) for one in epoch.ranges
        ]
        return replace(epoch, ranges=tuple(ranges))


def calibrate(
    anchors: Sequence[RangingAnchor], epochs: Sequence[RangeEpoch], settings: DetectorSettings, what: Calibrated
) -> Calibration | None:
    """One offset of all ranges, one scale, or an offset of each anchor, of a log; None where it does not tell.

    It tells where epochs have more ranges than a place needs, and the rover drives: the more, the better.
    """
    places_m, notes = places_of(anchors), []
    for epoch in epochs:
        if epoch.moved:
            places_m = places_m | places_of(one for one in epoch.moved if one.id in places_m)
        notes.append(EpochNote(epoch.time_s, epoch.ranges, places_m, None, 0, 0, True, ""))
    return calibration_of(notes, settings, what)


def calibration_of(notes: Sequence[EpochNote], settings: DetectorSettings, what: Calibrated) -> Calibration | None:
    """The same of what was noted."""
    d, sigma_m = settings.dimension, settings.range_sigma_m
    blocks = [block for block in blocks_of(notes, settings, MOST_BLOCKS) if len(block.ids) > d]
    ids = sorted({anchor_id for block in blocks for anchor_id in block.ids})
    speed = max(settings.max_speed_m_per_s / 3.0, 1e-3)
    if what == "anchors":
        return _by_anchor(blocks, ids, d, sigma_m, speed)
    fit = shared_fit(blocks, d, sigma_m, speed, what)
    if fit is None:
        return None
    if what == "scale":
        return Calibration(fit.scale, fit.scale_sigma)
    return Calibration(1.0, 0.0, dict.fromkeys(ids, fit.offset_m), dict.fromkeys(ids, fit.offset_sigma_m))


def _by_anchor(
    blocks: Sequence[Block], ids: Sequence[str], d: Literal[2, 3], sigma_m: float, speed_m_per_s: float
) -> Calibration | None:
    """An offset of each anchor: places are fitted, then what is left tells the offsets, and so on."""
    common = shared_fit(blocks, d, sigma_m, speed_m_per_s, "offset")
    if common is None or any(block.late_s.any() for block in blocks):
        return None
    numbers = {anchor_id: number for number, anchor_id in enumerate(ids)}
    offsets_m: Floats = np.full(len(ids), common.offset_m)
    covariance: Floats = np.zeros((len(ids), len(ids)))
    for _ in range(ROUNDS):
        freed = [
            replace(one, ranges_m=one.ranges_m - offsets_m[[numbers[anchor_id] for anchor_id in one.ids]])
            for one in blocks
        ]
        fit = shared_fit(freed, d, sigma_m, speed_m_per_s, "nothing")
        if fit is None:
            return None
        usual_m = max(sigma_m, fit.sigma_m)
        normal, right = np.zeros((len(ids), len(ids))), np.zeros(len(ids))
        for block, place_m, residual_m in zip(freed, fit.places_m, fit.residuals_m, strict=True):
            index = np.array([numbers[anchor_id] for anchor_id in block.ids])
            left: Floats = _left(block.anchors_m[:, :d], place_m, residual_m[: len(index)], usual_m)
            normal[np.ix_(index, index)] += left
            right[index] += left @ residual_m[: len(index)]
        known, _ = np.linalg.eigh(normal)
        if not known[0] > DETERMINED * known[-1]:
            return None
        covariance[...] = usual_m**2 * np.linalg.inv(normal)
        offsets_m += np.linalg.solve(normal, right)
    sigmas_m = np.sqrt(covariance.diagonal()).tolist()
    return Calibration(1.0, 0.0, dict(zip(ids, offsets_m.tolist(), strict=True)), dict(zip(ids, sigmas_m, strict=True)))


def _left(anchors_m: Floats, place_m: Floats, residual_m: Floats, sigma_m: float) -> Floats:
    """(k, k) what ranges of one place say of what they are off, once that place has taken what it can."""
    apart_m = place_m - anchors_m
    toward = apart_m / np.maximum(np.sqrt((apart_m * apart_m).sum(axis=1)), 1e-9)[:, None]
    weights = (1.0 + (residual_m / (BEYOND * sigma_m)) ** 2) ** -2
    weighed = weights[:, None] * toward
    left: Floats = np.diag(weights) - weighed @ np.linalg.pinv(toward.T @ weighed) @ weighed.T
    return left
