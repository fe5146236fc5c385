"""Placements over a DEM that is read by windows, as the command line asks for them: coverage, with a range limit."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

from pydantic import BaseModel, Field

from planning.placement import (
    Candidates,
    WindowPlacement,
    WindowQuestion,
    candidate_grid,
    candidate_points,
    join_candidates,
    place_by_windows,
)
from service.errors import RequestError
from service.parts.areas import area_of
from service.parts.positioning_answers import PlacedAnchor
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import places_in_grid, polygon_in_grid, resolve_anchor
from service.products import UNWATCHED, Product, Work
from service.products.windows.answer import LargeGround
from service.products.windows.ground import ground_at, raster_of
from terrain import ElevationGrid, LargeDem, area_in, height_reference_of
from visibility import Anchor, Curvature
from visibility.sight.in_reach import Raster, name_of

from . import PLACEMENT
from .answer import CandidatesOut, InItsUnit, PlacedOut, share
from .calculate import cluster_of
from .question import goal_of, rules_of, sight_of
from .request import CandidatesIn, PlacementIn, PlacementParameters

__all__ = ["WINDOW_PLACEMENT", "WindowPlacementSummary"]

FILES = ("anchors.geojson", "anchors.csv")


class WindowTargets(BaseModel):
    """Where anchors had to be seen."""

    points: int = Field(description="How many posts of known ground counted.")


class WindowPlacementSummary(InItsUnit):
    """What was placed over a DEM that is read by windows; shares 0..1 of the posts that count."""

    version: str = Field(description="Of Sightline.")
    mode: str = Field(description="fast or exact.")
    error_statement: str = Field(description="Told by the value in mode exact, which stands beside it.")
    curvature: str = Field(description="How the ground curved.")
    unknown: str = Field(description="What a line over unknown ground is.")
    dem: LargeGround
    objective: str = "coverage"
    goal: str = Field(description="The same in words, with its limits.")
    placed: list[PlacedOut]
    candidates: CandidatesOut
    method: str = "greedy, then exchanges of one anchor until none is better"
    proved: bool = Field(description="Whether no other choice is better.")
    stopped: bool = Field(description="Whether a time limit or somebody ended it: this is the best so far.")
    fixed: list[PlacedAnchor] = Field(description="The anchors that were there before.")
    before_share: float | None = share("The value with those alone")
    value_share: float | None = share("The value with the placed anchors")
    bound_share: float | None = share("What no choice exceeds")
    gap_share: float | None = share("How far value and bound are apart")
    greedy_share: float | None = share("What greedy alone reached")
    exact_share: float | None = share("The value recomputed in mode exact")
    targets: WindowTargets
    read_by: str = Field(description="Who read the ground: this process, or workers of a Dask scheduler.")
    warnings: list[str]
    timing: dict[str, float] = Field(description="Seconds of wall clock: calculation_s, sight_s, search_s.")
    parameters: dict[str, object]


@dataclass(frozen=True, eq=False)
class FinishedWindowPlacement:
    """A finished placement by windows. grid: the frame of the DEM, without heights."""

    grid: ElevationGrid
    parameters: PlacementParameters
    answer: WindowPlacementSummary


@told_as_asked
def _calculated(
    grid: ElevationGrid, parameters: PlacementParameters, work: Work = UNWATCHED
) -> FinishedWindowPlacement:
    """The placement over the raster that ``grid`` is the frame of.

    Raises RequestError for what is not asked by windows, and what ``place_by_windows`` raises.
    """
    started_s = time.perf_counter()
    dem = raster_of(grid)
    _refuse(parameters)
    fixed = tuple(
        replace(_anchor(dem, grid, parameters, number), radio=None) for number in range(len(parameters.anchors))
    )
    question = WindowQuestion(
        goal_of(parameters.goal),
        rules_of(grid, parameters.rules),
        parameters.targets.receiver_above_ground_m,
        _served(grid, parameters),
        fixed,
        sight_of(parameters),
    )
    candidates = join_candidates([_candidates(dem, grid, parameters, n) for n in range(len(parameters.candidates))])
    deadline_s = math.inf if parameters.time_limit_s is None else started_s + parameters.time_limit_s
    assert parameters.count is not None, "a share to reach is refused"
    cluster = cluster_of(parameters, work.scheduler)
    found = place_by_windows(
        dem,
        candidates,
        parameters.count,
        question,
        cluster=cluster,
        folder=work.folder,
        progress=work.progress,
        stop=lambda: time.perf_counter() > deadline_s or work.stop(),
    )
    read_by = "this process" if cluster is None else f"workers of the Dask scheduler {cluster.address}"
    answer = _answer(dem, grid, parameters, found, read_by, started_s)
    return FinishedWindowPlacement(grid, parameters, answer)


def _refuse(asked: PlacementParameters) -> None:
    """What by windows is not looked at. Raises RequestError."""
    targets = asked.targets
    odd = {
        "a path": targets.path is not None,
        "weights": bool(targets.weights),
        "a share to reach (give a count)": asked.reach is not None,
        "best sites (give a lattice or places)": any(some.best_sites is not None for some in asked.candidates),
        "what is usable": asked.usable,
        "doubts": asked.doubts is not None,
        "what stands on the ground": asked.cover is not None,
        "unknown ground that blocks": asked.unknown == "blocked",
        "a link to a base": asked.rules.link is not None,
        "a seed (nothing is drawn)": asked.seed != 0,
    }
    named = [what for what, given in odd.items() if given]
    if named:
        raise RequestError(f"By windows anchors are not placed for {', '.join(named)}; take a part of the DEM whole.")


def _served(grid: ElevationGrid, asked: PlacementParameters):  # type: ignore[no-untyped-def]  # shapely has no types
    """The polygon of the targets; None: all known ground."""
    shape = None if asked.area is None else area_in(area_of(asked.area), grid.crs)
    if asked.targets.area is None:
        return shape
    polygon = polygon_in_grid(grid, asked.targets.area, "targets.area")
    return polygon if shape is None else polygon.intersection(shape)


def _candidates(dem: Raster, grid: ElevationGrid, asked: PlacementParameters, number: int) -> Candidates:
    """One set of candidates; a lattice lies in the request's area unless it names its own."""
    some: CandidatesIn = asked.candidates[number]
    if some.places is not None:
        return candidate_points(
            *(dem, places_in_grid(grid, some.places)),
            above_ground_m=some.above_ground_m,
            altitude_m=some.altitude_m,
            what=some.what,
        )
    assert some.spacing_m is not None, "best sites are refused"
    area = None if asked.area is None else area_in(area_of(asked.area), grid.crs)
    if some.area is not None:
        area = polygon_in_grid(grid, some.area, f"candidates[{number}].area")
    return candidate_grid(
        *(dem, some.spacing_m),
        area=area,
        above_ground_m=some.above_ground_m,
        altitude_m=some.altitude_m,
        what=some.what,
    )


def _anchor(dem: Raster, grid: ElevationGrid, asked: PlacementParameters, number: int) -> Anchor:
    """An anchor that stands, from the posts around it."""
    one = asked.anchors[number]
    east_m, north_m = places_in_grid(grid, [one])[0].tolist()
    return resolve_anchor(ground_at(dem, *dem.post_at(east_m, north_m)), one)


def _answer(
    dem: Raster,
    grid: ElevationGrid,
    asked: PlacementParameters,
    found: WindowPlacement,
    read_by: str,
    started_s: float,
) -> WindowPlacementSummary:
    middle = ground_at(dem, (dem.rows - 1) / 2.0, (dem.cols - 1) / 2.0)
    chosen = found.chosen
    placed = [
        PlacedOut(
            id=anchor.id, what=what, east_m=anchor.east_m, north_m=anchor.north_m, altitude_m=anchor.altitude_m,
            above_ground_m=None if math.isnan(above_m) else above_m, marginal_share=float(gain),
        )
        for anchor, what, above_m, gain in zip(
            found.anchors, chosen.what, chosen.above_ground_m.tolist(), found.marginal, strict=True
        )
    ]  # fmt: skip
    return WindowPlacementSummary(
        version=found.version,
        mode=asked.mode,
        error_statement="",
        curvature=Curvature.over(middle, found.question.sight.curvature).sentence(),
        unknown=asked.unknown,
        dem=LargeGround(
            name=name_of(dem),
            sha256=None if isinstance(dem, LargeDem) else dem.digest,
            rows=dem.rows,
            cols=dem.cols,
            cell_east_m=dem.cell_east_m,
            cell_north_m=dem.cell_north_m,
            crs=None if dem.crs is None else dem.crs.to_string(),
            vertical_datum=dem.vertical_datum,
            heights_count_from=height_reference_of(middle).value,
        ),
        goal=found.question.goal.sentence(asked.in_words),
        placed=placed,
        candidates=CandidatesOut(left=len(found.feasible.candidates), removed=found.feasible.removed),
        proved=found.gap <= 1e-9,
        stopped=found.stopped,
        fixed=[
            PlacedAnchor(
                id=one.id, east_m=one.east_m, north_m=one.north_m, altitude_m=one.altitude_m, above_ground_m=None
            )
            for one in found.question.fixed
        ],
        before_share=found.before,
        value_share=found.value,
        bound_share=found.bound,
        gap_share=found.gap,
        greedy_share=found.greedy_value,
        exact_share=found.exact,
        targets=WindowTargets(points=found.targets),
        read_by=read_by,
        warnings=list(found.warnings),
        timing={"calculation_s": time.perf_counter() - started_s, **found.timing_s},
        parameters=asked.model_dump(mode="json", exclude_none=True),
    )


# not in the registry: over HTTP a DEM that stays in its file is placed on by its overview
WINDOW_PLACEMENT = Product(
    name="window-placement",
    title="placement by windows",
    plural="window_placements",
    model="WindowPlacement",
    tag="Placements",
    summary="Where to put anchors, on ground of any size.",
    about="Where anchors should be put on a DEM that is read by windows.",
    asked=PlacementIn,
    parameters=PlacementParameters,
    answer=WindowPlacementSummary,
    calculate=_calculated,
    layers=tuple(layer for layer in PLACEMENT.layers if layer.name in FILES),
    finished=FinishedWindowPlacement,
    searches=True,
)
