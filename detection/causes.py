"""Faults that all ranges of a log share, by name: an offset, a scale, a plane where space is needed, no altitudes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

import numpy as np

from .settings import DetectorSettings
from .systematic import Block, SharedFit, shared_fit

__all__ = ["ENOUGH", "HARDLY", "SPACE", "Cause", "Suspicion", "shared_cause"]

HARDLY = 0.2  # share of epochs with a position, or of ranges that are clear, under which something is said in any case
HALF = 0.5
LIKE = 0.25  # share by which what a part of a log says may differ from what the whole does
SPACE: Literal[3] = 3
ENOUGH = 10  # epochs, and blocks of ranges, before all this means anything
# A cause is named that leaves so little of what ranges are off without it, and so little of them off at all.
EXPLAINS = 0.5
# Where a cause leaves more sigmas of a range than so many, it has to explain the more. Of ranges from several moments
# the rover's turns leave some.
NEARLY, NEARLY_MOVING = 4.0, 10.0
SURELY = 1.5  # sigmas of a range: so little is left where a cause explains all
FEET = 3.28084
NEAR_FEET = 0.03


class Cause(StrEnum):
    """What a log as a whole may suffer from."""

    RANGE_UNIT = "unit of ranges"
    TIME_UNIT = "unit of time"
    TIME_ORDER = "order in time"
    DIMENSION = "dimension"
    ALTITUDES = "altitudes of anchors"
    OFFSET = "offset of all ranges"
    SCALE = "scale of all ranges"
    SIGMA = "sigma of ranges"
    TOO_FEW = "too few ranges"
    NOT_FOUND = "not found"


@dataclass(frozen=True, slots=True)
class Suspicion:
    """A likely cause, a sentence, and a number.

    value: of units how many metres or seconds one is, or how many times too long ranges are; metres of an offset or a
    sigma; how often rows go back; NaN where there is none.
    """

    cause: Cause
    sentence: str
    value: float = math.nan


def shared_cause(blocks: Sequence[Block], level: bool, sense: float, settings: DetectorSettings) -> list[Suspicion]:
    """The one fault shared by all ranges that explains by far best what they are off, if one does.

    level: all anchors stand at altitude 0, in three dimensions. sense: share of the log that makes sense as it is.
    """
    d, sigma_m = settings.dimension, settings.range_sigma_m
    blocks = [block for block in blocks if len(np.unique(block.anchors_m[:, :d], axis=0)) > d]
    if len(blocks) < ENOUGH:
        return [_ALTITUDES] if level else []
    speed = max(settings.max_speed_m_per_s / 3.0, 1e-3)
    plain = shared_fit(blocks, d, sigma_m, speed, "nothing")
    if plain is None:
        return []
    tolerance_m = settings.k_geometric * sigma_m
    typical_m = float(np.median(np.concatenate([block.ranges_m for block in blocks])))
    causes = []
    offset, scale = (shared_fit(blocks, d, sigma_m, speed, what) for what in ("offset", "scale"))
    if offset is not None and abs(offset.offset_m) > max(0.3 * tolerance_m, 3.0 * offset.offset_sigma_m):
        causes.append((offset.sigma_m, _offset(offset)))
    if scale is not None and abs(scale.scale - 1.0) > max(0.3 * tolerance_m / typical_m, 3.0 * scale.scale_sigma):
        causes.append((scale.sigma_m, _scale(scale)))
    in_space = (
        shared_fit([b for b in blocks if len(b.ranges_m) > SPACE], SPACE, sigma_m, speed, "nothing") if d == 2 else None
    )
    left_m, best = min(causes, key=lambda cause: cause[0], default=(math.inf, _ALTITUDES))
    if in_space is not None and in_space.sigma_m < EXPLAINS * plain.sigma_m:
        # an offset does about what a height does; anchors that were given heights were given them for a reason
        given = any(block.anchors_m[:, 2].any() for block in blocks)
        meets = in_space.sigma_m < SURELY * sigma_m
        better = meets if given or sense > HALF else in_space.sigma_m < EXPLAINS * left_m
        needed = Suspicion(Cause.DIMENSION, _IN_SPACE)
        if better and _lasts(needed, [block for block in blocks if len(block.ranges_m) > SPACE], settings, speed):
            return [needed]
        best = replace(best, sentence=best.sentence + _OR_IN_SPACE)
    at_once = not any(block.late_s.any() for block in blocks)
    near_m = (NEARLY if at_once else NEARLY_MOVING) * sigma_m
    explained = left_m < (EXPLAINS if left_m < near_m else 0.5 * EXPLAINS) * plain.sigma_m
    if level or sense > HALF:
        # most of it makes sense with what some ranges are off: a cause has to do as well
        explained &= left_m < SURELY * sigma_m
    if explained and _lasts(best, blocks, settings, speed):
        return [best]
    if level:
        return [_ALTITUDES]
    return _loose(plain, settings) if sense < HARDLY and at_once else []


def _lasts(found: Suspicion, blocks: Sequence[Block], settings: DetectorSettings, speed_m_per_s: float) -> bool:
    """Whether every quarter of the log says the same by itself: occlusion comes and goes, a fault stays."""
    d, sigma_m = settings.dimension, settings.range_sigma_m
    for quarter in np.array_split(np.arange(len(blocks)), 4):
        part = [blocks[number] for number in quarter]
        if found.cause is Cause.DIMENSION:
            plain, in_space = (shared_fit(part, space, sigma_m, speed_m_per_s, "nothing") for space in (d, SPACE))
            if plain is None or in_space is None or not in_space.sigma_m < EXPLAINS * plain.sigma_m:
                return False
            continue
        what: Literal["offset", "scale"] = "offset" if found.cause is Cause.OFFSET else "scale"
        fit = shared_fit(part, d, sigma_m, speed_m_per_s, what)
        if fit is None:
            return False
        whole = found.value if what == "offset" else found.value - 1.0
        apart = fit.offset_m - found.value if what == "offset" else fit.scale - found.value
        if abs(apart) > max(LIKE * abs(whole), 3.0 * max(fit.offset_sigma_m, fit.scale_sigma)):
            return False
    return True


_ALTITUDES = Suspicion(
    Cause.ALTITUDES,
    "The ranges do not meet, and all anchors stand at altitude 0: were their altitudes left out? If all is level, take "
    "two dimensions.",
)
_IN_SPACE = (
    "The ranges meet in space but not in the plane: anchors and rover are not at one height; take three dimensions, "
    "with the anchors' altitudes."
)


_OR_IN_SPACE = " Or anchors and rover are not at one height: try three dimensions."


def _offset(fit: SharedFit) -> Suspicion:
    word = "long" if fit.offset_m > 0.0 else "short"
    sentence = (
        f"All ranges are about {abs(fit.offset_m):.2f} m too {word} (± {max(fit.offset_sigma_m, 0.005):.2f} m): "
        "calibrate the antenna delay."
    )
    return Suspicion(Cause.OFFSET, sentence, fit.offset_m)


def _scale(fit: SharedFit) -> Suspicion:
    for factor, sentence in (
        (FEET, "The ranges are about 3.28 times what fits the anchors: are they in feet?"),
        (1.0 / FEET, "The ranges are about 0.305 times what fits the anchors: are the anchors' places in feet?"),
    ):
        if abs(fit.scale / factor - 1.0) < NEAR_FEET:
            return Suspicion(Cause.RANGE_UNIT, sentence, fit.scale)
    word = "long" if fit.scale > 1.0 else "short"
    much = f"{100.0 * abs(fit.scale - 1.0):.1f} % too {word}"
    if not 0.5 < fit.scale < 1.5:
        much = f"{fit.scale:.3g} times what fits the anchors"
    sentence = f"All ranges are about {much}: calibrate their scale."
    return Suspicion(Cause.SCALE, sentence, fit.scale)


def _loose(plain: SharedFit, settings: DetectorSettings) -> list[Suspicion]:
    """Ranges that scatter far more than they were said to, where nothing that they share explains it."""
    if plain.sigma_m < 2.5 * settings.range_sigma_m:
        return []
    return [
        Suspicion(
            Cause.SIGMA,
            f"Ranges are off by about {plain.sigma_m:.2g} m wherever the rover is put, and range_sigma_m is "
            f"{settings.range_sigma_m:.3g} m: is that too small, are most occluded, or do anchors stand "
            "elsewhere?",
            plain.sigma_m,
        )
    ]
