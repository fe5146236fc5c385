"""Maps of position error in metres are the error at each place, weighted by what ranges and poses are worth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.visibility.morphing_cases import low_anchors
from visibility import (
    Anchor,
    AnchorError,
    DistantAnchor,
    VisibilityInputError,
    min_visible_altitude,
    position_error_map,
    visible_sets,
)
from visibility.dilution import DopReason, position_error, position_error_along, rover_normals

POSE_M2 = ((0.04, 0.01, 0.0), (0.01, 0.09, 0.02), (0.0, 0.02, 0.25))


@pytest.fixture(scope="module")
def minimum():
    grid, anchors, _ = low_anchors(7)
    weighed = [
        replace(anchor, ranging_sigma_m=0.1 + 0.1 * n, pose_sigma_m=0.05 * n) for n, anchor in enumerate(anchors)
    ]
    weighed[0] = replace(weighed[0], pose_sigma_m=0.0, pose_covariance_m2=POSE_M2)
    return min_visible_altitude(grid, weighed)


def at_posts(minimum, above_m):
    grid = minimum.grid
    row, col = (axis.ravel() for axis in np.indices(grid.shape))
    east_m, north_m = grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m
    return np.column_stack([east_m, north_m, grid.heights_m.ravel() + np.float32(above_m)])


@pytest.mark.parametrize("on_surface", [False, True], ids=["free", "on the ground"])
@pytest.mark.parametrize("kind", ["ranging", "pseudorange", "tdoa"])
def test_each_post_has_the_error_of_the_anchors_that_it_sees(minimum, kind, on_surface):
    points_m = at_posts(minimum, 1.5)
    anchors = minimum.anchors
    poses_m2 = [np.array(a.pose_covariance_m2 or a.pose_sigma_m**2 * np.eye(3)) for a in anchors]
    expected = position_error(
        [(a.east_m, a.north_m, a.altitude_m) for a in anchors],
        points_m,
        [a.ranging_sigma_m for a in anchors],
        kind,
        pose_covariance_m2=poses_m2,
        visible=visible_sets(minimum, points_m).visible(),
        surface_normal=rover_normals(minimum.grid, points_m[:, 0], points_m[:, 1]) if on_surface else None,
    )
    found = position_error_map(minimum, 1.5, kind, on_surface=on_surface)
    for name in ("horizontal_sigma_m", "vertical_sigma_m", "position_sigma_m"):
        assert np.allclose(getattr(found, name).ravel(), getattr(expected, name), rtol=1e-5, equal_nan=True)
    assert (found.reasons == DopReason.OK).any()
    assert np.array_equal(np.isfinite(found.position_sigma_m), found.reasons == DopReason.OK)
    along = position_error_along(minimum, points_m, kind, on_surface=on_surface)
    assert np.allclose(along.position_sigma_m, expected.position_sigma_m, equal_nan=True)


def test_twice_the_sigmas_is_twice_the_error(minimum):
    doubled = [
        replace(
            anchor,
            ranging_sigma_m=2.0 * anchor.ranging_sigma_m,
            pose_sigma_m=2.0 * anchor.pose_sigma_m,
            pose_covariance_m2=anchor.pose_covariance_m2 and tuple(tuple(4.0 * m2 for m2 in row) for row in POSE_M2),
        )
        for anchor in minimum.anchors
    ]
    one = position_error_map(minimum, 1.5).position_sigma_m
    two = position_error_map(replace(minimum, anchors=tuple(doubled)), 1.5).position_sigma_m
    assert np.allclose(two, 2.0 * one, rtol=1e-5, equal_nan=True)


def test_an_anchor_without_any_error_is_refused_by_name(minimum):
    perfect = (replace(minimum.anchors[0], ranging_sigma_m=0.0, pose_covariance_m2=None), *minimum.anchors[1:])
    with pytest.raises(VisibilityInputError, match="its ranging_sigma_m is 0 and its pose is without error"):
        position_error_map(replace(minimum, anchors=perfect), 1.5)
    sky = DistantAnchor("G01", 0.0, 1.0, ranging_sigma_m=0.0)
    with pytest.raises(VisibilityInputError, match="Anchor G01: its ranging_sigma_m is 0"):
        position_error_map(replace(minimum, anchors=(sky, *minimum.anchors[1:])), 1.5)


@pytest.mark.parametrize(
    ("covariance_m2", "sigma_m", "sentence"),
    [
        (POSE_M2, 0.1, "give pose_sigma_m or pose_covariance_m2, not both"),
        (((1.0, 0.5, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), 0.0, "and symmetric"),
        (((1.0, 2.0, 0.0), (2.0, 1.0, 0.0), (0.0, 0.0, 1.0)), 0.0, "negative variance -1 m²"),
    ],
)
def test_what_is_no_covariance_of_a_pose_is_refused(covariance_m2, sigma_m, sentence):
    with pytest.raises(AnchorError, match=sentence):
        Anchor("A", 0.0, 0.0, 0.0, pose_sigma_m=sigma_m, pose_covariance_m2=covariance_m2)
