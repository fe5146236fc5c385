"""Paths as the service tells about them, and what is kept of a finished plan."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import shapely
from pydantic import BaseModel, Field

from planning.alternatives import Alternative, Departures
from planning.paths import Path, PathStatus, Reason, Relaxation, Unreachable
from service.parts.map_facts import MapSummary
from service.parts.plan_answers import PathPlaceOut, ValidationOut, finite, place_answer
from service.parts.positioning_answers import PlacedAnchor, PlacedSatellite
from service.products.paths.request import PathParameters
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor

__all__ = [
    "VERTEX_COLUMNS",
    "FinishedPath",
    "PathAreaOut",
    "PathSummary",
    "alternative_answer",
    "departures_answer",
    "goal_answer",
    "totals_answer",
    "unreachable_answer",
    "vertex_table",
]

# fields of a path, one number for each vertex
VERTEX_COLUMNS = (
    *("east_m", "north_m", "altitude_m", "heading_rad", "distance_m", "time_s", "slope_rad", "pitch_rad", "roll_rad"),
    *("anchor_count", "dop", "margin_m", "clearance_m", "position_sigma_m", "bubble_radius_m"),
)
UNITS = {Reason.SLOPE: "deg", Reason.PITCH_OR_ROLL: "deg", Reason.STEP: "m"}


class PathAreaOut(BaseModel):
    """An area that is a goal, and its middle."""

    area_m2: float = Field(description="How large it is, square metres.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")


class PathTotalsOut(BaseModel):
    """What the whole path amounts to."""

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
    vertices: int = Field(description="How many vertices it has.")


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


class PathAlternativeOut(BaseModel):
    """Another way, as good as its numbers."""

    what: Literal["shortest", "in sight", "surest", "another way"] = Field(
        description="What it is after: length, anchors in sight, a sure position; or merely another way."
    )
    sentence: str = Field(description="What it is worth beside the path, in words.")
    apart_share: float = Field(description="Share of its length, 0..1, that is away from every way before it.")
    cost: float = Field(description="As that of the path, in metres on level ground.")
    totals: PathTotalsOut
    corners: list[PathPlaceOut] = Field(description="Where it turns, from the start to the goal.")


class DepartureOut(BaseModel):
    """A time at which the rover might leave."""

    departure_s: float = Field(description="When it leaves, seconds on the clock of the tracks.")
    arrival_s: float | None = Field(description="When it is there, seconds; null: no path was found.")
    cost: float | None = Field(description="Of its path, in metres on level ground; null: none was found.")
    in_time: bool = Field(description="Whether it arrives within the window.")
    taken: bool = Field(description="Whether the path of this answer leaves then.")
    sentence: str = Field(description="What there is then, in words.")


class PathSummary(MapSummary):
    """How the plan ended, and the path."""

    timing: dict[str, float | None] = Field(  # type: ignore[assignment] # of a plan that found no path
        description="Seconds that parts of the calculation took; null: there was no first path."
    )
    status: PathStatus = Field(
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
    anchors: list[PlacedAnchor] = Field(description="The anchors that stand, in the DEM's frame.")
    satellites: list[PlacedSatellite] = Field(description="The satellites in view.")
    start: PathPlaceOut
    goals: list[PathAreaOut | PathPlaceOut] = Field(description="The goals, places or areas.")
    way_points: list[PathPlaceOut] = Field(description="The places to pass, in order.")
    ranged_to: list[str] = Field(description="Names of all that the rover ranges to, in the order of the vertices'.")
    needed_in_sight: int = Field(description="So many anchors make a place count as in sight.")
    alternatives: list[PathAlternativeOut] = Field([], description="Other ways, each of which the validator passed.")
    alternatives_sentence: str = Field("", description="How many there are, and why not more, in words.")
    departures: list[DepartureOut] = Field([], description="The times to leave that were tried.")
    departures_sentence: str = Field("", description="Which of them is best, or what there is instead, in words.")
    sigmas: str = Field(
        "", description="One-sigma errors of ranges, and of anchors' places, that position errors stand on, in words."
    )


@dataclass(frozen=True, eq=False)
class FinishedPath:
    """A finished plan, also one that found no path.

    vertices: (n, columns) float64, VERTEX_COLUMNS of the path; none without one.
    visible: (n, anchors) uint8. corners: numbers of the vertices at which the way turns.
    dop: (rows, cols) float32 at the antenna, +inf = no fix, NaN = unknown. count: (rows, cols) uint16, surely in sight.
    reasons: (rows - 1, cols - 1) uint16, why each square may not be driven, 0 = it may.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: PathParameters
    answer: PathSummary
    vertices: npt.NDArray[np.float64]
    visible: npt.NDArray[np.uint8]
    corners: npt.NDArray[np.int64]
    dop: npt.NDArray[np.float32]
    count: npt.NDArray[np.uint16]
    reasons: npt.NDArray[np.uint16]

    @property
    def found(self) -> bool:
        """Whether there is a path."""
        return len(self.vertices) > 0

    def column(self, name: str) -> npt.NDArray[np.float64]:
        """(n,) one of VERTEX_COLUMNS along the path."""
        values: npt.NDArray[np.float64] = self.vertices[:, VERTEX_COLUMNS.index(name)]
        return values


def vertex_table(path: Path | None) -> npt.NDArray[np.float64]:
    """(n, columns) the path's VERTEX_COLUMNS; no rows without a path."""
    if path is None:
        return np.zeros((0, len(VERTEX_COLUMNS)))
    return np.column_stack([np.asarray(getattr(path, name), np.float64) for name in VERTEX_COLUMNS])


def goal_answer(goal: tuple[float, float] | shapely.Geometry) -> PathAreaOut | PathPlaceOut:
    """A goal of the problem."""
    if not isinstance(goal, shapely.Geometry):
        return place_answer(goal)
    return PathAreaOut(area_m2=float(goal.area), east_m=goal.centroid.x, north_m=goal.centroid.y)


def totals_answer(path: Path) -> PathTotalsOut:
    """The totals of a path; what is no finite number is None."""
    totals = path.totals
    return PathTotalsOut(
        length_m=totals.length_m,
        climb_m=totals.climb_m,
        descent_m=totals.descent_m,
        time_s=totals.time_s,
        out_of_sight_s=totals.out_of_sight_s,
        longest_out_of_sight_s=totals.longest_out_of_sight_s,
        worst_dop=finite(totals.worst_dop),
        fewest_anchors=totals.fewest_anchors,
        mean_position_sigma_m=finite(totals.mean_position_sigma_m),
        steepest_deg=math.degrees(totals.steepest_rad),
        vertices=len(path.east_m),
    )


def alternative_answer(found: Alternative) -> PathAlternativeOut:
    """Another way."""
    path = found.path
    corners = zip(path.east_m[path.corners].tolist(), path.north_m[path.corners].tolist(), strict=True)
    return PathAlternativeOut(
        what=found.what,
        sentence=found.sentence,
        apart_share=found.apart,
        cost=path.cost,
        totals=totals_answer(path),
        corners=[place_answer(place) for place in corners],
    )


def departures_answer(found: Departures) -> list[DepartureOut]:
    """The times that were tried; what is no number is None."""
    return [
        DepartureOut(
            departure_s=one.departure_s,
            arrival_s=finite(one.arrival_s),
            cost=None if one.outcome is None or one.outcome.path is None else one.outcome.path.cost,
            in_time=one.in_time,
            taken=one is found.best,
            sentence=one.why,
        )
        for one in found.tried
    ]


def unreachable_answer(found: Unreachable) -> UnreachableOut:
    """What cuts every path, angles in degrees."""
    grain = found.grain
    return UnreachableOut(
        reason=str(found.reason),
        where=place_answer(found.where_m),
        relaxations=[_relaxation(one) for one in found.relaxations],
        grain=None if grain is None else GrainOut(width_m=grain.width_m, slope_deg=math.degrees(grain.slope_rad)),
    )


def _relaxation(one: Relaxation) -> RelaxationOut:
    unit = UNITS.get(one.reason, "")
    factor = math.degrees(1.0) if unit == "deg" else 1.0
    return RelaxationOut(
        reason=str(one.reason),
        asked=finite(one.asked * factor),
        needed=finite(one.needed * factor),
        least=finite(one.least * factor),
        unit=unit,
        sentence=one.sentence,
        shown=one.shown,
    )
