"""What makes air flyable and ground drivable: a limit on a dilution of precision, and enough anchors in sight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import get_args

import numpy as np

from visibility.dilution.dop_questions import DopKind, Measure, Sources, kind_code, least_anchors
from visibility.dilution.kernels import dilution as kernel
from visibility.errors import VisibilityInputError

__all__ = ["FlightLimit", "check_geometry", "geometry_fault"]

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
