"""Frames that do not belong together: headings of another north, axes taken for one another, degrees for metres.

Ranges alone do not know how anchors are turned. What the rover is said to have driven, against where ranges say that it
went, does: turned by one angle all along, or mirrored.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..units import IMPOSSIBLE, POSSIBLE, impossible_share
from .suspicions import Cause, Suspicion
from .systematic import Block

__all__ = ["UNKNOWN_STEP", "Step", "frame_of_headings", "places_in_degrees"]

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

LEG_SIGMAS = 20.0  # of a place: a leg so long has a direction
LEGS = 10  # before all this means anything, and of them kept
KEPT = 0.8
ALIKE = 0.25  # share of a leg by which what is driven and where that leads may differ
LENGTHS = (0.8, 1.25)  # what is driven over how far that leads
PLAINLY = 4.0  # times as large an error the other explanation has to leave
# A north is another one from so many sigmas of the angle on, and radians: the legs of either half of the log agree.
TURNED_SIGMAS, TURNED_RAD, HALVES_RAD = 6.0, math.radians(1.5), math.radians(1.5)
BACKWARDS_RAD = math.radians(170.0)
RADII_M = (6_371_000.0, 3_389_500.0, 1_737_400.0)  # Earth, Mars, Moon
NARROW_DEG, LONGER = 3.0, 5.0  # anchors are so close together in degrees, and ranges so many times longer than that


@dataclass(frozen=True, slots=True)
class Step:
    """Motion up to an epoch as it was told, (east, north), and where ranges had the rover then; None = not known."""

    driven_m: tuple[float, float] | None
    place_m: tuple[float, float] | None


UNKNOWN_STEP = Step(None, None)


@dataclass(frozen=True, slots=True)
class _Turn:
    """What turns (or mirrors, then turns) legs as driven into legs as ranges have them. error_m2: of a leg."""

    factor: complex
    error_m2: float
    sigma_rad: float

    @property
    def clockwise_rad(self) -> float:
        """By how much."""
        return -cmath.phase(self.factor)


def frame_of_headings(steps: Sequence[Step], range_sigma_m: float) -> list[Suspicion]:
    """Whether headings count from another north than the anchors' frame, or the other way round; mostly nothing.

    value: radians clockwise by which headings have to be turned. A heading that drifts is no such fault.
    """
    driven, went = _legs(steps, LEG_SIGMAS * range_sigma_m)
    if len(driven) < LEGS:
        return []
    turned, mirrored = _fit(driven, went), _fit(driven.conj(), went)
    if _is_plain(mirrored, turned, driven):
        return [Suspicion(Cause.FRAME, _MIRRORED, mirrored.clockwise_rad, mirrored.sigma_rad)]
    if not _is_plain(turned, mirrored, driven):
        return []
    angle_rad, sigma_rad = turned.clockwise_rad, turned.sigma_rad
    if abs(angle_rad) < max(TURNED_RAD, TURNED_SIGMAS * sigma_rad):
        return []
    half = len(driven) // 2
    early, late = _fit(driven[:half], went[:half]), _fit(driven[half:], went[half:])
    apart_rad = abs(math.remainder(early.clockwise_rad - late.clockwise_rad, math.tau))
    if apart_rad > max(HALVES_RAD, TURNED_SIGMAS * math.hypot(early.sigma_rad, late.sigma_rad)):
        return []
    return [Suspicion(Cause.FRAME, _turned(angle_rad, sigma_rad), angle_rad, sigma_rad)]


def _turned(angle_rad: float, sigma_rad: float) -> str:
    sigma = f"(± {max(math.degrees(sigma_rad), 0.1):.1f}°)"
    if abs(angle_rad) > BACKWARDS_RAD:
        return f"Headings point away from where the rover goes {sigma}: are they of its tail, or counted from south?"
    return (
        f"Headings have to be turned by {math.degrees(angle_rad):+.1f}° {sigma} all along to lead where ranges do: do "
        "they count from true or magnetic north and anchors from grid north, or are the anchors' axes turned?"
    )


_MIRRORED = (
    "Headings turn the other way round than the rover does by its ranges: are east and north of the anchors taken for "
    "one another (NED for ENU), or are headings counted anticlockwise?"
)


def _is_plain(turn: _Turn, other: _Turn, driven: Complex) -> bool:
    """Whether this explains the legs, with their lengths, and the other does not."""
    size_m2 = float(np.mean(np.abs(driven) ** 2))
    fits = turn.error_m2 < ALIKE**2 * size_m2 and LENGTHS[0] < abs(turn.factor) < LENGTHS[1]
    return fits and other.error_m2 > PLAINLY * turn.error_m2


def _legs(steps: Sequence[Step], least_m: float) -> tuple[Complex, Complex]:
    """(legs as driven, the same as ranges have them), east + i·north, each about so long at least."""
    driven, went = [], []
    begin: complex | None = None
    sum_m = 0j
    for step in steps:
        if step.driven_m is None or step.place_m is None:
            begin = None if step.place_m is None else complex(*step.place_m)
            sum_m = 0j
            continue
        here = complex(*step.place_m)
        if begin is None:
            begin, sum_m = here, 0j
            continue
        sum_m += complex(*step.driven_m)
        if abs(sum_m) >= least_m:
            driven.append(sum_m)
            went.append(here - begin)
            begin, sum_m = here, 0j
    return np.array(driven, np.complex128), np.array(went, np.complex128)


def _fit(driven: Complex, went: Complex) -> _Turn:
    """Least squares, twice: the second time without the legs that fit worst, whose places were misled."""
    kept = np.ones(len(driven), np.bool_)
    for _ in range(2):
        size_m2 = float((np.abs(driven[kept]) ** 2).sum())
        factor = complex((driven[kept].conj() * went[kept]).sum()) / size_m2
        errors_m2 = np.abs(went - factor * driven) ** 2
        kept = errors_m2 <= np.quantile(errors_m2, KEPT)
    error_m2 = float(errors_m2[kept].mean())
    # half of an error is across the way; what was cut off had more of it
    return _Turn(factor, error_m2, math.sqrt(error_m2 / size_m2))


def places_in_degrees(blocks: Sequence[Block], dimension: int) -> list[Suspicion]:
    """Whether places of anchors are degrees that were taken for metres: ranges meet once they are converted."""
    if not blocks:
        return []
    level = np.concatenate([block.anchors_m[:, :2] for block in blocks])
    spread = float(np.ptp(level, axis=0).max())
    typical_m = float(np.median(np.concatenate([block.ranges_m for block in blocks])))
    if spread > NARROW_DEG or typical_m < LONGER * spread or np.abs(level).max() > 180.0:
        return []
    if impossible_share([(block.anchors_m, block.ranges_m) for block in blocks], min(dimension, 2), 1.0) < IMPOSSIBLE:
        return []
    for lon_first, order in ((True, "longitude, latitude"), (False, "latitude, longitude")):
        for radius_m in RADII_M:
            converted = [_in_metres(block, lon_first, radius_m) for block in blocks]
            if impossible_share([(one.anchors_m, one.ranges_m) for one in converted], dimension, 1.0) <= POSSIBLE:
                sizes = f"Anchors are {spread:.3g} apart at most and ranges {typical_m:.3g} m long"
                sentence = f"{sizes}: are their places in degrees ({order}), not in metres?"
                return [Suspicion(Cause.FRAME, sentence)]
    return []


def _in_metres(block: Block, lon_first: bool, radius_m: float) -> Block:
    lon_deg, lat_deg = block.anchors_m[:, (0, 1) if lon_first else (1, 0)].T
    metres = math.radians(radius_m)
    east_m = metres * lon_deg * math.cos(math.radians(float(np.mean(lat_deg))))
    return replace(block, anchors_m=np.column_stack([east_m, metres * lat_deg, block.anchors_m[:, 2]]))
