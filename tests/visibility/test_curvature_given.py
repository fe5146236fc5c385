"""Curvature is a Curvature or None: yes and no, which look like an answer to "curved?", are refused with a sentence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.visibility.meshes import as_buildings, box, level
from visibility import Anchor, VisibilityInputError, line_of_sight, lines_of_sight, min_visible_altitude, profile
from visibility.cover import clear_of_buildings, grid_surface_mesh, lowered_m, visible_with_buildings
from visibility.sight import SurfaceCache, camera_for_anchor, occluded_points

GRID = level()
START_M, END_M = (10.0, -20.0, 30.0), (280.0, -150.0, 5.0)
ANCHOR = Anchor("A", *START_M)
HOUSE = as_buildings(box(150.0, -100.0))
CAMERA = camera_for_anchor(ANCHOR, END_M, 1.0, 20)

TAKERS: dict[str, Callable[[Any], object]] = {
    "min_visible_altitude": lambda given: min_visible_altitude(GRID, [ANCHOR], "fast", given),
    "line_of_sight": lambda given: line_of_sight(GRID, START_M, END_M, curvature=given),
    "lines_of_sight": lambda given: lines_of_sight(GRID, [START_M], [END_M], curvature=given),
    "profile": lambda given: profile(GRID, START_M, END_M, curvature=given),
    "occluded_points": lambda given: occluded_points(CAMERA, GRID, curvature=given),
    "SurfaceCache": lambda given: SurfaceCache(GRID, curvature=given),
    "visible_with_buildings": lambda given: visible_with_buildings(GRID, [ANCHOR], 1.5, HOUSE, curvature=given),
    "clear_of_buildings": lambda given: clear_of_buildings(GRID, HOUSE, [END_M], [START_M], given),
    "grid_surface_mesh": lambda given: grid_surface_mesh(GRID, given, (0.0, 0.0)),
    "lowered_m": lambda given: lowered_m(given, (0.0, 0.0), np.zeros((1, 3))),
}


@pytest.mark.parametrize("given", [False, True, 6_371_000.0, "flat"])
@pytest.mark.parametrize("name", TAKERS)
def test_what_is_no_curvature_is_refused_with_a_sentence_that_names_what_is(name: str, given: object) -> None:
    with pytest.raises(
        VisibilityInputError, match=r"^curvature must be a visibility\.Curvature, visibility\.FLAT .*"
    ) as told:
        TAKERS[name](given)
    assert str(told.value).endswith(f", not {given!r}.")
