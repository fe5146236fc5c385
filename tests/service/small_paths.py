"""Questions for paths over the small ground: west of its wall there is a way, across it there is none."""

from __future__ import annotations

from typing import Any

from service.products.paths.answer import FinishedPath
from service.products.paths.calculate import calculate_path
from service.products.paths.request import PathParameters
from tests.service.small_maps import NORTH_M, WEST_M, small_grid


def at(east_m: float, south_m: float) -> dict[str, float]:
    """A place so far east and south of the north-west post."""
    return {"east_m": WEST_M + east_m, "north_m": NORTH_M - south_m}


ANCHORS = [
    {"id": "W", **at(95.0, 305.0), "above_ground_m": 120.0},
    {"id": "N", **at(400.0, 30.0), "above_ground_m": 90.0},
    {"id": "S", **at(420.0, 430.0), "above_ground_m": 60.0},
    {"id": "E", **at(750.0, 90.0), "above_ground_m": 20.0},
]
WEST_OF_WALL, ACROSS = (at(45.0, 430.0), at(470.0, 70.0)), (at(45.0, 430.0), at(750.0, 70.0))
NO_GO = {"ring": [at(150.0, 200.0), at(300.0, 200.0), at(300.0, 300.0), at(150.0, 300.0)]}


def path_request(ends: tuple[dict[str, float], dict[str, float]] = WEST_OF_WALL, **changes: Any) -> dict[str, Any]:
    start, goal = ends
    return {
        "start": start,
        "goals": [goal],
        "anchors": ANCHORS,
        "no_go": [NO_GO],
        "budget": {"sampling": False},
        **changes,
    }


def small_path(
    ends: tuple[dict[str, float], dict[str, float]] = WEST_OF_WALL, crs: str | None = "EPSG:32611", **changes: Any
) -> FinishedPath:
    return calculate_path(small_grid(crs), PathParameters.model_validate(path_request(ends, **changes)))
