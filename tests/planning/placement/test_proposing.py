"""Sites that a map proposes: they see as much as exact lines say, stand apart, and serve a placement."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from planning import PlacementError
from planning.placement import Goal, area_targets, candidate_sites, path_targets, place_anchors
from tests.planning.placement.grounds import exact_sight, rough_grid

GRID = rough_grid(48, seed=8, relief_m=250.0)
TARGETS = area_targets(GRID)


def test_what_is_proposed_sees_more_than_places_at_random() -> None:
    found = candidate_sites(GRID, 8, TARGETS, above_ground_m=[30.0])
    assert 4 <= len(found) <= 8
    assert found.above_ground_m == pytest.approx(30.0, abs=1e-3)
    west_m, south_m, east_m, north_m = GRID.bounds_m
    places_m = np.random.default_rng(0).uniform((west_m, south_m), (east_m, north_m), (40, 2))
    col, row = np.rint((places_m[:, 0] - west_m) / 30.0), np.rint((north_m - places_m[:, 1]) / 30.0)
    ground_m = GRID.heights_m[row.astype(int), col.astype(int)]
    drawn_m = np.column_stack([west_m + col * 30.0, north_m - row * 30.0, ground_m + 30.0])
    proposed, drawn = (exact_sight(GRID, at_m, TARGETS.point_m).mean(axis=1) for at_m in (found.position_m, drawn_m))
    assert proposed[0] > np.quantile(drawn, 0.9)
    assert proposed.mean() > drawn.mean()


def test_proposals_stand_apart_within_their_area_at_every_height() -> None:
    west_m, south_m, east_m, north_m = GRID.bounds_m
    area = shapely.box(west_m, south_m, (west_m + east_m) / 2.0, north_m)
    found = candidate_sites(GRID, 5, TARGETS, above_ground_m=[20.0, 60.0], area=area, min_separation_m=240.0)
    assert shapely.intersects_xy(area, *found.position_m[:, :2].T).all()
    for height_m in (20.0, 60.0):
        at_m = found.position_m[np.isclose(found.above_ground_m, height_m, atol=1e-3), :2]
        apart_m = np.linalg.norm(at_m[:, None] - at_m[None], axis=2)[np.triu_indices(len(at_m), 1)]
        assert len(at_m) > 1
        assert (apart_m >= 240.0 - 1e-6).all()


def test_they_see_the_path_that_is_asked_about_and_serve_a_placement() -> None:
    west_m, south_m, _, _ = GRID.bounds_m
    path = path_targets(GRID, [(west_m + 90.0, south_m + 90.0), (west_m + 500.0, south_m + 90.0)])
    found = candidate_sites(GRID, 12, path, above_ground_m=[30.0])
    placed = place_anchors(GRID, found, path, 2, Goal("coverage", min_anchors=1))
    assert placed.value > 0.9


def test_what_cannot_be_proposed_is_refused() -> None:
    far = shapely.box(-9e6, -9e6, -8e6, -8e6)
    for sentence, words in (
        ("1 to 5,000,000 sites, not 0", {"count": 0, "above_ground_m": [30.0]}),
        ("at least one height above ground", {"count": 3, "above_ground_m": []}),
        ("at least one height above ground", {"count": 3, "above_ground_m": [-1.0]}),
        ("holds no known post", {"count": 3, "above_ground_m": [30.0], "area": far}),
    ):
        with pytest.raises(PlacementError, match=sentence):
            candidate_sites(GRID, words.pop("count"), TARGETS, **words)
