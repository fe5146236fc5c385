"""What a placement of anchors is asked for: candidates, where they shall be seen, rules and what is good."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.anchors import SightParameters
from service.parts.areas import AreaAsPolygon
from service.parts.doubts import DoubtParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import (
    InADatum,
    Metres,
    NotNegativeMetres,
    PlaceIn,
    PlanAltitudes,
    PointIn,
    Positive,
    StandOffIn,
    StrictModel,
    WeightIn,
)
from service.parts.radios import RadioIn
from service.parts.sentences import WithOlderNames

__all__ = [
    "REQUEST",
    "CandidatesIn",
    "GoalIn",
    "LinkIn",
    "PlacementIn",
    "PlacementParameters",
    "RulesIn",
    "Share",
    "TargetsIn",
]

REQUEST: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "count": 6,
    "candidates": [{"spacing_m": 1500.0, "above_ground_m": [80.0, 120.0]}],
    "targets": {"receiver_above_ground_m": 1.5},
    "goal": {"objective": "dop", "min_anchors": 4, "dop_limit": 5.0},
    "rules": {"max_range_m": 8000.0, "min_separation_m": 300.0},
}

Share = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, le=1.0)]
Heights = Annotated[list[NotNegativeMetres], Field(max_length=32)]
Altitudes = Annotated[list[Metres], Field(max_length=32)]


class CandidatesIn(InADatum):
    """Places for anchors: a lattice or given places, each at every height."""

    what: Literal["drone", "mast", "site"] = Field("drone", description="What would stand there.")
    spacing_m: Positive | None = Field(None, description="Of a square lattice of places, metres; or give places.")
    area: AreaAsPolygon | None = Field(
        None, description="Where the lattice or the best sites lie; left out = the whole DEM."
    )
    places: Annotated[list[PlaceIn], Field(min_length=1, max_length=20_000)] | None = Field(
        None, description="Given places, in place of a lattice."
    )
    best_sites: Annotated[int, Field(strict=True, ge=1, le=20_000)] | None = Field(
        None, description="A number of posts that see most of the targets, by a map of sites, at each height."
    )
    above_ground_m: Heights = Field([], description="Heights above the ground of each place, metres.")
    altitude_m: Altitudes = Field([], description="Heights above altitude_datum, metres.")

    @model_validator(mode="after")
    def _places_and_heights(self) -> Self:
        if sum(one is not None for one in (self.spacing_m, self.places, self.best_sites)) != 1:
            raise ValueError("Candidates need exactly one of spacing_m, places and best_sites.")
        if self.places is not None and self.area is not None:
            raise ValueError("An area goes with spacing_m or best_sites, not with places.")
        if self.best_sites is not None and self.altitude_m:
            raise ValueError("best_sites stand so far above the ground, not at an altitude: give above_ground_m.")
        if not self.above_ground_m and not self.altitude_m:
            raise ValueError("Candidates need at least one height, in above_ground_m or altitude_m.")
        return self


class TargetsIn(StrictModel):
    """Where the rover has to see anchors: an area, a corridor or a path; the whole DEM by default."""

    area: AreaAsPolygon | None = Field(None, description="Only here; left out = the whole DEM.")
    path: Annotated[list[PlaceIn], Field(min_length=2, max_length=10_000)] | None = Field(
        None, description="Along this planned path instead; each metre of it counts the same."
    )
    corridor_width_m: Positive | None = Field(
        None, description="Take the ground within half this width of the path, metres, instead of the path itself."
    )
    weights: Annotated[list[WeightIn], Field(max_length=1000)] = Field(
        [],
        description="Ground that counts more or less than the rest, which counts 1; where two overlap the later holds.",
    )
    receiver_above_ground_m: NotNegativeMetres = Field(1.5, description="Height of the rover's antenna, metres.")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if self.area is not None and self.path is not None:
            raise ValueError("Targets are an area or a path, not both.")
        if self.corridor_width_m is not None and self.path is None:
            raise ValueError("corridor_width_m needs a path.")
        if self.weights and self.path is not None and self.corridor_width_m is None:
            raise ValueError("weights go with an area or a corridor; of a path every metre counts the same.")
        return self


class GoalIn(WithOlderNames):
    """What is good, and how much of it."""

    older_names: ClassVar = {"visible": "min_anchors"}

    objective: Literal["coverage", "dop", "mean_error", "worst_error"] | None = Field(
        None,
        description="coverage: share with enough anchors in sight; dop: share with a good enough dilution as well; "
        "mean_error, worst_error: position error in metres. Left out = mean_error with on_surface; for reach coverage.",
    )
    min_anchors: Annotated[int, Field(strict=True, ge=1, le=64)] | None = Field(
        None,
        description="So many anchors have to be in sight; left out = 4 for coverage, and for the others as many "
        "as a fix needs.",
    )
    dop_limit: Positive = Field(5.0, description="A dilution of precision below this is good enough, no unit.")
    measure: Literal["gdop", "pdop", "hdop", "vdop"] = Field("pdop", description="Which dilution of precision.")
    kind: Literal["ranging", "pseudorange", "tdoa"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock; differences of arrival."
    )
    on_surface: bool = Field(
        False, strict=True, description="The rover is on the ground, so only its motion along the surface is unknown."
    )
    spare: Annotated[int, Field(strict=True, ge=0, le=1)] = Field(
        0, description="How many anchors may be lost, any of them: 0 or 1 anchors."
    )
    ranging_sigma_m: Positive = Field(0.1, description="One-sigma error of ranges to the placed anchors, metres.")
    worst_counted_m: Positive = Field(10.0, description="An error counts at most so much, metres; no fix counts it.")


class LinkIn(StrictModel):
    """Every anchor's radio link to a base."""

    bases: Annotated[list[PointIn], Field(min_length=1, max_length=64)] = Field(
        description="Base stations or parent drones."
    )
    max_range_m: Positive | None = Field(None, description="Longest link, metres; left out = unlimited.")
    relays: Annotated[int, Field(strict=True, ge=0, le=8)] = Field(
        0, description="So many other anchors may relay a link: a number, 0 = every anchor sees a base itself."
    )
    radio: RadioIn | None = Field(
        None, description="Of both ends: its signal decides whether there is a link; left out = sight."
    )


class RulesIn(InADatum):
    """Where anchors may be."""

    altitude_fields = ("max_altitude_m",)

    no_fly: Annotated[list[AreaAsPolygon], Field(max_length=1000)] = Field([], description="No anchor over these.")
    stand_off: Annotated[list[StandOffIn], Field(max_length=1000)] = Field([], description="Distances to keep.")
    min_above_ground_m: NotNegativeMetres = Field(0.0, description="Lowest height above ground, metres.")
    max_above_ground_m: Positive | None = Field(None, description="Ceiling above ground, metres.")
    max_altitude_m: Metres | None = Field(None, description="Ceiling above altitude_datum, metres.")
    max_range_m: Positive | None = Field(None, description="Longest range that is measured, metres.")
    min_separation_m: NotNegativeMetres = Field(0.0, description="Least distance between two anchors, metres.")
    link: LinkIn | None = Field(None, description="The link every anchor needs.")


class PlacementParameters(SightParameters, DoubtParameters):
    """Candidates, where they shall be seen, rules and what is good; ``anchors`` are those already there."""

    candidates: Annotated[list[CandidatesIn], Field(min_length=1, max_length=16)] = Field(
        description="Places where an anchor could be put."
    )
    targets: TargetsIn = Field(default_factory=lambda: TargetsIn.model_validate({}))
    goal: GoalIn = Field(default_factory=lambda: GoalIn.model_validate({}))
    rules: RulesIn = Field(default_factory=lambda: RulesIn.model_validate({}))
    count: Annotated[int, Field(strict=True, ge=1, le=64)] | None = Field(
        None, description="How many anchors to place; or give reach."
    )
    reach: Share | None = Field(
        None, description="Place the fewest anchors that reach this share, 0..1 (coverage, dop); or give count."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**32)] = Field(
        0, description="A number; the same seed gives the same answer."
    )
    radio: RadioIn | None = Field(
        None, description="Of the anchors that are placed, where usable is asked for in place of visible."
    )
    time_limit_s: Positive | None = Field(
        None, description="After so many seconds the best placement so far is the answer; left out = no limit."
    )
    plan_altitudes: PlanAltitudes = "sea level"
    run_on: Literal["here", "cluster", "cluster_or_here"] = Field(
        "here",
        description="Where sight is worked out: here, in one process; on the Dask cluster that is set up; or there, "
        "and here with a warning where it cannot be reached. The answer is the same.",
    )

    def without_radio(self) -> list[str]:
        """Ids of anchors without a radio, and those that are to be placed."""
        return [*super().without_radio(), *(["those to be placed"] if self.radio is None else [])]

    @model_validator(mode="after")
    def _radio_of_what_is_usable(self) -> Self:
        if self.radio is not None and not self.usable:
            raise ValueError("The radio of the anchors to be placed goes with sight usable.")
        return self

    @model_validator(mode="before")
    @classmethod
    def _goal_as_it_is_taken(cls, data: Any) -> Any:
        """The goal with what follows from naming no objective, so that the answer tells what was placed for."""
        asked = data.get("goal", {}) if isinstance(data, dict) else None
        goal = asked.model_dump(exclude_unset=True) if isinstance(asked, GoalIn) else asked
        if not isinstance(goal, dict) or goal.get("objective") is not None:
            return data
        if data.get("reach") is not None:
            return {**data, "goal": {**goal, "objective": "coverage"}}
        if goal.get("on_surface") is False:
            raise ValueError(
                "Without an objective the error along the surface is placed for, and on_surface is false; name an "
                "objective, or leave on_surface out."
            )
        if goal.get("measure") in ("hdop", "vdop"):
            return data  # refused with the goal
        return {**data, "goal": {**goal, "objective": "mean_error", "on_surface": True}}

    @model_validator(mode="after")
    def _one_number(self) -> Self:
        if (self.count is None) == (self.reach is None):
            raise ValueError("Give exactly one of count and reach.")
        if self.reach is not None and self.goal.objective not in (None, "coverage", "dop"):
            raise ValueError("reach is a share; it goes with the objectives coverage and dop.")
        return self


class PlacementIn(PlacementParameters):
    """A DEM, candidates, where they shall be seen, rules and what is good."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
