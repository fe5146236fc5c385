"""Boxes and circles stand where polygons do: in no-go areas, areas to keep in, goals and targets."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from pydantic import TypeAdapter, ValidationError

from service.parts.areas import AreaAsPolygon, Areas, GoalIn
from service.parts.points import PlaceIn, PolygonIn
from service.parts.shapes_in_grid import polygon_in_grid
from service.products.placements.request import TargetsIn
from terrain import Circle, ElevationGrid, FrameError, area_in

GRID = ElevationGrid(np.zeros((50, 60), np.float32), 30.0, 30.0, 500_000.0, 5_000_000.0, crs="EPSG:32632")
BOX = {"west_m": 500_100.0, "south_m": 4_999_000.0, "east_m": 500_700.0, "north_m": 4_999_600.0}
CIRCLE = {"lon_deg": 9.006, "lat_deg": 45.147, "radius_m": 250.0}


def test_a_box_in_metres_is_its_four_sides() -> None:
    (area,) = TypeAdapter(Areas).validate_python([BOX])
    assert polygon_in_grid(GRID, area, "area").equals(shapely.box(500_100.0, 4_999_000.0, 500_700.0, 4_999_600.0))


def test_a_circle_in_degrees_has_its_radius_over_ground() -> None:
    targets = TargetsIn.model_validate({"area": CIRCLE})
    assert targets.area is not None
    found, wanted = polygon_in_grid(GRID, targets.area, "area"), area_in(Circle(9.006, 45.147, 250.0), GRID.crs)
    assert found.symmetric_difference(wanted).area < 1.0


def test_a_goal_may_be_a_place_a_box_or_a_circle() -> None:
    goal = TypeAdapter(GoalIn)
    assert isinstance(goal.validate_python({"east_m": 1.0, "north_m": 2.0}), PlaceIn)
    assert isinstance(goal.validate_python(BOX), PolygonIn)
    assert isinstance(goal.validate_python({"east_m": 1.0, "north_m": 2.0, "radius_m": 5.0}), PolygonIn)


def test_on_the_moon_a_circle_in_degrees_of_the_earth_is_refused() -> None:
    moon = ElevationGrid(
        np.zeros((5, 5), np.float32), 30.0, 30.0, crs="+proj=aeqd +lat_0=-85 +lon_0=30 +R=1737400 +units=m"
    )
    area = TypeAdapter(AreaAsPolygon).validate_python(CIRCLE)
    with pytest.raises(FrameError, match="on Earth have no place on a DEM of Moon"):
        polygon_in_grid(moon, area, "area")


@pytest.mark.parametrize("value", [{"west_m": 1.0}, {**CIRCLE, "radius_m": -1.0}, {**BOX, "west_m": "a"}])
def test_what_is_no_box_and_no_circle_is_told(value: dict[str, object]) -> None:
    with pytest.raises(ValidationError, match=r"Field required|greater than 0|valid number"):
        TypeAdapter(AreaAsPolygon).validate_python(value)
