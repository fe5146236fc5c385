"""The layers of planned flights."""

from __future__ import annotations

from service.files.layer import GEOJSON, PNG, Layer, later
from service.files.missions import MISSIONS

__all__ = ["FLIGHT_LAYERS"]

FILES = "service.products.flights.files"
PICTURES = "service.products.flights.picture"
FOUND = "found"
(PLAN,) = MISSIONS["flight"]

FLIGHT_LAYERS = (
    Layer(
        "flight.geojson",
        GEOJSON,
        "The flight as a LineString with altitudes and totals, and each corner as a point; without a flight its ends.",
        later(FILES, "write_geojson"),
    ),
    Layer(
        "flight.csv",
        "text/csv; charset=utf-8",
        "The air along the flight at fine steps, metres: flown, altitude, ground, floor, ceiling, distance to ground.",
        later(FILES, "write_csv"),
        status=FOUND,
    ),
    Layer(
        "flight.plan",
        "application/json",
        "The corners of the flight as a QGroundControl mission for a drone. On Earth, above sea level.",
        later(FILES, "write_plan"),
        status=FOUND,
        mission=PLAN,
    ),
    Layer("map.png", PNG, "The flight over shaded relief.", later(PICTURES, "write_flight_picture")),
    Layer(
        "profile.png",
        PNG,
        "Altitude over the ground, between the morphing map and the ceiling, and the distance to the ground.",
        later(PICTURES, "write_flight_profile"),
        status=FOUND,
    ),
)
