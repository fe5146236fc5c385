"""What is wanted of a placement."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from planning.errors import PlacementError
from visibility.dilution import DopKind, least_anchors

__all__ = ["Goal", "Objective"]

Objective = Literal["coverage", "dop", "mean_error", "worst_error"]
Measure = Literal["gdop", "pdop", "hdop", "vdop"]
USUAL_COVERAGE = 4  # anchors in sight, where coverage is asked for without a number


@dataclass(frozen=True, slots=True)
class Goal:
    """What is wanted at the targets.

    objective: "coverage", the share of targets with at least ``min_anchors`` in sight (None = 4); "dop", the share that
        has a dilution of precision (``measure``) below ``dop_limit`` as well (None = as many as a fix needs);
        "mean_error" and "worst_error", the position error in metres over the targets, where every error counts at most
        ``worst_counted_m``, and so much where fewer than ``min_anchors`` are in sight. None becomes "mean_error" with
        ``on_surface``: a rover on the ground, that is to know where it is.
    spare: how many anchors may be lost, any of them, 0 or 1: a target counts for what it has after the worst loss.
    ranging_sigma_m: of the anchors to be placed, for errors in metres.
    Raises PlacementError.
    """

    objective: Objective | None = None
    min_anchors: int | None = None
    dop_limit: float = 5.0
    measure: Measure = "pdop"
    kind: DopKind = "ranging"
    on_surface: bool = False
    spare: int = 0
    ranging_sigma_m: float = 0.1
    worst_counted_m: float = 10.0

    def __post_init__(self) -> None:
        if self.objective is None:
            if self.measure in ("hdop", "vdop"):
                raise PlacementError(
                    f"{self.measure} goes with an objective: without one the error along the surface is placed for."
                )
            object.__setattr__(self, "objective", "mean_error")
            object.__setattr__(self, "on_surface", True)
        for name, value, options in (
            ("objective", self.objective, get_args(Objective)),
            ("measure", self.measure, get_args(Measure)),
            ("kind", self.kind, get_args(DopKind)),
        ):
            if value not in options:
                raise PlacementError(f"{name} must be one of {', '.join(options)}, not {value!r}.")
        if (self.min_anchors is not None and self.min_anchors < 1) or self.spare not in (0, 1):
            raise PlacementError(f"min_anchors must be >= 1 and spare 0 or 1, not {self.min_anchors} and {self.spare}.")
        for name in ("dop_limit", "ranging_sigma_m", "worst_counted_m"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise PlacementError(f"{name} must be a number > 0, not {getattr(self, name)}.")
        if self.on_surface and self.measure not in ("pdop", "gdop"):
            raise PlacementError(f"A rover bound to the ground has one dilution, pdop; {self.measure} is not defined.")
        if self.measure == "gdop" and self.kind == "pseudorange":
            raise PlacementError("The gdop of pseudoranges cannot be placed for; ask for pdop, hdop or vdop.")

    @property
    def wanted(self) -> Objective:
        """The objective, whether it was named or not."""
        return self.objective or "mean_error"

    @property
    def needed(self) -> int:
        """How many anchors must be in sight of a target before it can count, losses apart."""
        if self.objective == "coverage":
            return USUAL_COVERAGE if self.min_anchors is None else self.min_anchors
        least = least_anchors(self.kind, on_surface=self.on_surface)
        return max(self.min_anchors or 0, least)

    @property
    def needed_with_spare(self) -> int:
        """The same with the anchors that may be lost."""
        return self.needed + self.spare

    @property
    def is_share(self) -> bool:
        """Whether the objective is a share 0..1 of the targets; else it is metres."""
        return self.objective in ("coverage", "dop")

    @property
    def submodular(self) -> bool:
        """Whether greedy is within 1 − 1/e of the best: sharing out sight of one anchor, and of nothing else."""
        return self.objective == "coverage" and self.min_anchors == 1 and self.spare == 0

    def sentence(self, counted: str = "in sight") -> str:
        """In words. counted: what an anchor is called that counts."""
        lost = ", whichever one anchor is lost" if self.spare else ""
        along = " along the surface" if self.on_surface else ""
        of_ranges = f"{along} of {self.kind} with a sigma of {self.ranging_sigma_m:g} m"
        if self.min_anchors is not None:
            of_ranges += f" and at least {self.needed} {counted}"
        measure = f"{self.measure.upper()}{along} of {self.kind}"
        return {
            "coverage": f"share with at least {self.needed} {counted}{lost}",
            "dop": f"share with at least {self.needed} {counted} and {measure} < {self.dop_limit:g}{lost}",
            "mean_error": f"mean position error{of_ranges}, metres, counted up to {self.worst_counted_m:g} m{lost}",
            "worst_error": f"worst position error{of_ranges}, metres, counted up to {self.worst_counted_m:g} m{lost}",
        }[self.wanted]
