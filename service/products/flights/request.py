"""What a flight is asked for: from where to where through the air, above what, and how far from the ground."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.anchors import SightParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import InADatum, Metres, NotNegative, NotNegativeMetres, PointIn, Positive, StrictModel
from service.parts.positioning import AREA_BESIDE, EXAMPLE_ANCHORS, MorphingMapParameters

__all__ = ["REQUEST", "FlightIn", "FlightParameters"]

ITERATIONS, BUBBLE_M, CLIMB_WEIGHT = 20_000, 20.0, 1.0
DRONES: list[JsonValue] = [
    *EXAMPLE_ANCHORS,
    {"id": "D4", "east_m": 399500.0, "north_m": 3799400.0, "above_ground_m": 150.0},
]
REQUEST: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "start": {"east_m": 403000.0, "north_m": 3796000.0, "above_ground_m": 120.0},
    "goal": {"east_m": 408000.0, "north_m": 3799000.0, "altitude_m": 1700.0},
    "morphing_map": {"anchors": DRONES, "ceiling_altitude_m": 2400.0, "dop_limit": 6.0},
    "bubble_m": 30.0,
}


class FlightBudgetIn(StrictModel):
    """How much planning is paid for."""

    iterations: Annotated[int, Field(strict=True, ge=1, le=10_000_000)] = Field(
        ITERATIONS, description="Of the sampling planner, a number: with one seed it makes one flight."
    )
    seconds: Positive = Field(60.0, description="Time-out of the sampling planner, seconds.")


class FlightParameters(SightParameters, InADatum):
    """From where to where; the anchors that give position in the air stand in ``morphing_map``."""

    altitude_fields = ("ceiling_altitude_m",)
    sight_alone = "the morphing map of a flight says so, by its own sight."

    start: PointIn = Field(description="Where the drone is.")
    goal: PointIn = Field(description="Where it shall be.")
    morphing_map: MorphingMapParameters | None = Field(
        None, description="Stay above this morphing map and below its ceiling; none = only clear of the ground."
    )
    bubble_m: NotNegativeMetres = Field(BUBBLE_M, description="Distance kept from all ground, metres.")
    ceiling_altitude_m: Metres | None = Field(
        None, description="Top of the air, metres above altitude_datum; none = no ceiling but the map's."
    )
    ceiling_above_ground_m: Positive | None = Field(
        None, description="Top of the air above the ground of each place, metres; in place of ceiling_altitude_m."
    )
    climb_weight: NotNegative = Field(
        CLIMB_WEIGHT, description="What a metre of climb costs besides a metre of way, no unit."
    )
    speed_m_per_s: Positive = Field(12.0, description="Of the drone, for the time and the mission, metres per second.")
    budget: FlightBudgetIn = Field(default_factory=lambda: FlightBudgetIn.model_validate({}))
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**32)] = Field(
        0, description="A number; the same seed and iterations give the same flight."
    )

    @model_validator(mode="after")
    def _makes_a_question(self) -> Self:
        if self.anchors:
            raise ValueError("The anchors of a flight belong into its morphing_map.")
        if self.ceiling_altitude_m is not None and self.ceiling_above_ground_m is not None:
            raise ValueError("Give only one of ceiling_altitude_m and ceiling_above_ground_m.")
        if self.morphing_map is not None and self.morphing_map.frames is not None:
            raise ValueError("A flight is planned above one morphing map; leave out its frames.")
        if self.morphing_map is not None and self.morphing_map.area is not None:
            raise ValueError(AREA_BESIDE)
        return self


class FlightIn(FlightParameters):
    """A DEM, from where to where, and a morphing map of the same DEM: its parameters, or the id of a finished one."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
    map_id: Annotated[str, Field(min_length=1, max_length=64)] | None = Field(
        None, description="A finished morphing map of the same DEM, in place of morphing_map."
    )

    @model_validator(mode="after")
    def _one_map(self) -> Self:
        if self.map_id is not None and self.morphing_map is not None:
            raise ValueError("Give only one of map_id and morphing_map.")
        return self
