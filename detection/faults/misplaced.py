"""Faults of single anchors: two that have each other's id, one that stands elsewhere, one whose ranges are short.

Such an anchor is told from one that is occluded by lasting through the log, and by what makes its ranges meet those of
the others at once: another's place, one other place, or one length.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .suspicions import Cause, Suspicion
from .systematic import Block, SharedFit, shared_fit

__all__ = ["misplaced_cause"]

Floats = npt.NDArray[np.float64]

MOST_SUSPECTS = 8  # anchors that are looked at, those whose ranges meet worst
FEW_BLOCKS = 24  # for a first look
# By which a cause has to make the ranges likelier; than another one; and a moved anchor than two swapped ones.
GAINED_NATS, CLEARLY_NATS, RATHER_NATS = 40.0, 10.0, 60.0
FEWEST = 12  # ranges of an anchor
# Share of its ranges within three sigmas where its place is right, and of those of either half of the log: the rest may
# be occluded.
FITS, FITS_HALF = 0.5, 0.2
# Share of them, in either half, where its place is wrong; of two that are swapped, which a rover may be as far from.
FITS_HARDLY, FITS_SOME = 0.15, 0.4
# Where hardly any is too short, the anchor may be occluded all along: more has to fit, for longer than that takes, and
# ranges be longer by more sigmas than any detour is likely to make them.
SHORT, FITS_LONG, LONG_S = 0.2, 0.7, 20.0
BEYOND_OCCLUSION = 120.0
NEAR = 3.0  # sigmas
STARTS, STEPS = 12, 20
TELLS = 2.0  # tolerances of a range, nearer than which a place is as good as the one told
NATS_A_WAY = 4.0  # by which an axis more has to make them likelier
TELLS_NATS = 10.0  # by which another place makes ranges likelier than one length that is added to all of them


@dataclass(frozen=True, slots=True, eq=False)
class _Ranges:
    """Of one anchor: (m, d) places of the rover, (m, d) of the anchor as told, (m,) ranges."""

    rover_m: Floats
    told_m: Floats
    ranges_m: Floats

    def off_m(self, shift_m: Floats) -> Floats:
        """(m,) ranges minus distances, with the anchor shifted (d,)."""
        apart_m = self.told_m + shift_m - self.rover_m
        off_m: Floats = self.ranges_m - np.sqrt((apart_m * apart_m).sum(axis=1))
        return off_m


def misplaced_cause(
    blocks: Sequence[Block], plain: SharedFit, dimension: int, range_sigma_m: float, speed_m_per_s: float
) -> tuple[float, Suspicion] | None:
    """(gain, what is said) of anchors whose ranges meet the others' from elsewhere than is said; mostly None.

    gain: by how many nats the ranges are likelier so.
    plain: the fit of all blocks with nothing shared.
    """
    d, ids = dimension, sorted({anchor_id for block in blocks for anchor_id in block.ids})
    meets = {anchor_id: _meets(blocks, plain, anchor_id, 2.0 * range_sigma_m) for anchor_id in ids}
    if len(ids) <= d + 1 or min(meets.values()) >= FITS:
        return None
    # one whose ranges mostly meet the others' from where it is said to stand, stands there
    suspects = sorted([i for i in ids if meets[i] < FITS], key=lambda anchor_id: meets[anchor_id])[:MOST_SUSPECTS]
    few = [blocks[number] for number in np.unique(np.linspace(0, len(blocks) - 1, FEW_BLOCKS).astype(int))]
    swaps = [
        _swap(blocks, plain, pair, d, range_sigma_m, speed_m_per_s)
        for pair in itertools.combinations(sorted(suspects), 2)
        if _swap(few, plain, pair, d, range_sigma_m, speed_m_per_s) is not None
    ]
    moves = [_elsewhere(blocks, plain, anchor_id, d, range_sigma_m, speed_m_per_s) for anchor_id in suspects]
    swap, move = (_surest([one for one in some if one is not None]) for some in (swaps, moves))
    # a swap explains two anchors with nothing to fit
    return move if move is not None and (swap is None or move[0] > swap[0] + RATHER_NATS) else swap


def _surest(found: Sequence[tuple[float, Suspicion]]) -> tuple[float, Suspicion] | None:
    """The one that gains most, where it gains enough and clearly more than another."""
    best = sorted(found, key=lambda one: -one[0])
    if not best or best[0][0] < GAINED_NATS or (len(best) > 1 and best[1][0] > best[0][0] - CLEARLY_NATS):
        return None
    return best[0]


def _fit(blocks: Sequence[Block], d: int, sigma_m: float, speed_m_per_s: float) -> SharedFit | None:
    return shared_fit(blocks, 2 if d == 2 else 3, sigma_m, speed_m_per_s, "nothing")


def _meets(blocks: Sequence[Block], fit: SharedFit, anchor_id: str, sigma_m: float) -> float:
    """Share of an anchor's ranges that meet the others of their block."""
    off_m = _offs(blocks, fit, anchor_id)
    return float((np.abs(off_m) < NEAR * sigma_m).mean()) if len(off_m) else 1.0


def _offs(blocks: Sequence[Block], fit: SharedFit, anchor_id: str) -> Floats:
    return np.array([
        fit.residuals_m[row, column]
        for row, block in enumerate(blocks)
        for column, heard in enumerate(block.ids)
        if heard == anchor_id
    ])  # fmt: skip


def _from_own(blocks: Sequence[Block], fit: SharedFit, anchor_id: str) -> Floats:
    """What an anchor's ranges are off its own place, the rover being where the fit has it."""
    d = fit.places_m.shape[1]
    return np.array([
        block.ranges_m[column] - math.dist(block.anchors_m[column, :d], place_m)
        for block, place_m in zip(blocks, fit.places_m.tolist(), strict=True)
        for column, heard in enumerate(block.ids)
        if heard == anchor_id
    ])  # fmt: skip


def _lasts(blocks: Sequence[Block], fit: SharedFit, ids: Sequence[str], sigma_m: float) -> bool:
    """Whether most ranges of all these anchors meet the others', and many in both halves of the log."""
    for anchor_id in ids:
        off_m = _offs(blocks, fit, anchor_id)
        if len(off_m) < FEWEST or not _all_along(np.abs(off_m) < NEAR * sigma_m):
            return False
    return True


def _all_along(fits: npt.NDArray[np.bool_]) -> bool:
    return bool(fits.mean() >= FITS and min(half.mean() for half in np.array_split(fits, 2)) >= FITS_HALF)


def _never(fits: npt.NDArray[np.bool_], most: float) -> bool:
    """Whether no more of the ranges fit, in both halves of the log."""
    return max(float(half.mean()) for half in np.array_split(fits, 2)) <= most


def _swapped(block: Block, one: str, other: str) -> Block:
    if one not in block.ids and other not in block.ids:
        return block
    names = {one: other, other: one}
    anchors_m = np.array([block.places_m[names.get(anchor_id, anchor_id)] for anchor_id in block.ids])
    return replace(block, anchors_m=anchors_m)


def _swap(
    blocks: Sequence[Block],
    plain: SharedFit,
    pair: tuple[str, str],
    d: int,
    range_sigma_m: float,
    speed_m_per_s: float,
) -> tuple[float, Suspicion] | None:
    """(gain, what is said) of two anchors whose ranges meet the others' from each other's place, else None."""
    one, other = pair
    swapped = [_swapped(block, one, other) for block in blocks]
    fit = _fit(swapped, d, range_sigma_m, speed_m_per_s)
    if fit is None or not _lasts(swapped, fit, pair, min(max(range_sigma_m, fit.sigma_m), 2.0 * range_sigma_m)):
        return None
    if not all(_never(np.abs(_from_own(blocks, fit, one)) < NEAR * 2.0 * range_sigma_m, FITS_SOME) for one in pair):
        return None
    apart_m = math.dist(blocks[-1].places_m[one], blocks[-1].places_m[other])
    sentence = (
        f"The ranges of {one} and {other} fit each other's place, {apart_m:.1f} m away, and not their own: are the two "
        "ids swapped?"
    )
    gain = plain.misfit(range_sigma_m) - fit.misfit(range_sigma_m)
    return gain, Suspicion(Cause.SWAPPED, sentence, apart_m, anchor_ids=pair)


def _elsewhere(
    blocks: Sequence[Block], plain: SharedFit, anchor_id: str, d: int, range_sigma_m: float, speed_m_per_s: float
) -> tuple[float, Suspicion] | None:
    """(gain, what is said) of an anchor whose ranges meet the others' from elsewhere, or shorter, else None."""
    others = [_without(block, anchor_id) for block in blocks]
    kept = [number for number, block in enumerate(others) if len(block.ids) > d and anchor_id in blocks[number].ids]
    fit = _fit([others[number] for number in kept], d, range_sigma_m, speed_m_per_s) if len(kept) >= FEWEST else None
    if fit is None or fit.sigma_m > 2.0 * range_sigma_m:
        return None
    heard_by = np.isfinite(fit.residuals_m).sum(axis=1)
    agree = (np.abs(fit.residuals_m) < NEAR * max(range_sigma_m, fit.sigma_m)).sum(axis=1)
    # one more than a place needs may meet by chance
    meeting = agree >= np.minimum(heard_by, d + 2)
    if meeting.sum() < FEWEST:
        return None
    columns = [blocks[number].ids.index(anchor_id) for number in kept]
    heard = _Ranges(
        fit.places_m[meeting],
        np.array([blocks[n].anchors_m[column, :d] for n, column in zip(kept, columns, strict=True)])[meeting],
        np.array([blocks[n].ranges_m[column] for n, column in zip(kept, columns, strict=True)])[meeting],
    )
    sigma_m = 2.0 * max(range_sigma_m, fit.sigma_m)  # of a range and of the rover's place together
    numbers = np.array(kept)[meeting]
    before = float(plain.misfits(range_sigma_m)[numbers].sum() - fit.misfits(range_sigma_m)[meeting].sum())
    told_m = heard.off_m(np.zeros(d))
    length_m = float(np.median(told_m))
    if not _never(np.abs(told_m) < NEAR * sigma_m, FITS_HARDLY):
        return None
    long = float((told_m < -NEAR * sigma_m).mean()) < SHORT
    lasts_s = blocks[kept[-1]].time_s - blocks[kept[0]].time_s
    shifts = [_shift(heard, start, ways, sigma_m) for ways in _ways(d) for start in _starts(heard)]
    off_m, shift_m, sigmas_m = min(shifts, key=lambda one: _cost(one[0], sigma_m) + NATS_A_WAY * (one[2] > 0.0).sum())
    size_m, simpler = float(np.hypot.reduce(shift_m)), min(_cost(told_m, sigma_m), _cost(told_m - length_m, sigma_m))
    if not _cost(off_m, sigma_m) < simpler - TELLS_NATS:
        if not (length_m < -NEAR * sigma_m and _all_along(np.abs(told_m - length_m) < NEAR * sigma_m)):
            return None
        short = _short(anchor_id, length_m, sigma_m / math.sqrt(len(kept)))
        return before - _cost(told_m - length_m, range_sigma_m), short
    fits = np.abs(off_m) < NEAR * sigma_m
    if not _all_along(fits) or size_m < TELLS * NEAR * range_sigma_m:
        return None
    surely = fits.mean() >= FITS_LONG and lasts_s >= LONG_S and length_m > BEYOND_OCCLUSION * range_sigma_m
    if long and not (surely and _cost(off_m, sigma_m) < FITS_LONG * simpler):
        return None
    moved = _moved(anchor_id, heard.told_m[-1] + shift_m, size_m, float(sigmas_m.max()))
    return before - _cost(off_m, range_sigma_m), moved


def _without(block: Block, anchor_id: str) -> Block:
    keep = np.array([heard != anchor_id for heard in block.ids])
    ids = tuple([heard for heard in block.ids if heard != anchor_id])
    return Block(block.anchors_m[keep], block.ranges_m[keep], block.late_s[keep], block.time_s, ids, block.places_m)


def _ways(d: int) -> list[npt.NDArray[np.bool_]]:
    """(d,) along which axes an anchor may be shifted: level, upright, or any way."""
    level = np.arange(d) < 2
    return [level, ~level, np.ones(d, np.bool_)] if d == 3 else [level]


def _starts(heard: _Ranges) -> list[Floats]:
    """Shifts (d,) to begin at: none, and a ring about the middle of the rover's places at the typical range."""
    d = heard.told_m.shape[1]
    middle_m, range_m = heard.rover_m.mean(axis=0), float(np.median(heard.ranges_m))
    turns = np.arange(STARTS) * 2.0 * math.pi / STARTS
    shifts_m = np.zeros((STARTS, d))
    shifts_m[:, 0], shifts_m[:, 1] = range_m * np.sin(turns), range_m * np.cos(turns)
    shifts_m[:, :2] += (middle_m - heard.told_m.mean(axis=0))[:2]
    return [np.zeros(d), *shifts_m]


def _shift(
    heard: _Ranges, start_m: Floats, ways: npt.NDArray[np.bool_], sigma_m: float
) -> tuple[Floats, Floats, Floats]:
    """(what ranges are off (m,), shift (d,) along these axes, its sigmas (d,)), far ranges weighed down."""
    shift_m, damping = np.where(ways, start_m, 0.0), 1e-2
    off_m = heard.off_m(shift_m)
    normal = np.eye(int(ways.sum()))
    for _ in range(STEPS):
        apart_m = heard.told_m + shift_m - heard.rover_m
        rows = apart_m[:, ways] / np.maximum(np.sqrt((apart_m * apart_m).sum(axis=1)), 1e-9)[:, None]
        typical_m = max(sigma_m, 1.5 * float(np.median(np.abs(off_m))))
        weights = (1.0 + (off_m / (NEAR * typical_m)) ** 2) ** -2
        normal = (rows * weights[:, None]).T @ rows
        damped = normal + (damping * float(normal.trace()) / len(normal) + 1e-9) * np.eye(len(normal))
        new_m = shift_m.copy()
        new_m[ways] += np.linalg.solve(damped, rows.T @ (weights * off_m))
        new_off_m = heard.off_m(new_m)
        better = _cost(new_off_m, typical_m) <= _cost(off_m, typical_m)
        damping = 0.2 * damping if better else 5.0 * damping
        if better:
            shift_m, off_m = new_m, new_off_m
    sigmas_m = np.zeros(len(ways))
    sigmas_m[ways] = sigma_m * np.sqrt(np.linalg.pinv(normal).diagonal().clip(1e-12))
    return off_m, shift_m, sigmas_m


def _cost(off_m: Floats, sigma_m: float) -> float:
    size = off_m / sigma_m
    return 0.5 * float(np.minimum(size * size, NEAR * NEAR).sum())


def _moved(anchor_id: str, place_m: Floats, size_m: float, sigma_m: float) -> Suspicion:
    east_m, north_m, *up_m = place_m.tolist()
    height = f", altitude {up_m[0]:.1f}" if up_m else ""
    sentence = (
        f"The ranges of {anchor_id} do not fit where it is said to stand, but {size_m:.1f} m away, about east "
        f"{east_m:.1f}, north {north_m:.1f}{height} m (± {sigma_m:.1f} m): was it moved, or its place mistyped?"
    )
    return Suspicion(Cause.MOVED, sentence, size_m, sigma_m, (anchor_id,))


def _short(anchor_id: str, length_m: float, sigma_m: float) -> Suspicion:
    sentence = (
        f"The ranges of {anchor_id} are about {-length_m:.2f} m too short throughout (± {max(sigma_m, 0.005):.2f} m), "
        "which no occlusion explains: calibrate that anchor."
    )
    return Suspicion(Cause.ANCHOR_OFFSET, sentence, length_m, sigma_m, (anchor_id,))
