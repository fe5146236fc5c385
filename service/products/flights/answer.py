"""Flights as the service tells about them."""

from __future__ import annotations

from pydantic import BaseModel, Field

from planning.paths import PathStatus
from service.parts.map_facts import MapSummary
from service.parts.plan_answers import ValidationOut

__all__ = ["AirPlaceOut", "FlightCornerOut", "FlightSummary", "FlightTotalsOut"]


class AirPlaceOut(BaseModel):
    """A place in the air."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")


class FlightCornerOut(AirPlaceOut):
    """Where a flight turns, and when it is there."""

    above_ground_m: float | None = Field(description="Height above known ground, metres.")
    time_s: float = Field(description="Since the start, seconds.")


class FlightTotalsOut(BaseModel):
    """What the whole flight amounts to."""

    length_m: float = Field(description="Through the air, metres.")
    climb_m: float = Field(description="Metres up.")
    descent_m: float = Field(description="Metres down.")
    time_s: float = Field(description="Seconds at the speed asked for.")
    highest_m: float = Field(description="Highest altitude, metres.")
    clearance_m: float = Field(description="Least distance to the ground, metres.")
    margin_m: float | None = Field(description="Least height over the morphing map, metres; null without one.")


class FlightSummary(MapSummary):
    """How the plan ended, and the flight."""

    status: PathStatus = Field(
        description="found: a flight that the validator passed; unreachable: proved; undecided: neither a flight nor "
        "that proof was found; refused: the validator found a fault."
    )
    sentence: str = Field(description="The outcome in words.")
    totals: FlightTotalsOut | None
    cost: float | None = Field(description="Of the flight, in metres.")
    corners: list[FlightCornerOut] = Field(description="Where the flight turns, from its start to its goal.")
    validation: ValidationOut | None
    planner: str = Field(description="Which planner the flight came from.")
    stopped_by: str = Field(
        description="count: the iterations; time: the time-out; stop: a request; proof: no flight; "
        "grain: it was searched as finely as it is."
    )
    seed: int = Field(description="The seed, a number.")
    start: AirPlaceOut
    goal: AirPlaceOut
