"""Position error in metres: weighted least squares, anchors' own errors, and how often the truth is where it says."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference import dop as reference
from visibility import VisibilityInputError, dop
from visibility.dilution import DopReason, position_error

KINDS = ["ranging", "pseudorange", "tdoa"]
many = settings(max_examples=60, deadline=None)
seeds = st.integers(0, 2**32 - 1)
ORIGIN = [0.0, 0.0, 0.0]
ANCHORS_M = np.random.default_rng(8).normal(size=(7, 3)) * [300.0, 300.0, 120.0]


def covariances(seed, anchors):
    """Random covariances (anchors, 3, 3), m²."""
    roots = np.random.default_rng(seed).normal(size=(anchors, 3, 3))
    return roots @ roots.transpose(0, 2, 1) + 0.01 * np.eye(3)


@pytest.mark.parametrize("kind", KINDS)
def test_with_one_sigma_for_all_the_error_is_dop_times_sigma(kind):
    found, dilution = position_error(ANCHORS_M, ORIGIN, 0.3, kind), dop(ANCHORS_M, ORIGIN, kind)
    assert found.position_sigma_m == pytest.approx(0.3 * dilution.pdop)
    assert found.horizontal_sigma_m == pytest.approx(0.3 * dilution.hdop)
    assert found.vertical_sigma_m == found.up_sigma_m == pytest.approx(0.3 * dilution.vdop)
    assert found.clock_sigma_m == pytest.approx(0.3 * dilution.tdop)
    assert math.hypot(found.east_sigma_m, found.north_sigma_m) == pytest.approx(found.horizontal_sigma_m)
    assert (found.reason, found.count) == (DopReason.OK, 7)


@many
@given(seeds, st.integers(4, 12), st.sampled_from(KINDS), st.booleans())
def test_the_covariance_is_that_of_weighted_least_squares(seed, anchors, kind, on_surface):
    rng = np.random.default_rng(seed)
    anchors_m, sigma_m, poses_m2 = (
        rng.normal(size=(anchors, 3)) * 200.0,
        rng.uniform(0.05, 2.0, anchors),
        covariances(seed, anchors),
    )
    directions = anchors_m / np.linalg.norm(anchors_m, axis=1)[:, None]
    variances_m2 = sigma_m**2 + np.einsum("ai,aij,aj->a", directions, poses_m2, directions)
    normal = rng.normal(size=3) if on_surface else None
    expected, clock_m2 = reference.covariance(anchors_m, ORIGIN, kind, variances_m2, normal)
    found = position_error(anchors_m, ORIGIN, sigma_m, kind, pose_covariance_m2=poses_m2, surface_normal=normal)
    largest = np.trace(expected)
    np.testing.assert_allclose(found.covariance_m2, expected, rtol=1e-6, atol=1e-8 * largest)
    assert found.clock_sigma_m**2 == pytest.approx(clock_m2, rel=1e-6)


def test_a_pose_error_alike_in_all_directions_adds_to_the_ranging_variance():
    apart = position_error(ANCHORS_M, ORIGIN, 0.3, pose_sigma_m=0.4)
    together = position_error(ANCHORS_M, ORIGIN, 0.5)
    np.testing.assert_allclose(apart.covariance_m2, together.covariance_m2, rtol=1e-12)


def test_only_the_part_of_a_pose_error_along_the_sight_line_counts():
    # anchors due east, north and up, each off only across its own sight line
    anchors_m = np.eye(3) * 100.0
    across = np.array([np.diag([0.0, 9.0, 9.0]), np.diag([9.0, 0.0, 9.0]), np.diag([9.0, 9.0, 0.0])])
    found = position_error(anchors_m, ORIGIN, [0.1, 0.2, 0.3], pose_covariance_m2=across)
    assert (found.east_sigma_m, found.north_sigma_m, found.up_sigma_m) == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize("kind", ["ranging", "pseudorange"])
def test_fixes_with_drawn_errors_scatter_as_the_covariance_says(kind):
    # linear fixes of 40 000 draws: each sample variance is within 4 %, more than five of its own sigmas, of the true
    rng = np.random.default_rng(12)
    sigma_m, poses_m2 = rng.uniform(0.1, 0.6, 7), covariances(3, 7) * 0.05
    found = position_error(ANCHORS_M, ORIGIN, sigma_m, kind, pose_covariance_m2=poses_m2)
    directions = ANCHORS_M / np.linalg.norm(ANCHORS_M, axis=1)[:, None]
    off_m = np.array([rng.multivariate_normal(np.zeros(3), pose, 40_000) for pose in poses_m2])
    errors_m = rng.normal(size=(40_000, 7)) * sigma_m + np.einsum("ani,ai->na", off_m, directions)
    design = -directions if kind == "ranging" else np.column_stack([-directions, np.ones(7)])
    weights = 1.0 / (sigma_m**2 + np.einsum("ai,aij,aj->a", directions, poses_m2, directions))
    fix = np.linalg.solve(design.T * weights @ design, design.T * weights)
    scatter_m2 = np.cov((errors_m @ fix.T)[:, :3].T)
    np.testing.assert_allclose(np.diag(scatter_m2), np.diag(found.covariance_m2), rtol=0.04)


@many
@given(seeds, st.sampled_from(KINDS))
def test_a_better_range_never_makes_the_fix_worse(seed, kind):
    rng = np.random.default_rng(seed)
    sigma_m = rng.uniform(0.1, 2.0, 7)
    better_m = sigma_m.copy()
    better_m[rng.integers(7)] *= 0.3
    before, after = (position_error(ANCHORS_M, ORIGIN, each, kind).covariance_m2 for each in (sigma_m, better_m))
    assert np.linalg.eigvalsh(before - after)[0] >= -1e-9 * np.trace(before)


def test_too_few_anchors_have_an_infinite_error():
    found = position_error(ANCHORS_M, np.zeros((2, 3)), 0.1, visible=[[True] * 7, [True, True] + [False] * 5])
    assert found.reason.tolist() == [DopReason.OK, DopReason.TOO_FEW]
    assert found.covariance_m2.shape == (2, 3, 3)
    assert np.isfinite(found.position_sigma_m).tolist() == [True, False]
    assert np.isposinf(found.covariance_m2[1]).all()


def test_over_ground_of_unknown_slope_the_error_is_unknown():
    found = position_error(ANCHORS_M, ORIGIN, 0.1, surface_normal=[math.nan] * 3)
    assert (found.reason, np.isnan(found.covariance_m2).all()) == (DopReason.UNKNOWN, True)


@pytest.mark.parametrize(
    ("sigma_m", "options", "sentence"),
    [
        (-0.1, {}, "ranging_sigma_m must be finite and >= 0 m, not -0.1"),
        ([0.1, 0.2], {}, r"one number of metres or one for each of the 7 anchors, not shape \(2,\)"),
        ("x", {}, "ranging_sigma_m must hold numbers, one-sigma in metres"),
        (0.1, {"pose_sigma_m": math.inf}, "pose_sigma_m must be finite"),
        (0.0, {}, r"ranging_sigma_m\[0\] and the anchor's pose error are both zero"),
        (0.1, {"pose_sigma_m": 0.1, "pose_covariance_m2": np.eye(3)}, "Give pose_sigma_m or pose_covar.*, not both"),
        (0.1, {"pose_covariance_m2": np.eye(2)}, r"pose_covariance_m2 must be \(3, 3\) or \(7, 3, 3\)"),
        (0.1, {"pose_covariance_m2": np.triu(np.ones((3, 3)))}, "pose_covariance_m2 must be finite and symmetric"),
        (0.1, {"pose_covariance_m2": np.diag([1.0, -1.0, 1.0])}, "anchor 0 is no covariance: .* variance -1"),
    ],
)  # fmt: skip
def test_sigmas_that_make_no_sense_are_refused_in_a_sentence(sigma_m, options, sentence):
    with pytest.raises(VisibilityInputError, match=sentence):
        position_error(ANCHORS_M, ORIGIN, sigma_m, **options)
