"""What a repositioning is asked for: anchors, which of them are occluded, the way ahead, and what drones can fly."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.anchors import AnchorId, SightParameters
from service.parts.doubts import DoubtParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import NotNegative, NotNegativeMetres, PlaceIn, Positive, StrictModel
from service.products.placements.request import GoalIn, RulesIn, Share

__all__ = ["REQUEST", "DroneFlightIn", "RepositioningIn", "RepositioningParameters", "RoverPoseIn"]

REQUEST: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "anchors": [
        {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0},
        {"id": "D2", "east_m": 398100.0, "north_m": 3791700.0, "above_ground_m": 80.0},
        {"id": "D3", "east_m": 400700.0, "north_m": 3790100.0, "above_ground_m": 80.0},
        {"id": "D4", "east_m": 399500.0, "north_m": 3793400.0, "above_ground_m": 80.0},
    ],
    "occluded": ["D2"],
    "rover": {"place": {"east_m": 400100.0, "north_m": 3792900.0}, "heading_deg": 60.0, "ahead_m": 400.0},
    "goal": {"objective": "coverage", "min_anchors": 4},
    "flight": {"max_flight_m": 3000.0},
}

Ids = Annotated[list[AnchorId], Field(max_length=64)]


class DroneFlightIn(StrictModel):
    """How drones fly: straight up, level and clear of the ground, straight down."""

    speed_m_per_s: Positive = Field(12.0, description="Level speed, metres per second.")
    climb_m_per_s: Positive = Field(3.0, description="Climbing speed, metres per second.")
    descent_m_per_s: Positive = Field(2.0, description="Descending speed, metres per second.")
    clearance_m: NotNegativeMetres = Field(20.0, description="Kept above the ground on the way, metres.")
    max_flight_m: Positive | None = Field(None, description="Longest flight path of one move, metres; none = any.")


class RoverPoseIn(StrictModel):
    """Where the rover is and where it is heading, in place of a path."""

    place: PlaceIn = Field(description="Where it is.")
    heading_deg: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-360.0, le=360.0)] = Field(
        description="Its heading, degrees clockwise from grid north."
    )
    ahead_m: Positive = Field(500.0, description="So far ahead along the heading it drives next, metres.")


class HeldGoalIn(GoalIn):
    """What shall hold, and how much of it."""

    objective: Literal["coverage", "dop", "mean_error", "worst_error"] = Field(
        "coverage", description="coverage: enough anchors in sight; dop: a good enough dilution as well."
    )


class RepositioningParameters(SightParameters, DoubtParameters):
    """Anchors that stand, those that are occluded, the way ahead, and what shall hold along it."""

    occluded: Ids = Field(
        [],
        description="Ids of anchors that are hidden for good, whatever the map says: they count once they are moved.",
    )
    movable: Ids | None = Field(None, description="Ids of the anchors that may move; left out = all.")
    path: Annotated[list[PlaceIn], Field(min_length=2, max_length=10_000)] | None = Field(
        None, description="The path ahead; or give rover."
    )
    rover: RoverPoseIn | None = Field(None, description="Place and heading in place of a path.")
    receiver_above_ground_m: NotNegativeMetres = Field(1.5, description="Height of the rover's antenna, metres.")
    goal: HeldGoalIn = Field(
        default_factory=lambda: HeldGoalIn.model_validate({}), description="What shall hold: coverage or dop."
    )
    share: Share = Field(1.0, description="Of the path along which it shall hold, 0..1.")
    heights_above_ground_m: Annotated[list[NotNegativeMetres], Field(min_length=1, max_length=8)] | None = Field(
        None,
        description="Heights above ground to move to, metres, and no others; left out = 60 and 120 m, and each drone's "
        "own altitude.",
    )
    cheapest: Literal["distance", "time"] = Field("distance", description="Of which the cheapest move is taken.")
    flight: DroneFlightIn = Field(
        default_factory=lambda: DroneFlightIn.model_validate({}), description="How drones fly."
    )
    rules: RulesIn = Field(
        default_factory=lambda: RulesIn.model_validate({}), description="Where drones may be; no flight over no_fly."
    )
    stretch_m: Positive | None = Field(
        None,
        description="Plan moves stretch by stretch of this length, metres, along a long path; left out = one move.",
    )
    rover_m_per_s: Positive = Field(1.0, description="Speed of the rover, metres per second; for stretches.")

    @model_validator(mode="after")
    def _one_way_ahead(self) -> Self:
        if (self.path is None) == (self.rover is None):
            raise ValueError("Give exactly one of path and rover.")
        if not self.anchors:
            raise ValueError("Give the anchors that stand now; there is nothing to move.")
        if self.goal.objective not in ("coverage", "dop"):
            raise ValueError("A repositioning restores a share: its objective is coverage or dop.")
        return self


class RepositioningIn(RepositioningParameters):
    """A DEM, anchors, which are occluded, and the way ahead."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
    detector_id: AnchorId | None = Field(
        None, description="A detector session: anchors that it finds occluded for persistent_s join ``occluded``."
    )
    persistent_s: NotNegative = Field(
        10.0, description="How long every range of an anchor must have been occluded, seconds."
    )

    @model_validator(mode="after")
    def _known_ids(self) -> Self:
        ids = {anchor.id for anchor in self.anchors}
        for name, given in (("occluded", self.occluded), ("movable", self.movable or [])):
            strange = next((one for one in given if one not in ids), None)
            if strange is not None:
                raise ValueError(f"{name}: there is no anchor {strange!r} among the anchors.")
        return self
