"""Faults that all ranges of a log share, by name: an offset, a scale, a plane where space is needed, no altitudes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..settings import DetectorSettings
from .misplaced import misplaced_cause
from .suspicions import Cause, Suspicion
from .systematic import Block, SharedFit, shared_fit

__all__ = ["ENOUGH", "HARDLY", "SPACE", "shared_cause"]

FEW = 0.8  # share of epochs with a position, or of ranges that are clear, under which something is likely wrong
HARDLY = 0.2  # share of epochs with a position, or of ranges that are clear, under which something is said in any case
HALF = 0.5
FITS_NATS = 2.25  # for each degree of freedom; half a nat is noise
LIKE = 0.25  # share by which what a quarter of a log says may differ from what the whole does
# Share of what is gained by a cause that every quarter of the log has to have, and nats.
LASTS, LASTS_NATS = 0.01, 2.0
SPACE: Literal[3] = 3
IN_PLANE: tuple[Literal["nothing", "offset", "scale"], ...] = ("nothing", "offset", "scale")
SPACE_NATS = 1.0  # that a block has to gain by a height, on average; noise gives half a nat, and an occlusion as little
ENOUGH = 10  # epochs, and blocks of ranges, before all this means anything
# A cause is named that leaves so little of what ranges are off without it, and so little of them off at all.
EXPLAINS = 0.5
# Where a cause leaves more sigmas of a range than so many, it has to explain the more. Of ranges from several moments
# the rover's turns leave some.
NEARLY, NEARLY_MOVING = 4.0, 10.0
# Where a cause leaves a range as sure as it was said to be, a small one is told too: of so many sigmas of itself, and
# of so many nats that the ranges become likelier by.
SMALL_SIGMAS, SMALL_NATS = 6.0, 15.0
SURE_SIGMAS, SURE_LEFT = 20.0, 0.65  # sigmas of itself, and the share of the misfit that it leaves at most
SURELY = 1.5  # sigmas of a range: so little is left where a cause explains all
FEET = 3.28084
NEAR_FEET = 0.03


def shared_cause(blocks: Sequence[Block], level: bool, sense: float, settings: DetectorSettings) -> list[Suspicion]:
    """The one fault, of all ranges or of an anchor, that explains by far best what ranges are off, if one does.

    level: all anchors stand at altitude 0, in three dimensions. sense: share of the log that makes sense as it is.
    """
    d, sigma_m = settings.dimension, settings.range_sigma_m
    level = level and sense < FEW
    blocks = [block for block in blocks if len(np.unique(block.anchors_m[:, :d], axis=0)) > d]
    if len(blocks) < ENOUGH:
        return [_ALTITUDES] if level else []
    speed = max(settings.max_speed_m_per_s / 3.0, 1e-3)
    plain = shared_fit(blocks, d, sigma_m, speed, "nothing")
    if plain is None:
        return []
    tolerance_m = settings.k_geometric * sigma_m
    typical_m = float(np.median(np.concatenate([block.ranges_m for block in blocks])))
    causes: list[tuple[SharedFit, Suspicion, float]] = []  # each with how many of its sigmas it is
    offset, scale = (shared_fit(blocks, d, sigma_m, speed, what) for what in ("offset", "scale"))
    if offset is not None and abs(offset.offset_m) > max(0.3 * tolerance_m, 3.0 * offset.offset_sigma_m):
        causes.append((offset, _offset(offset), abs(offset.offset_m) / offset.offset_sigma_m))
    if scale is not None and abs(scale.scale - 1.0) > max(0.3 * tolerance_m / typical_m, 3.0 * scale.scale_sigma):
        causes.append((scale, _scale(scale), abs(scale.scale - 1.0) / scale.scale_sigma))
    many = [block for block in blocks if len(block.ranges_m) > SPACE]
    in_space = shared_fit(many, SPACE, sigma_m, speed, "nothing") if d == 2 else None
    usual_m = max(sigma_m, min([fit.sigma_m for fit, _, _ in causes], default=0.0))
    if len(causes) == 2 and not _likelier(causes[0][0], causes[1][0], usual_m):
        causes.reverse()
    left_m, best = (causes[0][0].sigma_m, causes[0][1]) if causes else (math.inf, _ALTITUDES)
    if in_space is not None:
        in_plane = [plain, offset, scale]
        if len(many) < len(blocks):
            in_plane = [shared_fit(many, d, sigma_m, speed, what) for what in IN_PLANE]
        if _tells_space(in_space, [fit for fit in in_plane if fit is not None], sigma_m):
            return [Suspicion(Cause.DIMENSION, _IN_SPACE)]
        if in_space.sigma_m < EXPLAINS * plain.sigma_m:
            best = replace(best, sentence=best.sentence + _OR_IN_SPACE)
    at_once = not any(block.late_s.any() for block in blocks)
    near_m = (NEARLY if at_once else NEARLY_MOVING) * sigma_m
    explained = left_m < (EXPLAINS if left_m < near_m else 0.5 * EXPLAINS) * plain.sigma_m
    if level or sense > HALF:
        # most of it makes sense with what some ranges are off: a cause has to do as well
        explained &= left_m < SURELY * sigma_m
    if causes and not level and left_m < SURELY * sigma_m:
        fit, _, sigmas = causes[0]
        explained |= sigmas > SMALL_SIGMAS and plain.misfit(usual_m) - fit.misfit(usual_m) > SMALL_NATS
    if causes and not level and sense <= HALF and left_m < near_m:
        # of ranges from several moments the rover's turns leave much with any cause; then how sure it is has to tell
        fit, _, sigmas = causes[0]
        explained |= sigmas > SURE_SIGMAS and fit.misfit(usual_m) < SURE_LEFT * plain.misfit(usual_m)
    if explained and causes:
        fit = causes[0][0]
        explained = _lasts(fit, plain, usual_m) and (_fits(fit, usual_m) or _stays(fit, blocks, settings, speed))
    if explained and left_m < SURELY * sigma_m:
        return [best]
    misplaced = None if level else misplaced_cause(blocks, plain, d, sigma_m, speed)
    gained = plain.misfit(sigma_m) - causes[0][0].misfit(sigma_m) if explained else 0.0
    if misplaced is not None and misplaced[0] > gained:
        return [misplaced[1]]
    if explained:
        return [best]
    if level:
        return [_ALTITUDES]
    return _loose(plain, settings) if sense < HARDLY and at_once else []


def _likelier(fit: SharedFit, other: SharedFit, sigma_m: float) -> bool:
    """Whether most of the log is likelier by the one than by the other; blocks that tell most, either way, are lost."""
    gained = np.sort(other.misfits(sigma_m) - fit.misfits(sigma_m))
    lost = len(gained) // 5
    return float(gained[lost : len(gained) - lost].sum()) >= 0.0


def _lasts(fit: SharedFit, plain: SharedFit, sigma_m: float) -> bool:
    """Whether the ranges of every quarter of the log are likelier so: occlusion comes and goes, a fault stays."""
    gained = plain.misfits(sigma_m) - fit.misfits(sigma_m)
    least = min(float(quarter.sum()) for quarter in np.array_split(gained, 4))
    return least > max(LASTS * float(gained.sum()), LASTS_NATS)


def _fits(fit: SharedFit, sigma_m: float) -> bool:
    """Whether few ranges are far off with this cause: then what it leaves is noise, and some occlusion."""
    free = int(np.isfinite(fit.residuals_m).sum()) - fit.places_m.size - 1
    return fit.misfit(sigma_m) < FITS_NATS * free


def _quarters(blocks: Sequence[Block]) -> list[list[Block]]:
    return [[blocks[number] for number in quarter] for quarter in np.array_split(np.arange(len(blocks)), 4)]


def _stays(fit: SharedFit, blocks: Sequence[Block], settings: DetectorSettings, speed_m_per_s: float) -> bool:
    """Whether every quarter of the log by itself says about the same size: ranges that are occluded alike do not."""
    what: Literal["offset", "scale"] = "offset" if fit.scale == 1.0 else "scale"
    for part in _quarters(blocks):
        own = shared_fit(part, settings.dimension, settings.range_sigma_m, speed_m_per_s, what)
        if own is None:
            return False
        apart = own.offset_m - fit.offset_m if what == "offset" else own.scale - fit.scale
        whole = fit.offset_m if what == "offset" else fit.scale - 1.0
        if abs(apart) > max(LIKE * abs(whole), 4.0 * max(own.offset_sigma_m, own.scale_sigma)):
            return False
    return True


def _tells_space(space: SharedFit, in_plane: Sequence[SharedFit], sigma_m: float) -> bool:
    """Whether heights make the ranges of every quarter of the log likelier than anything in the plane does.

    By more than one unknown more for each block does of noise, or of what an occlusion leaves; and ranges have to be as
    sure in space as they were said to be, or far surer than in the plane.
    """
    usual_m = max(sigma_m, space.sigma_m)
    for fit in in_plane:
        quarters = np.array_split(fit.misfits(usual_m) - space.misfits(usual_m), 4)
        if not min(float(quarter.mean()) for quarter in quarters) > SPACE_NATS:
            return False
    nearest_m = min([fit.sigma_m for fit in in_plane], default=math.inf)
    return space.sigma_m < SURELY * sigma_m or space.sigma_m < EXPLAINS**2 * nearest_m


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
    return Suspicion(Cause.OFFSET, sentence, fit.offset_m, fit.offset_sigma_m)


def _scale(fit: SharedFit) -> Suspicion:
    for factor, sentence in (
        (FEET, "The ranges are about 3.28 times what fits the anchors: are they in feet?"),
        (1.0 / FEET, "The ranges are about 0.305 times what fits the anchors: are the anchors' places in feet?"),
    ):
        if abs(fit.scale / factor - 1.0) < NEAR_FEET:
            return Suspicion(Cause.RANGE_UNIT, sentence, fit.scale, fit.scale_sigma)
    word = "long" if fit.scale > 1.0 else "short"
    much = f"{100.0 * abs(fit.scale - 1.0):.1f} % too {word}"
    if not 0.5 < fit.scale < 1.5:
        much = f"{fit.scale:.3g} times what fits the anchors"
    sentence = f"All ranges are about {much} (± {100.0 * max(fit.scale_sigma, 1e-4):.2f} %): calibrate their scale."
    return Suspicion(Cause.SCALE, sentence, fit.scale, fit.scale_sigma)


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
