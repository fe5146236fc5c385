"""Maps of sites: against marching rays one by one, exact sight, closed forms and the mutuality of sight."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import spearmanr

from dem_samples import load_sample
from terrain import ElevationGrid
from tests.reference.total_visibility import seen_posts
from visibility import FLAT, VISIBLE, Anchor, Curvature, VisibilityInputError, min_visible_altitude
from visibility.sites import best_sites, site_map

CELL_M = (30.0, 20.0)


def ground(heights_m: np.ndarray) -> ElevationGrid:
    return ElevationGrid(
        np.asarray(heights_m, np.float32), CELL_M[0], CELL_M[1], origin_east_m=400_000.0, origin_north_m=3_800_000.0
    )


def rough(rows: int, cols: int, seed: int, unknown: int) -> np.ndarray:
    generator = np.random.default_rng(seed)
    heights_m = generator.uniform(0.0, 40.0, (rows, cols))
    heights_m.flat[generator.choice(rows * cols, unknown, replace=False)] = np.nan
    return heights_m


@settings(max_examples=25, deadline=None)
@given(
    rows=st.integers(2, 9),
    cols=st.integers(2, 9),
    seed=st.integers(0, 2**31),
    unknown=st.integers(0, 3),
    site_m=st.sampled_from([0.0, 2.0, 15.0]),
    target_m=st.sampled_from([0.0, 1.5, 10.0]),
    max_range_m=st.sampled_from([math.inf, 75.0]),
    radius_m=st.sampled_from([math.inf, 9_000.0]),
)
def test_every_ray_is_as_marched_by_itself(
    rows: int, cols: int, seed: int, unknown: int, site_m: float, target_m: float, max_range_m: float, radius_m: float
) -> None:
    heights_m = rough(rows, cols, seed, unknown)
    targets = np.random.default_rng(seed).random((rows, cols)) < 0.7
    known = targets & ~np.isnan(heights_m)
    if not known.any():
        return
    curvature = Curvature(radius_m)
    found = site_map(
        ground(heights_m),
        site_m,
        target_m,
        targets=targets,
        max_range_m=max_range_m,
        directions=16,
        curvature=curvature,
    )
    told = np.float32(heights_m).astype(float)
    asked = (told, known * 1.0, site_m, target_m, CELL_M, 16, max_range_m, curvature.drop_per_m2)
    surely, possibly = (seen_posts(*asked, unknown_hides=hides) for hides in (True, False))
    # a ray that touches the ground within the rounding of float32 may go either way
    cell_m2 = CELL_M[0] * CELL_M[1]
    assert np.array_equal(np.isnan(found.seen_m2), np.isnan(surely))
    for area_m2, posts in ((found.seen_m2, surely), (found.seen_m2 + found.undecided_m2, possibly)):
        close = np.isclose(area_m2 / cell_m2, posts, rtol=1e-4, atol=1e-3, equal_nan=True)
        assert np.count_nonzero(~close) <= max(1.0, 0.02 * close.size)
    assert found.target_m2 == pytest.approx(known.sum() * cell_m2)


def test_over_a_plane_a_site_sees_the_disc_of_its_range() -> None:
    found = site_map(ground(np.zeros((241, 161))), 10.0, 1.5, max_range_m=1500.0, curvature=FLAT)
    assert found.seen_m2[120, 80] == pytest.approx(math.pi * 1500.0**2, rel=0.03)
    everything = site_map(ground(np.zeros((61, 61))), 10.0, 1.5, curvature=FLAT)
    assert everything.seen_share[30, 30] == pytest.approx(1.0, rel=0.02)
    assert everything.undecided_m2.max() == 0.0


def test_over_a_ball_a_site_sees_as_far_as_its_horizon() -> None:
    site_m, radius_m = 4.0, 120_000.0
    found = site_map(ground(np.zeros((121, 121))), site_m, 0.0, curvature=Curvature(radius_m))
    horizon_m = math.sqrt(2.0 * radius_m * site_m)
    assert found.seen_m2[60, 60] == pytest.approx(math.pi * horizon_m**2, rel=0.05)


@pytest.mark.parametrize("sample", ["valley", "crater"])
def test_sites_rank_as_exact_sight_ranks_them(sample: str) -> None:
    grid = load_sample(sample)
    found = site_map(grid, 20.0, 1.5)
    generator = np.random.default_rng(7)
    rows, cols = (generator.integers(0, size, 60) for size in grid.shape)
    anchors = [
        Anchor(f"S{n}", *map(float, grid.position_of(r, c)), float(grid.heights_m[r, c]) + 20.0)
        for n, (r, c) in enumerate(zip(rows, cols, strict=True))
        if not math.isnan(grid.heights_m[r, c])
    ]
    seen = (min_visible_altitude(grid, anchors, "exact").visible(above_ground_m=1.5) == VISIBLE).sum(axis=(1, 2))
    kept = ~np.isnan(found.seen_m2[rows, cols])
    assert spearmanr(seen, found.seen_m2[rows, cols][kept]).statistic >= 0.98


def test_sight_is_mutual() -> None:
    grid = load_sample("valley")
    sees, seen = site_map(grid, 20.0, 1.5), site_map(grid, 1.5, 20.0)
    assert float(sees.seen_m2.sum()) == pytest.approx(float(seen.seen_m2.sum()), rel=0.02)


def test_behind_unknown_ground_sight_is_undecided() -> None:
    heights_m = np.zeros((41, 41))
    heights_m[:, 25] = np.nan
    found = site_map(ground(heights_m), 10.0, 1.5, curvature=FLAT)
    behind = 15 * 41 * CELL_M[0] * CELL_M[1]
    # rays that reach the unknown column between two posts end there with the column before it
    assert found.undecided_m2[20, 10] == pytest.approx(behind, rel=0.15)
    assert found.seen_m2[20, 10] + found.undecided_m2[20, 10] == pytest.approx(found.target_m2, rel=0.03)
    assert np.isnan(found.seen_m2[20, 25])


def test_the_best_sites_are_apart_and_where_they_may_be() -> None:
    grid = load_sample("valley")
    found = site_map(grid, 20.0, 1.5, directions=64)
    sites = best_sites(found, 12, 600.0)
    assert len(sites) == 12
    assert [site.seen_m2 for site in sites] == sorted((site.seen_m2 for site in sites), reverse=True)
    assert sites[0].seen_m2 == np.nanmax(found.seen_m2)
    for number, one in enumerate(sites):
        assert all(math.hypot(one.east_m - b.east_m, one.north_m - b.north_m) >= 600.0 for b in sites[:number])
    within = np.zeros(grid.shape, np.bool_)
    within[10:40, 20:60] = True
    assert all(within[site.row, site.col] for site in best_sites(found, 5, 300.0, within))
    assert len(best_sites(found, 5, 1e6)) == 1


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ({"site_above_ground_m": -1.0}, "A site stands at or above the ground"),
        ({"target_above_ground_m": math.nan}, "A target stands at or above the ground"),
        ({"directions": 30}, "a multiple of four from 16 to 7200, not 30"),
        ({"max_range_m": 0.0}, "positive range, not 0 m"),
        ({"targets": np.zeros((5, 5), np.bool_)}, "no known target ground"),
        ({"targets": np.ones((4, 5), np.bool_)}, r"Targets are \(5, 5\) like the grid"),
    ],
)
def test_a_wrong_question_is_refused_in_a_sentence(words: dict[str, object], sentence: str) -> None:
    asked = {"site_above_ground_m": 10.0, **words}
    with pytest.raises(VisibilityInputError, match=sentence):
        site_map(ground(np.zeros((5, 5))), **asked)  # type: ignore[arg-type] # wrong on purpose
