"""A placement as it is asked, brought into the grid's frame for the libraries."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely

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
    candidate_sites,
    corridor_targets,
    join_candidates,
    path_targets,
)
from service.parts.anchors import SightParameters
from service.parts.doubts import doubted_anchors
from service.parts.map_area import MapArea, map_area, refuse_outside
from service.parts.map_facts import curvature_of
from service.parts.points import PolygonIn, StandOffIn
from service.parts.shapes_in_grid import (
    anchors_in_grid,
    places_in_grid,
    polygon_in_grid,
    resolve_point,
    stand_off_in_grid,
    weights_in_grid,
)
from terrain import ElevationGrid
from visibility import Anchor

from .request import CandidatesIn, GoalIn, PlacementParameters, RulesIn, TargetsIn

__all__ = [
    "PlacementQuestion",
    "areas_of_placement",
    "areas_of_rules",
    "goal_of",
    "placement_question",
    "rules_of",
    "sight_of",
]


@dataclass(frozen=True, slots=True, eq=False)
class PlacementQuestion:
    """The arguments of ``place_anchors``. passed_over: what of the doubts about the fixed anchors changes nothing."""

    candidates: Candidates
    targets: Targets
    goal: Goal
    rules: PlacementRules
    fixed: tuple[Anchor, ...]
    sight: SightOptions
    options: SearchOptions
    passed_over: tuple[str, ...]


def placement_question(
    grid: ElevationGrid,
    asked: PlacementParameters,
    progress: Callable[[float], None] | None = None,
    *,
    propose: bool = True,
) -> PlacementQuestion:
    """The question in the grid's frame; without propose the best sites, which take seconds, are left out.

    Raises AreaError, PlacementError, RequestError, FrameError, AnchorError.
    """
    area = map_area(grid, asked.area)
    fixed, passed_over = doubted_anchors(grid, anchors_in_grid(grid, asked), asked.doubts)
    targets = _targets(area, asked)
    sets = [
        _candidates(area, some, number) if some.best_sites is None else _sites(area, asked, number, targets, progress)
        for number, some in enumerate(asked.candidates)
        if propose or some.best_sites is None
    ]
    return PlacementQuestion(
        join_candidates(sets) if sets else Candidates(np.zeros((0, 3)), np.zeros(0), ()),
        targets,
        goal_of(asked.goal, asked.reach),
        rules_of(grid, asked.rules),
        fixed,
        replace(sight_of(asked), radio=None if asked.radio is None else asked.radio.radio()),
        SearchOptions(seed=asked.seed),
        passed_over,
    )


def _sites(
    within: MapArea,
    asked: PlacementParameters,
    number: int,
    targets: Targets,
    progress: Callable[[float], None] | None,
) -> Candidates:
    """One set of candidates as a map of sites proposes them."""
    some = asked.candidates[number]
    assert some.best_sites is not None, "it is asked for"
    return candidate_sites(
        *(within.grid, some.best_sites, targets),
        above_ground_m=some.above_ground_m,
        area=_area_of(within, some, number),
        max_range_m=_unlimited(asked.rules.max_range_m),
        what=some.what,
        curvature=curvature_of(asked),
        progress=progress,
    )


def _area_of(within: MapArea, asked: CandidatesIn, number: int) -> shapely.Geometry | None:
    """The request's area, unless the set names its own."""
    return (
        within.shape if asked.area is None else polygon_in_grid(within.grid, asked.area, f"candidates[{number}].area")
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
    return candidate_grid(
        *(grid, asked.spacing_m),
        above_ground_m=asked.above_ground_m,
        altitude_m=asked.altitude_m,
        area=_area_of(within, asked, number),
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


def goal_of(asked: GoalIn, reach: float | None = None) -> Goal:
    """What is good; a share to reach, where nothing else is asked for, is one of coverage."""
    said = asked.model_dump()
    return Goal(**said | {"objective": "coverage"}) if asked.objective is None and reach is not None else Goal(**said)


def rules_of(grid: ElevationGrid, asked: RulesIn) -> PlacementRules:
    """Where anchors may be."""
    link = None
    if asked.link is not None:
        bases_m = tuple(
            resolve_point(grid, base, f"rules.link.bases[{number}]") for number, base in enumerate(asked.link.bases)
        )
        radio = None if asked.link.radio is None else asked.link.radio.radio()
        link = Link(bases_m, _unlimited(asked.link.max_range_m), asked.link.relays, radio)
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
