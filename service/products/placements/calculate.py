"""Anchor placement as the service answers it: chosen places, how good they are, maps before and after."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping

from planning.placement import (
    Cluster,
    Placement,
    PlacementGeometry,
    PlacementMaps,
    check_placement,
    hover_sensitivity,
    place_anchors,
    placement_geometry,
    placement_maps,
)
from service.errors import RequestError
from service.files.mission_files import above_sea_level, mission_warnings
from service.parts.map_area import MapArea, map_area
from service.parts.map_facts import preamble
from service.parts.positioning_answers import placed_anchors
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import told_of_areas
from service.products import UNWATCHED, Work
from terrain import ElevationGrid

from .answer import (
    CandidatesOut,
    DilutionOut,
    FinishedPlacement,
    HoverOut,
    PlacedOut,
    PlacementSummary,
    TargetsOut,
)
from .question import areas_of_placement, placement_question
from .request import PlacementParameters

__all__ = ["calculate_placement", "cluster_of"]

HOVER_M = 10.0
SHARE_OF_SITES, SHARE_OF_SEARCH = 0.2, 0.9


@told_as_asked
def calculate_placement(
    grid: ElevationGrid, parameters: PlacementParameters, work: Work = UNWATCHED
) -> FinishedPlacement:
    """The placement that the parameters ask for on this grid, or the best found until work.stop.

    Raises PlacementError, ClusterError, RequestError, FrameError, AnchorError.
    """
    started_s = time.perf_counter()
    sites = any(some.best_sites is not None for some in parameters.candidates)
    begin = SHARE_OF_SITES if sites else 0.0
    question = placement_question(grid, parameters, work.part(0.0, begin))
    deadline_s = math.inf if parameters.time_limit_s is None else started_s + parameters.time_limit_s
    placement = place_anchors(
        grid,
        question.candidates,
        question.targets,
        parameters.count,
        question.goal,
        question.rules,
        reach=parameters.reach,
        fixed=question.fixed,
        sight=question.sight,
        options=question.options,
        progress=work.part(begin, SHARE_OF_SEARCH),
        cluster=cluster_of(parameters, work.scheduler),
        stop=lambda: time.perf_counter() > deadline_s or work.stop(),
    )
    maps = placement_maps(grid, placement, parameters.unknown)
    area = map_area(grid, parameters.area)
    geometry = placement_geometry(grid, placement)
    answer = _answer(area, parameters, placement, geometry, maps, question.passed_over, started_s)
    work.progress(1.0)
    return FinishedPlacement(
        area.box,
        question.fixed,
        parameters,
        answer,
        area.cut(maps.count_before),
        area.cut(maps.count_after),
        area.cut(maps.dop_before),
        area.cut(maps.dop_after),
        area.cut(maps.is_target),
    )


def cluster_of(parameters: PlacementParameters, scheduler: str | None) -> Cluster | None:
    """The cluster that the request asks for, None for this machine. Raises RequestError where there is none."""
    if parameters.run_on == "here":
        return None
    if scheduler is None:
        raise RequestError(
            f"run_on {parameters.run_on!r} needs a Dask scheduler, and none is set: the service takes its address from "
            "SIGHTLINE_DASK_SCHEDULER, the command line from --scheduler."
        )
    return Cluster(scheduler, or_local=parameters.run_on == "cluster_or_here")


def _answer(
    area: MapArea,
    asked: PlacementParameters,
    placement: Placement,
    geometry: PlacementGeometry,
    maps: PlacementMaps,
    passed_over: tuple[str, ...],
    started_s: float,
) -> PlacementSummary:
    grid = area.grid
    check = check_placement(grid, placement)
    hover = hover_sensitivity(grid, placement, HOVER_M)
    goal, targets = placement.goal, placement.targets

    def told(**numbers: float) -> Mapping[str, float]:
        """Numbers under their names with the goal's unit."""
        return {f"{name}_{'share' if goal.is_share else 'm'}": value for name, value in numbers.items()}

    placed = [
        PlacedOut(
            id=place.id,
            what=what,
            east_m=place.east_m,
            north_m=place.north_m,
            altitude_m=place.altitude_m,
            above_ground_m=place.above_ground_m,
            **told(marginal=float(gain), after_loss=check.after_loss[place.id]),
        )
        for place, gain, what in zip(
            placed_anchors(grid, placement.anchors), placement.marginal, placement.what, strict=True
        )
    ]
    more = (*passed_over, *area.sentences(), *(() if geometry.warning is None else (geometry.warning,)))
    return PlacementSummary(
        **preamble(
            *(area.box, asked, maps, (*placement.warnings, *more, *_warnings(grid, asked, placed))),
            mode=asked.mode,
            unknown=asked.unknown,
        ),
        timing={"calculation_s": time.perf_counter() - started_s, **placement.timing_s},
        objective=goal.wanted,
        goal=goal.sentence(asked.in_words),
        placed=placed,
        candidates=CandidatesOut(left=len(placement.feasible.candidates), removed=placement.feasible.removed),
        dilution=DilutionOut(
            measure=goal.measure,
            median=geometry.median if math.isfinite(geometry.median) else None,
            within_limit_share=geometry.within_limit,
            no_fix_share=geometry.no_fix,
            useless_share=geometry.useless,
        ),
        hover=HoverOut(
            hover_m=hover.hover_m,
            draws=hover.draws,
            **told(mean=hover.mean, worst=hover.worst, lower=hover.vertical_low, higher=hover.vertical_high),
        ),
        method=placement.method,
        proved=placement.proved,
        stopped=placement.stopped,
        statement=placement.statement,
        fixed=placed_anchors(grid, placement.fixed),
        fewest_possible=placement.needed,
        targets=TargetsOut(
            what=targets.what, points=len(targets), left_out=targets.left_out, within_limits_m=placement.within_limits_m
        ),
        **told(
            before=placement.before,
            value=placement.value,
            bound=placement.bound,
            gap=placement.gap,
            greedy=placement.greedy_value,
            exact=check.value,
            least_after_loss=check.least_after_loss,
        ),
    )


def _warnings(grid: ElevationGrid, asked: PlacementParameters, placed: list[PlacedOut]) -> tuple[str, ...]:
    """What to know about the question's areas and the answer's files."""
    told = (*told_of_areas(grid, areas_of_placement(asked)), *mission_warnings("placement", grid))
    nowhere = [one.id for one in placed if one.above_ground_m is None and one.what != "mast"]
    if nowhere and not above_sea_level(grid):
        told += (f"No plan is written for {', '.join(nowhere)}: how high the ground below is, is not known.",)
    return told
