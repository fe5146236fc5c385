"""The layers of repositionings."""

from __future__ import annotations

from service.files.layer import GEOJSON, PNG, Layer, later
from service.files.missions import MISSIONS

__all__ = ["REPOSITIONING_LAYERS"]

FILES = "service.products.repositionings.files"
PICTURES = "service.products.repositionings.picture"
(PLANS,) = MISSIONS["repositioning"]

REPOSITIONING_LAYERS = (
    Layer(
        "moves.geojson",
        GEOJSON,
        "Each move as a line from where the drone stood to where it goes, with metres, seconds and times.",
        later(FILES, "write_moves"),
    ),
    Layer(
        "schedule.csv",
        "text/csv; charset=utf-8",
        "A row per move in the order of departure: who, from, to, when, how far.",
        later(FILES, "write_schedule"),
    ),
    Layer(
        "anchors.csv",
        "text/csv; charset=utf-8",
        "All anchors after the last move, as a table that --anchors reads: metres in the DEM's CRS.",
        later(FILES, "write_anchors_after"),
    ),
    Layer(
        "plans.zip",
        "application/zip",
        "A QGroundControl .plan file for each drone that moves: up, across, down, hold. On Earth, above sea level.",
        later(FILES, "write_plans"),
        mission=PLANS,
    ),
    Layer(
        "map.png",
        PNG,
        "The path with what is restored of it, and the moves, over shaded relief.",
        later(PICTURES, "write_repositioning"),
    ),
)
