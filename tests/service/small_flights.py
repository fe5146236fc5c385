"""Questions for flights over the small ground: over its wall, and above the morphing map of four drones."""

from __future__ import annotations

from typing import Any

from service.products.flights.calculate import FinishedFlight, calculate_flight
from service.products.flights.request import FlightParameters
from tests.service.small_maps import small_grid
from tests.service.small_paths import ANCHORS, at

START, GOAL = {**at(100.0, 400.0), "altitude_m": 60.0}, {**at(750.0, 70.0), "above_ground_m": 40.0}
# high, so that the air of the small ground has a floor and a ceiling
MAP = {"anchors": ANCHORS, "ceiling_altitude_m": 400.0, "dop_limit": 30.0, "min_anchors": 3, "mode": "exact"}
HIGH = {"start": {**at(100.0, 400.0), "altitude_m": 300.0}, "goal": {**at(750.0, 70.0), "altitude_m": 350.0}}
FEW = {"iterations": 2000}


def flight_request(**changes: Any) -> dict[str, Any]:
    return {"start": START, "goal": GOAL, "bubble_m": 15.0, "budget": FEW, **changes}


def small_flight(crs: str | None = "EPSG:32611", **changes: Any) -> FinishedFlight:
    return calculate_flight(small_grid(crs), FlightParameters.model_validate(flight_request(**changes)))
