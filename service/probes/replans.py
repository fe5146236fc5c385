"""A path's plan made again from wherever the rover is by now: the same question, answered at once and kept nowhere."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from planning.alternatives import PreparedPlan, prepare_replanning
from planning.paths import Path, PathStatus
from service.parts.areas import StandingPlace
from service.parts.map_area import refuse_outside
from service.parts.plan_answers import PathPlaceOut, ValidationOut, place_answer, validation_answer
from service.parts.points import StrictModel
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import places_in_grid
from service.products import UNWATCHED
from service.products.paths.answer import PathTotalsOut, totals_answer
from service.products.paths.calculate import mapped_question
from service.products.paths.request import REQUEST, PathParameters
from terrain import ElevationGrid, to_lon_lat

__all__ = ["ReplanIn", "ReplanOut", "replan"]


class ReplanIn(StrictModel):
    """Where the rover is by now; all else is as the path was asked."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"start": REQUEST["start"]}]})

    start: StandingPlace = Field(description="Where the rover is.")


class ReplanCornerOut(PathPlaceOut):
    """A place at which the way turns, and what holds there."""

    lon_deg: float | None = Field(description="WGS 84 longitude, degrees; null: the DEM has no CRS.")
    lat_deg: float | None = Field(description="WGS 84 latitude, degrees; null: the DEM has no CRS.")
    altitude_m: float = Field(description="Of the ground, in the DEM's vertical datum, metres.")
    distance_m: float = Field(description="From the start, along the ground, metres.")
    time_s: float = Field(description="From the start, seconds.")
    anchor_count: int = Field(description="How many anchors are in sight there, by exact sight lines.")


class ReplanOut(BaseModel):
    """The path from there, or that what is known leads to none."""

    status: Annotated[
        PathStatus,
        Field(
            description="found: a path that the validator passed; out_of_budget: what is known leads to none, which "
            "proves nothing; ask for a path."
        ),
    ]
    sentence: str = Field(description="The outcome in words.")
    warnings: list[str] = Field(description="What else to know about it, in words.")
    start: PathPlaceOut
    totals: PathTotalsOut | None
    cost: float | None = Field(description="Of the path, in metres on level ground.")
    cost_split: dict[str, float] | None = Field(description="Its parts, in metres on level ground.")
    corners: list[ReplanCornerOut] = Field(description="Where it turns, from the start to the goal.")
    validation: ValidationOut | None
    timing: dict[str, float] = Field(
        description="Seconds: prepared_s, for what all plans of the path have in common, next to nothing where it is "
        "known from the plan before; plan_s, for the plan itself."
    )


def replan(grid: ElevationGrid, asked: PathParameters, given: ReplanIn) -> ReplanOut:
    """The plan of a path's parameters from another start, by costs that are worked out once for all starts.

    Raises PathError, RequestError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    return _replan(grid, asked.model_copy(update={"start": given.start}), asked.model_dump_json())


@told_as_asked
def _replan(grid: ElevationGrid, asked: PathParameters, all_asked: str) -> ReplanOut:
    start = places_in_grid(grid, [asked.start])
    refuse_outside(grid, asked.area, start, "The start")
    begin_s = time.perf_counter()
    prepared = _prepared(grid, all_asked)
    prepared_s = time.perf_counter() - begin_s
    east_m, north_m = start[0].tolist()
    outcome = prepared.plan.plan_from((east_m, north_m), anew=False)
    path, checked = outcome.path, outcome.validation
    return ReplanOut(
        status=outcome.status,
        sentence=outcome.sentence,
        warnings=[*dict.fromkeys((*prepared.warnings, *outcome.warnings))],
        start=place_answer((east_m, north_m)),
        totals=None if path is None else totals_answer(path),
        cost=None if path is None else path.cost,
        cost_split=None if path is None else dict(path.cost_split),
        corners=[] if path is None else _corners(grid, path),
        validation=None if checked is None else validation_answer(checked),
        timing={"prepared_s": prepared_s, "plan_s": outcome.elapsed_s},
    )


@dataclass(frozen=True, slots=True)
class _Prepared:
    """What all plans of a path have in common, and what its question was told of."""

    plan: PreparedPlan
    warnings: tuple[str, ...]


@lru_cache(maxsize=1)
def _prepared(grid: ElevationGrid, asked: str) -> _Prepared:
    """Of the parameters of the path that was asked about last, and of no more: they are as large as its maps."""
    mapped = mapped_question(grid, PathParameters.model_validate_json(asked), UNWATCHED.progress)
    return _Prepared(prepare_replanning(mapped.problem), mapped.warnings)


def _corners(grid: ElevationGrid, path: Path) -> list[ReplanCornerOut]:
    at = path.corners
    east_m, north_m = path.east_m[at], path.north_m[at]
    degrees = [(None, None)] * len(at)
    if grid.crs is not None:
        degrees = list(zip(*(angles.tolist() for angles in to_lon_lat(grid, east_m, north_m)), strict=True))
    told = (east_m, north_m, path.altitude_m[at], path.distance_m[at], path.time_s[at], path.anchor_count[at])
    names = ("east_m", "north_m", "altitude_m", "distance_m", "time_s", "anchor_count")
    return [
        ReplanCornerOut(**dict(zip(names, numbers, strict=True)), lon_deg=lon_deg, lat_deg=lat_deg)
        for numbers, (lon_deg, lat_deg) in zip(zip(*(one.tolist() for one in told), strict=True), degrees, strict=True)
    ]
