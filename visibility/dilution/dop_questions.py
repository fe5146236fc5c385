"""What is asked of dilutions: kinds, reasons, visible sets, sources, and the limits that a flight needs kept."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from visibility.dilution.kernels import dop as kernel
from visibility.dilution.kernels.normal_matrices import Sources
from visibility.errors import VisibilityInputError
from visibility.sight.sight_points import checked_positions

__all__ = [
    "DopKind",
    "DopReason",
    "FlightLimit",
    "Measure",
    "Sources",
    "check_geometry",
    "geometry_fault",
    "kind_code",
    "least_anchors",
    "pack_sets",
    "set_words",
    "unit_normals",
]

DopKind = Literal["ranging", "pseudorange", "tdoa"]
Measure = Literal["gdop", "pdop", "hdop", "vdop", "tdop"]

KIND_CODES = {"ranging": kernel.RANGING, "pseudorange": kernel.PSEUDORANGE, "tdoa": kernel.TDOA}


class DopReason(enum.IntEnum):
    """Why a dilution of precision is what it is; everything but OK is not a finite number.

    TOO_FEW: fewer visible anchors than unknowns, +inf. SINGULAR: they fix no position, all on one line or cone for
    example, +inf. UNKNOWN: it is not known which anchors are visible, NaN.
    """

    OK = kernel.OK
    TOO_FEW = kernel.TOO_FEW
    SINGULAR = kernel.SINGULAR
    UNKNOWN = kernel.UNKNOWN


def kind_code(kind: str) -> int:
    """The kernels' number of a kind; raises VisibilityInputError."""
    if kind not in get_args(DopKind):
        raise VisibilityInputError(f"kind must be one of {', '.join(get_args(DopKind))}, not {kind!r}.")
    return KIND_CODES[kind]


def least_anchors(kind: DopKind, *, on_surface: bool = False) -> int:
    """How many anchors a fix needs at least: one per unknown, and one more where the clock is not known."""
    return (2 if on_surface else 3) + (kind_code(kind) != kernel.RANGING)


def set_words(anchors: int) -> int:
    """How many 64-bit words a visible set of so many anchors takes."""
    return max((anchors + 63) // 64, 1)


def pack_sets(visible: npt.ArrayLike) -> npt.NDArray[np.uint64]:
    """(n, words) uint64 bit masks of visible sets (n, k) bool: bit a of word a // 64 is anchor a."""
    sets = np.asarray(visible, np.bool_)
    if sets.ndim != 2:
        raise VisibilityInputError(f"visible must be (points, anchors), not shape {sets.shape}.")
    bits = np.zeros((sets.shape[0], set_words(sets.shape[1]) * 64), np.bool_)
    bits[:, : sets.shape[1]] = sets
    words: npt.NDArray[np.uint64] = np.packbits(bits, axis=1, bitorder="little").view("<u8").astype(np.uint64)
    return words


def numbers(name: str, values: npt.ArrayLike, what: str) -> npt.NDArray[np.float64]:
    """C-contiguous float64 copy; raises VisibilityInputError naming what should have been numbers."""
    try:
        return np.array(values, np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise VisibilityInputError(f"{name} must hold numbers, {what} ({error}).") from error


def sources_of(
    anchor_positions_m: npt.ArrayLike,
    distant: npt.ArrayLike | None,
    variances_m2: npt.NDArray[np.float64] | None = None,
) -> Sources:
    """Anchors as the kernels take them, distant ones as unit directions; raises VisibilityInputError."""
    anchors = checked_positions("anchor_positions_m", anchor_positions_m)
    far = np.zeros(len(anchors), np.bool_)
    if distant is not None:
        try:
            far[:] = np.asarray(distant, np.bool_)
        except ValueError as error:
            raise VisibilityInputError(
                f"distant must be one yes or no, or one for each of the {len(anchors)} anchors, "
                f"not shape {np.shape(distant)}."
            ) from error
    length = np.sqrt((anchors[far] ** 2).sum(axis=1, keepdims=True))
    if (length == 0.0).any():
        first = int(np.flatnonzero(far)[np.argmax(length == 0.0)])
        raise VisibilityInputError(f"anchor_positions_m[{first}] is distant, so it must be a direction of some length.")
    anchors[far] /= length
    return Sources(anchors, far, np.empty((0, 7)) if variances_m2 is None else variances_m2)


def unit_normals(surface_normal: npt.ArrayLike | None, points: int) -> npt.NDArray[np.float64]:
    """Unit normals (points, 3), (1, 3) for all, or (0, 3) for none; NaN stays NaN. Raises VisibilityInputError."""
    if surface_normal is None:
        return np.empty((0, 3))
    normals = np.atleast_2d(numbers("surface_normal", surface_normal, "its east, north and up components"))
    if normals.ndim != 2 or normals.shape[1] != 3 or normals.shape[0] not in (1, points):
        raise VisibilityInputError(
            f"surface_normal must be one east, north, up vector, or one for each of the {points} points, "
            f"not shape {np.shape(surface_normal)}."
        )
    length = np.sqrt((normals**2).sum(axis=1, keepdims=True))
    if (length == 0.0).any() or np.isinf(length).any():
        raise VisibilityInputError("surface_normal must be a vector of some finite length.")
    unit: npt.NDArray[np.float64] = normals / length
    return unit


MEASURES = {
    "gdop": kernel.GDOP,
    "pdop": kernel.PDOP,
    "hdop": kernel.HDOP,
    "vdop": kernel.VDOP,
    "tdop": kernel.TDOP,
}
SAME_LINE = 1e-6  # of the spread along it


@dataclass(frozen=True, slots=True)
class FlightLimit:
    """A place is no-flight zone where the dilution is ``dop_limit`` or more, or too few anchors are in sight (eq. 15).

    measure: which dilution; De Vivo's (eq. 16) is "pdop". kind: what the ranges are, as for ``dop``.
    anchors: how many must be in sight; None = as few as give a fix.
    Raises VisibilityInputError.
    """

    dop_limit: float
    measure: Measure = "pdop"
    kind: DopKind = "ranging"
    anchors: int | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.dop_limit) and self.dop_limit > 0.0):
            raise VisibilityInputError(f"dop_limit must be a number > 0, not {self.dop_limit}.")
        if self.measure not in get_args(Measure):
            raise VisibilityInputError(f"measure must be one of {', '.join(get_args(Measure))}, not {self.measure!r}.")
        kind_code(self.kind)
        if self.measure == "tdop" and self.kind != "pseudorange":
            raise VisibilityInputError(f"A limit on tdop needs kind 'pseudorange'; {self.kind!r} solves for no clock.")
        if self.anchors is not None and self.anchors < 1:
            raise VisibilityInputError(f"anchors must be >= 1, or None for as few as give a fix, not {self.anchors}.")

    @property
    def needed_anchors(self) -> int:
        """How many anchors must be in sight."""
        return max(least_anchors(self.kind), self.anchors or 0)

    @property
    def codes(self) -> tuple[int, int]:
        """(kind, measure) as the kernels number them; where no clock is solved for, GDOP is PDOP."""
        no_clock = self.kind != "pseudorange" and self.measure == "gdop"
        return kind_code(self.kind), kernel.PDOP if no_clock else MEASURES[self.measure]


def check_geometry(limit: FlightLimit, sources: Sources) -> None:
    """Refuse anchors that fix no position anywhere: too few, all on one line, or distant ones in one plane.

    Raises VisibilityInputError.
    """
    fault = geometry_fault(limit, sources)
    if fault is not None:
        raise VisibilityInputError(fault)


def geometry_fault(limit: FlightLimit, sources: Sources) -> str | None:
    """Why these anchors fix no position anywhere, in a sentence; None where they may."""
    anchors, distant, _ = sources
    if len(anchors) < limit.needed_anchors:
        have = f"{len(anchors)} {'is' if len(anchors) == 1 else 'are'} given"
        return f"A map of {limit.measure} from {limit.kind} needs at least {limit.needed_anchors} anchors; {have}."
    if not distant.any():
        spread = np.linalg.svd(anchors - anchors.mean(axis=0), compute_uv=False)
        if spread[1] <= SAME_LINE * spread[0]:
            return (
                f"All {len(anchors)} anchors stand on one line, from which no position can be fixed; move one off it."
            )
    elif distant.all():
        spread = np.linalg.svd(anchors, compute_uv=False)
        if len(spread) < 3 or spread[2] <= SAME_LINE * spread[0]:
            return (
                f"All {len(anchors)} distant anchors lie in one plane with the receiver, so no position can be fixed; "
                "add one in another direction."
            )
    return None
