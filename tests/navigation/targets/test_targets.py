"""Balls and planes in depth images: against truth, against least squares, against real balls, and as a pose."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from navigation import MeasurementError, StateError
from navigation.targets import (
    KINECT,
    DepthSensor,
    Limb,
    TargetPixels,
    fit_plane,
    fit_sphere,
    fit_sphere_algebraic,
    fit_sphere_in_image,
    quantisation_sigma_m,
)
from navigation.targets.kernels import spheres as kernel
from tests.house.repository import ROOT
from tests.reference import depth_images

REAL = ROOT / "../shared/data/spheres/dcct/DepthSpherePoints.mat"
GEOMETRY = (580.0, 319.5, 239.5)
NUMBERS = (3.3309, 0.00307)
RADIUS_M = 0.152


def pixels_of(surface, seed, step=NUMBERS[1]):
    rng = np.random.default_rng(seed)
    return TargetPixels(*depth_images.image(surface, (*GEOMETRY, NUMBERS[0], step), rng))


def balls(distance_m, count, step=NUMBERS[1]):
    """(truth, pixels) of balls about so far away, off the axis."""
    for seed in range(count):
        rng = np.random.default_rng(100 + seed)
        right, down = rng.uniform(-0.15, 0.15), rng.uniform(-0.1, 0.1)
        centre = np.array([right * distance_m, down * distance_m, distance_m + rng.uniform(-0.03, 0.03)])
        yield centre, pixels_of(depth_images.ball(centre, RADIUS_M), seed, step)


def test_numbers_are_the_kinects_and_its_depths_go_there_and_back():
    assert KINECT.depths_m(0.0) == pytest.approx(1.0 / 3.3309)
    assert KINECT.depths_m(1000.0) == pytest.approx(1.0 / (3.3309 - 3.07))
    depths = KINECT.depths_m(np.arange(500, 1000))
    assert np.array_equal(KINECT.numbers_of(depths), np.arange(500, 1000))
    assert KINECT.step_m(3.0) == pytest.approx(0.0276, abs=1e-4)
    assert np.isnan(KINECT.depths_m(1090.0))


@pytest.mark.parametrize(("distance_m", "levels", "doubled"), [(0.9, 60, 30), (3.0, 5, 4)])
def test_the_reports_levels_over_a_ball_are_those_of_double_the_step(distance_m, levels, doubled):
    def seen(step):
        surface = depth_images.ball((0.0, 0.0, distance_m), 0.15)
        depths = depth_images.image(surface, (*GEOMETRY, NUMBERS[0], step))[2]
        return len(np.unique(np.round(depths, 6)))

    assert abs(seen(0.00307) - levels) <= 0.15 * levels + 1
    assert abs(seen(0.00614) - doubled) <= 0.15 * doubled + 1


def test_exact_points_of_a_ball_give_that_ball_in_both_common_fits():
    rng = np.random.default_rng(1)
    away = rng.normal(size=(200, 3))
    points = (0.3, -0.2, 2.0) + 0.15 * away / np.linalg.norm(away, axis=1)[:, None]
    for fit in (fit_sphere_algebraic, fit_sphere):
        found = fit(points)
        assert found.centre_m == pytest.approx([0.3, -0.2, 2.0], abs=1e-9)
        assert found.radius_m == pytest.approx(0.15, abs=1e-9)


def test_derivatives_of_the_likelihood_are_those_of_differences():
    centre, pixels = next(balls(1.5, 1))
    rays = np.concatenate([KINECT.rays(pixels.cols, pixels.rows), KINECT.rays([200.0, 250.0], [100.0, 239.0])])
    observed = kernel.Pixels(
        rays[::37].copy(), np.append(KINECT.numbers_of(pixels.depths_m), [np.nan] * 2)[::37].copy()
    )
    spread, score, unused = kernel.Spread(*NUMBERS, 0.6, 2e-3, 1e-3), np.zeros(4), np.zeros((4, 4))
    ball = np.append(centre, RADIUS_M) + np.array([0.001, -0.001, 0.003, -0.001])
    kernel.sphere_likelihood(observed, ball, spread, score, unused)
    differences = []
    for i in range(4):
        ends = [
            kernel.sphere_likelihood(observed, ball + sign * 1e-6 * np.eye(4)[i], spread, np.zeros(4), unused)
            for sign in (1.0, -1.0)
        ]
        differences.append((ends[0] - ends[1]) / 2e-6)
    assert score == pytest.approx(differences, rel=2e-3, abs=1.0)


@pytest.mark.parametrize(("distance_m", "share"), [(1.0, 0.0003), (3.0, 0.001)])
def test_knowing_the_steps_and_the_outline_a_ball_is_where_it_is(distance_m, share):
    found, off, radii, promised = [], [], [], []
    for centre, pixels in balls(distance_m, 12):
        fit = fit_sphere_in_image(pixels, KINECT)
        found.append(np.linalg.norm(fit.centre_m - centre))
        off.append(np.linalg.norm(fit_sphere_algebraic(pixels.points_m(KINECT)).centre_m - centre))
        radii.append(fit.radius_m - RADIUS_M)
        promised.append(fit.radius_sigma_m)
    assert np.sqrt(np.mean(np.square(found))) < share * distance_m
    assert np.std(radii) < 0.0035
    assert np.sqrt(np.mean(np.square(off))) > 2.5 * np.sqrt(np.mean(np.square(found)))
    assert 0.4 < np.sqrt(np.mean(np.square(radii))) / np.mean(promised) < 2.0


def test_at_double_the_step_the_common_fit_is_off_by_half_a_percent_as_the_report_has_it():
    sensor = dataclasses.replace(KINECT, step_per_m=2.0 * NUMBERS[1])
    off, found = [], []
    for centre, pixels in balls(3.0, 12, sensor.step_per_m):
        off.append(np.linalg.norm(fit_sphere_algebraic(pixels.points_m(sensor)).centre_m - centre))
        found.append(np.linalg.norm(fit_sphere_in_image(pixels, sensor).centre_m - centre))
    assert np.sqrt(np.mean(np.square(off))) > 0.005 * 3.0
    assert np.sqrt(np.mean(np.square(found))) < 0.001 * 3.0


@pytest.mark.parametrize("distance_m", [0.8, 1.5, 3.0])
def test_residuals_of_an_inclined_plane_are_those_of_rounding(distance_m):
    normal = np.array([0.5, 0.2, -0.8]) / np.linalg.norm([0.5, 0.2, -0.8])
    surface = depth_images.plane(normal, -abs(normal[2]) * distance_m, 0.4)
    points = depth_images.image(surface, (*GEOMETRY, *NUMBERS))
    fit = fit_plane(TargetPixels(*points).points_m(KINECT))
    assert fit.sigma_m == pytest.approx(quantisation_sigma_m(KINECT, fit), rel=0.1)
    assert fit.normal == pytest.approx(-normal if normal @ fit.centre_m > 0 else normal, abs=2e-3)


def test_planes_keep_their_covariance():
    normal = np.array([0.4, 0.1, -0.9]) / np.linalg.norm([0.4, 0.1, -0.9])
    rng, turns, promised = np.random.default_rng(3), [], []
    axes = np.linalg.svd(normal[None])[2][1:]
    for _ in range(300):
        flat = rng.uniform(-1.0, 1.0, (60, 2)) * (0.6, 0.2)
        points = flat @ axes - 2.0 * normal + rng.normal(0.0, 0.01, (60, 1)) * normal
        fit = fit_plane(points)
        turned = np.cross(fit.normal, normal)
        turns.append((turned @ axes[0], turned @ axes[1]))
        promised.append(np.sqrt(np.diag(fit.covariance))[:2])
    assert np.std(turns, axis=0) == pytest.approx(np.mean(promised, axis=0), rel=0.15)


@pytest.mark.skipif(not REAL.exists(), reason="the depth points of ../shared are not here")
def test_real_balls_have_radii_that_spread_less_than_least_squares_make_of_them():
    from scipy.io import loadmat

    sets = [TargetPixels(*np.asarray(one["points"], float)) for one in loadmat(REAL)["U_depth_clicked"][0]]
    every = np.concatenate([one.depths_m for one in sets])
    # neither its intrinsics nor its steps are stated: those of the kind, and the step that the depths show
    sensor = DepthSensor(*GEOMETRY, 3.3309, 0.002897).with_levels_of(every)
    common = [fit_sphere(one.points_m(sensor)).radius_m for one in sets]
    aware = [fit_sphere_in_image(one, sensor).radius_m for one in sets]
    without = [fit_sphere_in_image(one, sensor, Limb(0.0, 3.0)).radius_m for one in sets]
    assert np.std(common, ddof=1) == pytest.approx(0.0016, abs=0.0002)
    assert np.std(aware, ddof=1) < 0.0012
    assert np.std(without, ddof=1) > np.std(common, ddof=1), "without the outline it is worse, as was known"


def test_points_that_are_no_ball_are_told():
    normal = np.array([0.3, 0.0, -0.95]) / np.linalg.norm([0.3, 0.0, -0.95])
    flat = pixels_of(depth_images.plane(normal, -1.9, 0.3), 1)
    for fit in (
        lambda: fit_sphere_algebraic(flat.points_m(KINECT)),
        lambda: fit_sphere(flat.points_m(KINECT)),
        lambda: fit_sphere_in_image(flat, KINECT),
    ):
        with pytest.raises(MeasurementError, match="lie on a plane"):
            fit()
    with pytest.raises(MeasurementError, match="lie on a plane"):
        fit_sphere(np.column_stack([np.indices((4, 4)).reshape(2, -1).T, np.ones(16)]))
    with pytest.raises(MeasurementError, match="12 points at least, not 5"):
        fit_sphere(np.eye(5, 3))
    with pytest.raises(MeasurementError, match="four points at least, not 3"):
        fit_plane(np.eye(3))
    with pytest.raises(MeasurementError, match="on one line"):
        fit_plane(np.outer(np.arange(5.0), (1.0, 2.0, 3.0)))


def test_a_small_patch_of_a_far_wall_is_no_ball_though_its_few_steps_would_bend():
    """A wall of two or three steps is bent like a ball as well as not: 13 pixels wide it is 3 cm of radius."""
    rng, taken = np.random.default_rng(0), 0
    cols, rows = (one.ravel() for one in np.meshgrid(np.arange(13.0), np.arange(13.0)))
    for _ in range(150):
        first = rng.integers(0, (600, 440))
        rays = KINECT.rays(cols + first[0], rows + first[1])
        tilt, turn, range_m = rng.uniform(0.0, 1.0), rng.uniform(0.0, 2.0 * np.pi), rng.uniform(1.0, 4.5)
        normal = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)])
        depths_m = range_m * (rays[84] @ normal) / (rays @ normal)
        numbers = np.rint((NUMBERS[0] - 1.0 / depths_m) / NUMBERS[1] + rng.normal(0.0, 0.2, len(cols)))
        patch = TargetPixels(cols + first[0], rows + first[1], KINECT.depths_m(numbers))
        with pytest.raises(MeasurementError, match="lie on a plane to"):
            fit_sphere_in_image(patch, KINECT)
        try:
            fit_sphere(patch.points_m(KINECT))
            taken += 1
        except MeasurementError:
            pass
    assert taken > 0, "which knows nothing of steps"
    # and a ball of five steps is one
    centre, pixels = next(balls(4.0, 1))
    assert np.linalg.norm(fit_sphere_in_image(pixels, KINECT).centre_m - centre) < 0.004


def test_pixels_and_sensors_that_make_no_sense_are_refused():
    with pytest.raises(MeasurementError, match="depths above zero"):
        TargetPixels([1.0], [2.0], [-1.0])
    with pytest.raises(MeasurementError, match="cols must have shape"):
        TargetPixels([1.0, 2.0], [2.0], [1.0])
    with pytest.raises(MeasurementError, match="above zero"):
        DepthSensor(0.0, 1.0, 1.0)
    with pytest.raises(MeasurementError, match="zero or more"):
        Limb(-1.0, math.inf)
    kept = TargetPixels([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.0, math.nan, 0.0])
    assert len(kept.depths_m) == 1
    assert issubclass(StateError, Exception)
