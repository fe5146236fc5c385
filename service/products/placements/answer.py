"""A placement as the service answers it: chosen places, how good they are, maps before and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from service.parts.map_facts import MapSummary
from service.parts.positioning_answers import PlacedAnchor
from terrain import ElevationGrid
from visibility import Anchor

from .request import PlacementParameters

__all__ = [
    "CandidatesOut",
    "DilutionOut",
    "FinishedPlacement",
    "HoverOut",
    "InItsUnit",
    "PlacedOut",
    "PlacementSummary",
    "TargetsOut",
    "share",
]


def _absent(value: object) -> bool:
    return value is None


def share(what: str) -> Any:
    """A share of a goal that is one."""
    return Field(None, exclude_if=_absent, description=f"{what}, 0..1; for coverage and dop.")


def _metres(what: str) -> Any:
    return Field(None, exclude_if=_absent, description=f"{what}, metres; for errors.")


class InItsUnit(BaseModel):
    """Numbers of a goal, as shares for coverage and dop, in metres for errors; the other unit's are left out."""

    def number(self, name: str) -> float:
        """A number by its name without the unit."""
        share, metres = getattr(self, f"{name}_share"), getattr(self, f"{name}_m")
        value: float = metres if share is None else share
        return value


class PlacedOut(InItsUnit):
    """A placed anchor; shares for coverage and dop, metres for errors."""

    id: str = Field(description="Name of the anchor, in the order in which each adds most.")
    what: str = Field(description="drone, mast or site.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    above_ground_m: float | None = Field(description="Height above known ground, metres.")
    marginal_share: float | None = share("What it added to the value when it came")
    marginal_m: float | None = _metres("By how much it made the value less when it came")
    after_loss_share: float | None = share("The value once it alone is lost")
    after_loss_m: float | None = _metres("The value once it alone is lost")


class CandidatesOut(BaseModel):
    """What became of the candidates."""

    left: int = Field(description="How many candidates kept every rule.")
    removed: dict[str, int] = Field(description="How many each rule took away, in the order of the rules.")


class DilutionOut(BaseModel):
    """How well spread all anchors are, over the targets and by their weight."""

    measure: str = Field(description="gdop, pdop, hdop or vdop, as the goal says.")
    median: float | None = Field(description="Half the targets have at most this (no unit); null if half have no fix.")
    within_limit_share: float = Field(description="Share of the targets with less than the goal's dop_limit, 0..1.")
    no_fix_share: float = Field(description="Share of the targets without any fix, 0..1.")
    useless_share: float | None = Field(
        description="Of the targets that see enough anchors for a fix: the share above 20 or without one, 0..1; null "
        "where there are none. A warning tells when it is most of them."
    )


class HoverOut(InItsUnit):
    """The value when every placed anchor hovers off its place; shares or metres."""

    hover_m: float = Field(description="Off by up to so much in each direction, metres.")
    draws: int = Field(description="How many random ones there were.")
    mean_share: float | None = share("Mean of the draws")
    mean_m: float | None = _metres("Mean of the draws")
    worst_share: float | None = share("Worst of the draws")
    worst_m: float | None = _metres("Worst of the draws")
    lower_share: float | None = share("With all anchors so much lower")
    lower_m: float | None = _metres("With all anchors so much lower")
    higher_share: float | None = share("With all anchors so much higher")
    higher_m: float | None = _metres("With all anchors so much higher")


class TargetsOut(BaseModel):
    """Where anchors had to be seen."""

    what: str = Field(description="area, corridor or path.")
    points: int = Field(description="How many points were asked about.")
    left_out: int = Field(description="How many places on unknown ground or outside the DEM were not.")
    within_limits_m: float | None = Field(description="Of a path: metres of it that reach the goal; null for others.")


class PlacementSummary(MapSummary, InItsUnit):
    """What was placed and what it is worth; shares 0..1 for coverage and dop, metres for errors."""

    objective: str = Field(description="coverage, dop, mean_error or worst_error.")
    goal: str = Field(description="The same in words, with its limits.")
    placed: list[PlacedOut]
    candidates: CandidatesOut
    dilution: DilutionOut
    hover: HoverOut
    method: str = Field(description="exact, local search or greedy.")
    proved: bool = Field(description="Whether no other choice is better.")
    stopped: bool = Field(description="Whether a time limit or somebody ended the search: this is the best so far.")
    statement: str = Field(description="What is proved about greedy for this goal.")
    fixed: list[PlacedAnchor] = Field(description="The anchors that were there before.")
    before_share: float | None = share("The value with those alone")
    before_m: float | None = _metres("The value with those alone")
    value_share: float | None = share("The value with the placed anchors")
    value_m: float | None = _metres("The value with the placed anchors")
    bound_share: float | None = share("What no choice exceeds")
    bound_m: float | None = _metres("What no choice falls below")
    gap_share: float | None = share("How far value and bound are apart")
    gap_m: float | None = _metres("How far value and bound are apart")
    greedy_share: float | None = share("What greedy alone reached")
    greedy_m: float | None = _metres("What greedy alone reached")
    exact_share: float | None = share("The value recomputed in mode exact")
    exact_m: float | None = _metres("The value recomputed in mode exact")
    least_after_loss_share: float | None = share("The same after the worst loss of one anchor")
    least_after_loss_m: float | None = _metres("The same after the worst loss of one anchor")
    fewest_possible: int | None = Field(
        description="No fewer anchors reach the share that was asked for; null where a number was."
    )
    targets: TargetsOut


@dataclass(frozen=True, eq=False)
class FinishedPlacement:
    """A finished placement; arrays (rows, cols).

    anchors: those that were there before. count_before, count_after: uint8, anchors surely in sight. dop_before,
    dop_after: float32, +inf = no fix, NaN = unknown. is_target: uint8, 1 where a post counts.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: PlacementParameters
    answer: PlacementSummary
    count_before: npt.NDArray[np.uint8]
    count_after: npt.NDArray[np.uint8]
    dop_before: npt.NDArray[np.float32]
    dop_after: npt.NDArray[np.float32]
    is_target: npt.NDArray[np.uint8]

    @property
    def chosen(self) -> tuple[Anchor, ...]:
        """The anchors that were placed."""
        sigma_m = self.parameters.goal.ranging_sigma_m
        return tuple(
            Anchor(one.id, one.east_m, one.north_m, one.altitude_m, ranging_sigma_m=sigma_m)
            for one in self.answer.placed
        )
