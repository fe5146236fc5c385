"""A placement as it is asked, brought into the grid's frame for the libraries, and as it is answered."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from planning.placement import (
    Candidates,
    Goal,
    Link,
    PlacementRules,
    SearchOptions,
    SightOptions,
    Targets,
    area_targets,
    candidate_grid,
    candidate_points,
    corridor_targets,
    join_candidates,
    path_targets,
)
from service.parts.anchors import SightParameters
from service.parts.map_area import MapArea, map_area, refuse_outside
from service.parts.map_facts import MapSummary, curvature_of
from service.parts.points import PolygonIn, StandOffIn
from service.parts.positioning_answers import PlacedAnchor
from service.parts.shapes_in_grid import (
    places_in_grid,
    polygon_in_grid,
    resolve_anchor,
    resolve_point,
    stand_off_in_grid,
    weights_in_grid,
)
from terrain import ElevationGrid
from visibility import Anchor

from .request import CandidatesIn, GoalIn, PlacementParameters, RulesIn, TargetsIn

__all__ = [
    "CandidatesOut",
    "DilutionOut",
    "HoverOut",
    "InItsUnit",
    "PlacedOut",
    "PlacementQuestion",
    "PlacementSummary",
    "TargetsOut",
    "areas_of_placement",
    "areas_of_rules",
    "goal_of",
    "placement_question",
    "rules_of",
    "sight_of",
]


@dataclass(frozen=True, slots=True, eq=False)
class PlacementQuestion:
    """The arguments of ``place_anchors``."""

    candidates: Candidates
    targets: Targets
    goal: Goal
    rules: PlacementRules
    fixed: tuple[Anchor, ...]
    sight: SightOptions
    options: SearchOptions


def placement_question(grid: ElevationGrid, asked: PlacementParameters) -> PlacementQuestion:
    """The question in the grid's frame. Raises AreaError, PlacementError, RequestError, FrameError, AnchorError."""
    area = map_area(grid, asked.area)
    return PlacementQuestion(
        join_candidates([_candidates(area, some, number) for number, some in enumerate(asked.candidates)]),
        _targets(area, asked),
        goal_of(asked.goal),
        rules_of(grid, asked.rules),
        tuple(resolve_anchor(grid, anchor) for anchor in asked.anchors),
        sight_of(asked),
        SearchOptions(seed=asked.seed),
    )


def _candidates(within: MapArea, asked: CandidatesIn, number: int) -> Candidates:
    """One set of candidates; a lattice lies in the request's area unless it names its own."""
    grid = within.grid
    if asked.places is not None:
        return candidate_points(
            *(grid, places_in_grid(grid, asked.places)),
            above_ground_m=asked.above_ground_m,
            altitude_m=asked.altitude_m,
            what=asked.what,
        )
    assert asked.spacing_m is not None, "the schema has seen to it"
    area = within.shape if asked.area is None else polygon_in_grid(grid, asked.area, f"candidates[{number}].area")
    return candidate_grid(
        *(grid, asked.spacing_m),
        above_ground_m=asked.above_ground_m,
        altitude_m=asked.altitude_m,
        area=area,
        what=asked.what,
    )


def _targets(within: MapArea, request: PlacementParameters) -> Targets:
    """Where anchors have to be seen."""
    grid, asked = within.grid, request.targets
    height_m, weight = asked.receiver_above_ground_m, _weight(within, asked)
    if asked.path is None:
        area = None if asked.area is None else polygon_in_grid(grid, asked.area, "targets.area")
        return area_targets(grid, height_m, area=area, weight=weight)
    path_m = places_in_grid(grid, asked.path)
    refuse_outside(grid, request.area, path_m, "targets.path[{}]")
    if asked.corridor_width_m is not None:
        return corridor_targets(grid, path_m, asked.corridor_width_m, height_m, weight=weight)
    return path_targets(grid, path_m, height_m)


def _weight(within: MapArea, asked: TargetsIn) -> npt.NDArray[np.float64] | None:
    """(rows, cols) what each post counts, nothing outside the request's area; None where all count the same."""
    worth = weights_in_grid(within.grid, asked.weights, "targets.weights")
    if within.shape is None:
        return worth
    counted = within.over_all().astype(np.float64)
    return counted if worth is None else counted * worth


def goal_of(asked: GoalIn) -> Goal:
    """What is good."""
    return Goal(**asked.model_dump())


def rules_of(grid: ElevationGrid, asked: RulesIn) -> PlacementRules:
    """Where anchors may be."""
    link = None
    if asked.link is not None:
        bases_m = tuple(
            resolve_point(grid, base, f"rules.link.bases[{number}]") for number, base in enumerate(asked.link.bases)
        )
        link = Link(bases_m, _unlimited(asked.link.max_range_m), asked.link.relays)
    return PlacementRules(
        no_fly=tuple(polygon_in_grid(grid, p, f"rules.no_fly[{n}]") for n, p in enumerate(asked.no_fly)),
        stand_off=tuple(stand_off_in_grid(grid, one) for one in asked.stand_off),
        min_above_ground_m=asked.min_above_ground_m,
        max_above_ground_m=_unlimited(asked.max_above_ground_m),
        max_altitude_m=_unlimited(asked.max_altitude_m),
        max_range_m=_unlimited(asked.max_range_m),
        min_separation_m=asked.min_separation_m,
        link=link,
    )


def sight_of(asked: SightParameters) -> SightOptions:
    """How sight is worked out."""
    return SightOptions(asked.mode, curvature_of(asked), unknown="open" if asked.unknown == "open" else "unknown")


def areas_of_rules(rules: RulesIn) -> dict[str, Sequence[PolygonIn | StandOffIn]]:
    """Areas by the names of their fields."""
    return {"rules.no_fly": rules.no_fly, "rules.stand_off": rules.stand_off}


def areas_of_placement(asked: PlacementParameters) -> dict[str, Sequence[PolygonIn | StandOffIn]]:
    """All areas by the names of their fields, but those in which anything must lie."""
    return {
        **areas_of_rules(asked.rules),
        "targets.weights": [one.polygon for one in asked.targets.weights],
        "candidates.area": [some.area for some in asked.candidates if some.area is not None],
    }


def _unlimited(value: float | None) -> float:
    return math.inf if value is None else value


def _absent(value: object) -> bool:
    return value is None


def _share(what: str) -> Any:
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
    marginal_share: float | None = _share("What it added to the value when it came")
    marginal_m: float | None = _metres("By how much it made the value less when it came")
    after_loss_share: float | None = _share("The value once it alone is lost")
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
    mean_share: float | None = _share("Mean of the draws")
    mean_m: float | None = _metres("Mean of the draws")
    worst_share: float | None = _share("Worst of the draws")
    worst_m: float | None = _metres("Worst of the draws")
    lower_share: float | None = _share("With all anchors so much lower")
    lower_m: float | None = _metres("With all anchors so much lower")
    higher_share: float | None = _share("With all anchors so much higher")
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
    before_share: float | None = _share("The value with those alone")
    before_m: float | None = _metres("The value with those alone")
    value_share: float | None = _share("The value with the placed anchors")
    value_m: float | None = _metres("The value with the placed anchors")
    bound_share: float | None = _share("What no choice exceeds")
    bound_m: float | None = _metres("What no choice falls below")
    gap_share: float | None = _share("How far value and bound are apart")
    gap_m: float | None = _metres("How far value and bound are apart")
    greedy_share: float | None = _share("What greedy alone reached")
    greedy_m: float | None = _metres("What greedy alone reached")
    exact_share: float | None = _share("The value recomputed in mode exact")
    exact_m: float | None = _metres("The value recomputed in mode exact")
    least_after_loss_share: float | None = _share("The same after the worst loss of one anchor")
    least_after_loss_m: float | None = _metres("The same after the worst loss of one anchor")
    fewest_possible: int | None = Field(
        description="No fewer anchors reach the share that was asked for; null where a number was."
    )
    targets: TargetsOut
