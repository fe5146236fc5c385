"""The made-up grounds are the shapes that they say, and their closed forms hold on the surface that the engines see."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from terrain import ElevationGrid, ElevationGridError, cone, fractal, height_at, horizon_distance_m, plane, ridge, wedge

unhurried = settings(deadline=None)


def lowest_clear_altitude(grid: ElevationGrid, eye: tuple[float, float, float], east_m: float, north_m: float) -> float:
    """Brute force along one line: the lowest altitude at a place that a dense row of ground samples leaves in sight."""
    over_the_middle = [-eye[0] / (east_m - eye[0])] if eye[0] < 0.0 < east_m else []
    share = np.concatenate([np.linspace(0.0, 1.0, 20_001)[1:], over_the_middle])
    ground_m = height_at(grid, eye[0] + share * (east_m - eye[0]), eye[1] + share * (north_m - eye[1]))
    return float(np.nanmax(eye[2] + (ground_m - eye[2]) / share))


@pytest.mark.parametrize("grid", [plane(), ridge(), wedge(), cone()], ids=lambda grid: grid.provenance.source)
def test_the_middle_post_is_at_zero_zero(grid: ElevationGrid) -> None:
    assert grid.position_of(grid.rows // 2, grid.cols // 2) == (0.0, 0.0)
    assert grid.crs is None
    assert grid.unknown_posts == 0


@unhurried
@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-900.0, 900.0), st.floats(-900.0, 900.0))
def test_a_plane_is_its_equation(slope_east: float, slope_north: float, east_m: float, north_m: float) -> None:
    grid = plane(slope_east=slope_east, slope_north=slope_north, height_m=50.0)
    expected = 50.0 + slope_east * east_m + slope_north * north_m
    assert float(height_at(grid, east_m, north_m)) == pytest.approx(expected, abs=1e-3)


def test_the_horizon_of_an_eye_and_a_target_over_curved_ground() -> None:
    # a 1.7 m tall person sees 4.65 km of sea without refraction; 5 km is what they are told
    assert horizon_distance_m(1.7, 0.0, 6.371e6, 1.0) == pytest.approx(4654.0, abs=1.0)
    distance_m = horizon_distance_m(30.0, 10.0, 6.371e6)

    def lowered(d):
        return d * d / (2.0 * 4.0 / 3.0 * 6.371e6)  # the drop of the ground, as the engines apply it

    touch_m = math.sqrt(2.0 * 4.0 / 3.0 * 6.371e6 * 30.0)
    line_at_touch_m = 30.0 + (10.0 - lowered(distance_m) - 30.0) * touch_m / distance_m
    assert line_at_touch_m == pytest.approx(-lowered(touch_m), abs=1e-6), "the line just touches the ground"


@unhurried
@given(st.floats(10.0, 900.0), st.floats(10.0, 900.0), st.floats(0.0, 150.0), st.floats(-900.0, 900.0))
def test_behind_a_knife_edge_the_shadow_is_the_line_over_its_crest(
    before_m: float, behind_m: float, eye_m: float, north_m: float
) -> None:
    expected = max(0.0, 100.0 + (100.0 - eye_m) * behind_m / before_m)
    found = lowest_clear_altitude(ridge(), (-before_m, north_m, eye_m), behind_m, north_m)
    assert found == pytest.approx(expected, rel=2e-3, abs=0.2)


@unhurried
@given(st.floats(0.0, 80.0), st.floats(210.0, 900.0), st.floats(-190.0, -1.0))
def test_the_whole_ramp_of_a_wedge_is_in_sight_from_below(eye_m: float, before_m: float, ramp_m: float) -> None:
    ground_m = float(height_at(wedge(), ramp_m, 0.0))
    assert ground_m == pytest.approx(100.0 + 0.5 * ramp_m, abs=1e-3)
    assert lowest_clear_altitude(wedge(), (-before_m, 0.0, eye_m), ramp_m, 0.0) == pytest.approx(ground_m, abs=1e-2)


def test_behind_the_crest_of_a_wedge_the_ridges_formula_holds() -> None:
    found = lowest_clear_altitude(wedge(), (-500.0, 0.0, 20.0), 300.0, 0.0)
    assert found == pytest.approx(100.0 + 80.0 * 300.0 / 500.0, rel=1e-4)


def test_the_cone_lies_above_its_triangles_by_less_than_it_says() -> None:
    grid = cone(60, 10.0, slope=0.5, apex_m=250.0)
    rng = np.random.default_rng(4)
    east_m, north_m = np.concatenate([rng.uniform(-300, 300, (2, 10_000)), rng.uniform(-10, 10, (2, 10_000))], axis=1)
    above_m = 250.0 - 0.5 * np.hypot(east_m, north_m) - height_at(grid, east_m, north_m)
    assert above_m.min() > -1e-4
    assert above_m.max() <= (1.0 - math.sqrt(0.5)) * 0.5 * 10.0 + 1e-4
    assert above_m.max() > 0.9 * (1.0 - math.sqrt(0.5)) * 0.5 * 10.0, "the bound is met"


def test_behind_the_apex_of_a_cone_the_shadow_is_the_line_over_it() -> None:
    found = lowest_clear_altitude(cone(), (-600.0, 0.0, 10.0), 400.0, 0.0)
    assert found == pytest.approx(100.0 + 90.0 * 400.0 / 600.0, rel=1e-4)


@pytest.mark.parametrize("side", [-1, 1])
def test_the_tangent_lines_of_a_cone_part_sight_from_shadow(side: int) -> None:
    slope, apex_m, eye_m, distance_m, cell_m = 0.5, 400.0, 30.0, 950.0, 5.0
    grid = cone(240, cell_m, slope=slope, apex_m=apex_m)
    tangent = math.acos((apex_m - eye_m) / (slope * distance_m))
    for angle, hidden in ((tangent - 0.12, False), (tangent + 0.12, True)):
        east_m, north_m = -400.0 * math.cos(angle), side * 400.0 * math.sin(angle)
        ground_m = float(height_at(grid, east_m, north_m))
        shadow_m = lowest_clear_altitude(grid, (-distance_m, 0.0, eye_m), east_m, north_m)
        facet_m = (1.0 - math.sqrt(0.5)) * slope * cell_m
        assert (shadow_m > ground_m + facet_m) == hidden


def reference_fractal(n: int, seed: int) -> np.ndarray:
    """The generator with which the speed and accuracy facts were measured, as published with them."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft2(rng.standard_normal((n, n)))
    k = np.hypot(np.fft.fftfreq(n)[:, None], np.fft.rfftfreq(n)[None, :])
    k[0, 0] = 1
    z = np.fft.irfft2(spectrum * k**-1.6, s=(n, n))
    return ((z - z.min()) / (z.max() - z.min()) * 1500.0).astype("f4")


@pytest.mark.parametrize(("posts", "seed"), [(64, 1), (65, 7), (256, 3)])
def test_the_fractal_is_the_one_that_the_facts_were_measured_on(posts: int, seed: int) -> None:
    grid = fractal(posts, seed)
    np.testing.assert_array_equal(grid.heights_m, reference_fractal(posts, seed))
    assert (float(grid.heights_m.min()), float(grid.heights_m.max())) == (0.0, 1500.0)
    assert grid.cell_east_m == 30.0


def test_seeds_and_slopes_make_different_fractals() -> None:
    assert fractal(32, 1).digest != fractal(32, 2).digest
    assert np.abs(np.diff(fractal(64, slope=1.0).heights_m)).mean() > np.abs(np.diff(fractal(64).heights_m)).mean()


def test_too_few_posts_are_refused() -> None:
    with pytest.raises(ElevationGridError, match="at least 2 posts"):
        fractal(1)
    with pytest.raises(ElevationGridError, match="half_posts must be at least 1"):
        cone(0)
