"""Paths as the service tells about them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from .map_answers import DEM_ID, DemId, MapOut, MapSummary, running_example
from .older_results import OrOlder
from .pages import Page
from .paths import PathQuestion, check_limits_have_anchors

__all__ = ["PathIn", "PathList", "PathOut", "PathSummary"]

ANCHORS: list[Any] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 120.0},
    {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "above_ground_m": 200.0},
    {"id": "D3", "east_m": 405100.0, "north_m": 3801700.0, "altitude_m": 1612.0},
]
REQUEST: dict[str, Any] = {
    "dem_id": DEM_ID,
    "start": {"east_m": 403000.0, "north_m": 3796000.0},
    "goals": [{"type": "Point", "coordinates": [-117.95, 34.33]}],
    "anchors": ANCHORS,
    "rover": {"max_slope_deg": 25.0, "footprint_radius_m": 0.8, "speed_m_per_s": 0.5},
    "limits": {"min_anchors": 2},
    "weights": {"climb": 2.0, "out_of_sight": 3.0},
}


class PathIn(PathQuestion):
    """A DEM, a rover, from where to where, and the anchors that it ranges to, or a finished map of them."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
    map_id: Annotated[str, Field(min_length=1, max_length=64)] | None = Field(
        None,
        description="A finished visibility, DOP or morphing map of the same DEM: its anchors, its sight settings, "
        "and the limits of a DOP map; the antenna stays above a morphing map. What the request says itself wins.",
    )

    @model_validator(mode="after")
    def _limits_need_anchors(self) -> Self:
        if self.map_id is None:
            check_limits_have_anchors(self)
        return self


class PathPlaceOut(BaseModel):
    """A place on the ground."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")


class PathTotalsOut(BaseModel):
    """What the whole path amounts to."""

    model_config = ConfigDict(extra="allow")

    length_m: float = Field(description="Along the ground, metres.")
    climb_m: float = Field(description="Metres up.")
    descent_m: float = Field(description="Metres down.")
    time_s: float = Field(description="Seconds on the way.")
    out_of_sight_s: float = Field(description="Seconds with fewer anchors in sight than count as in sight.")
    longest_out_of_sight_s: float = Field(description="The longest stretch of them, seconds.")
    worst_dop: float | None = Field(description="Largest dilution, no unit; null without anchors or without a fix.")
    fewest_anchors: int = Field(description="How many anchors are in sight where the fewest are.")
    mean_position_sigma_m: float | None = Field(
        description="Predicted one-sigma position error, mean over the time of the path, metres; null without anchors."
    )
    steepest_deg: float = Field(description="Steepest ground under the way, degrees.")


class RelaxationOut(BaseModel):
    """One limit by itself that would let a path through."""

    reason: str = Field(description="Which limit.")
    asked: float | None = Field(description="What was asked for, in the unit that is given; angles in degrees.")
    needed: float | None = Field(description="What would do, in the unit that is given; angles in degrees.")
    least: float | None = Field(
        None,
        description="With less there is surely no path, in the unit that is given, angles in degrees; null: not known.",
    )
    unit: str = Field(description="deg, m, or empty: a number without a unit.")
    sentence: str = Field(description="The same in words.")
    shown: bool = Field(
        False,
        description="Whether a path was found with it that the validator passes; nobody can for unknown ground and "
        "for what lies beyond the border of the map.",
    )


class GrainOut(BaseModel):
    """How finely it is proved that there is no path."""

    width_m: float = Field(
        description="No way exists that has half of this free on either side of the rover all along, metres; 0: none "
        "at all."
    )
    slope_deg: float = Field(description="Nor over ground steeper than the limit by no more than this, degrees.")


class UnreachableOut(BaseModel):
    """What cuts every path; of an undecided plan, what stopped the search."""

    reason: str = Field(description="Which limit.")
    where: PathPlaceOut
    relaxations: list[RelaxationOut] = Field(description="Each single limit that would do, cheapest first.")
    grain: GrainOut | None = Field(None, description="How finely it is proved; null: it is not.")


class LimitCheckOut(BaseModel):
    """The validator's check of one limit."""

    model_config = ConfigDict(extra="allow")

    limit: str = Field(description="Which limit.")
    kept: bool = Field(description="Whether it holds everywhere.")
    broken: int = Field(description="At how many of the samples it does not.")
    where: PathPlaceOut


class ValidationOut(BaseModel):
    """The report of the validator, which shares no code with the planner."""

    passed: bool = Field(description="Whether every limit holds.")
    sentence: str = Field(description="The same in words.")
    step_m: float = Field(description="Distance between samples at most, metres.")
    samples: int = Field(description="How many samples there were.")
    checks: list[LimitCheckOut]


class PathSummary(MapSummary):
    """How the plan ended, and the path."""

    status: Literal["found", "unreachable", "undecided", "out_of_budget", "refused"] = Field(
        description="found: a path that the validator passed; unreachable: proved to the grain told, and what cuts "
        "it; undecided: neither a path nor that proof was found; out_of_budget: the time was up; refused: the "
        "validator found a fault in every path."
    )
    sentence: str = Field(description="The outcome in words.")
    totals: PathTotalsOut | None
    cost: float | None = Field(description="Of the path, in metres on level ground.")
    cost_split: dict[str, float] | None = Field(description="Its parts, in metres on level ground.")
    reference_cost: float | None = Field(description="Of the any-angle reference, in metres on level ground.")
    ratio: float | None = Field(description="The path's cost over the reference's, no unit.")
    unreachable: UnreachableOut | None
    validation: ValidationOut | None
    planner: str = Field(description="Which planner the path came from.")
    stopped_by: str = Field(
        description="count: the iterations; time: the time-out; stop: a request; proof: there is no path; "
        "grain: it was searched as finely as it is."
    )
    seed: int = Field(description="The seed, a number.")


class PathOut(MapOut):
    """A path: how its planning stands, and its result when it has one."""

    model_config = ConfigDict(json_schema_extra={"examples": [running_example("/paths", REQUEST)]})

    result: OrOlder[PathSummary] = Field(description="How the plan ended; null until it did.")


class PathList(Page):
    """One page of paths, newest first."""

    paths: list[PathOut]
