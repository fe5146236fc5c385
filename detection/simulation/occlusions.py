"""Known occlusion patterns: which anchor is hidden from when to when, and how much too long its ranges are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from detection.errors import DetectionInputError

from .drives import SimulatedDrive

__all__ = ["Occlusion", "occluded_by", "random_occlusions"]


@dataclass(frozen=True, slots=True)
class Occlusion:
    """An anchor hidden in the epochs from ``from_s`` until before ``until_s``; excess_m: how much longer the way is."""

    anchor_id: str
    from_s: float
    until_s: float
    excess_m: float


def occluded_by(drive: SimulatedDrive, occlusions: Sequence[Occlusion]) -> SimulatedDrive:
    """The drive with these occlusions; where several of an anchor overlap, the longest way counts.

    Raises DetectionInputError.
    """
    numbers = {anchor.id: number for number, anchor in enumerate(drive.anchors)}
    excess_m = drive.excess_m.copy()
    for occlusion in occlusions:
        if occlusion.anchor_id not in numbers:
            raise DetectionInputError(f"The drive has no anchor {occlusion.anchor_id!r}.")
        if not occlusion.excess_m > 0.0:
            raise DetectionInputError(f"Anchor {occlusion.anchor_id}: excess_m must be > 0, not {occlusion.excess_m}.")
        column = excess_m[:, numbers[occlusion.anchor_id]]
        hidden = (drive.times_s >= occlusion.from_s) & (drive.times_s < occlusion.until_s)
        column[hidden] = np.maximum(column[hidden], occlusion.excess_m)  # NaN stays: what is not heard is not longer
    return replace(drive, excess_m=excess_m)


def random_occlusions(
    drive: SimulatedDrive,
    together: int,
    lasting_s: float,
    clear_s: float,
    excess_m: tuple[float, float],
    generator: np.random.Generator,
) -> list[Occlusion]:
    """Occlusions of ``together`` anchors at a time, drawn anew each time, with all anchors clear in between.

    lasting_s, clear_s: of each occlusion, and of the time before it; the drive begins clear. The beginning is shifted
    by up to one epoch, so that onsets fall between epochs. excess_m: drawn evenly between these.
    """
    every_s = float(np.median(np.diff(drive.times_s)))
    occlusions = []
    begin_s = float(drive.times_s[0]) + clear_s
    while begin_s + lasting_s < drive.times_s[-1]:
        from_s = begin_s + every_s * float(generator.uniform(-0.5, 0.5))
        for number in generator.choice(len(drive.anchors), size=together, replace=False).tolist():
            metres = float(generator.uniform(*excess_m))
            occlusions.append(Occlusion(drive.anchors[number].id, from_s, from_s + lasting_s, metres))
        begin_s += lasting_s + clear_s
    return occlusions
