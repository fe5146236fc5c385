"""Dilution of precision over every post of a map."""

import math

import numpy as np
import pytest

from terrain import ElevationGrid
from tests.visibility.grounds import clearing_eye, hills, rough
from tests.visibility.test_visible_sets import eyes, over_posts
from visibility import (
    UNKNOWN,
    VISIBLE,
    AntennaLimits,
    DistantAnchor,
    VisibilityInputError,
    dop,
    dop_along,
    dop_map,
    min_visible_altitude,
    visible_sets,
)
from visibility.dilution import GO, NO_GO, DopReason, dop_per_visible_set
from visibility.dilution.ground_normals import post_normals

ABOVE_M = 1.5


def far_and_near(grid, drones=7, satellites=3):
    """Surfaces of drones, one with limits, and of satellites."""
    anchors = [
        *eyes(grid, drones - 1, above_m=60.0),
        clearing_eye(grid, 3.0, 4.0, 90.0, name="L", limits=AntennaLimits(max_range_m=600.0)),
    ]
    anchors += [DistantAnchor(f"S{i}", azimuth_rad=2.1 * i, elevation_rad=0.3 + 0.2 * i) for i in range(satellites)]
    return min_visible_altitude(grid, anchors)  # fmt: skip


def positions_m(minimum):
    """(k, 3) positions of anchors; of distant ones the direction, as a unit vector."""
    rows = []
    for anchor in minimum.anchors:
        if isinstance(anchor, DistantAnchor):
            across = math.cos(anchor.elevation_rad)
            azimuth = anchor.azimuth_rad
            rows.append([across * math.sin(azimuth), across * math.cos(azimuth), math.sin(anchor.elevation_rad)])
        else:
            rows.append([anchor.east_m, anchor.north_m, anchor.altitude_m])
    return rows, [isinstance(anchor, DistantAnchor) for anchor in minimum.anchors]


@pytest.mark.parametrize("kind", ["ranging", "pseudorange", "tdoa"])
@pytest.mark.parametrize("on_surface", [False, True], ids=["free", "on the ground"])
def test_each_post_has_the_dop_of_the_anchors_that_it_sees(kind, on_surface):
    grid = hills()
    minimum = far_and_near(grid)
    anchors_m, distant = positions_m(minimum)
    seen = minimum.visible(above_ground_m=ABOVE_M).reshape(len(anchors_m), -1).T == VISIBLE
    normals = post_normals(grid, 0, grid.rows) if on_surface else None
    expected = dop(anchors_m, over_posts(grid, ABOVE_M), kind, visible=seen, distant=distant, surface_normal=normals)
    for measure in ("gdop", "pdop", "hdop", "vdop", "tdop"):
        found = dop_map(minimum, ABOVE_M, kind, measure=measure, on_surface=on_surface)
        np.testing.assert_array_equal(found.dop.ravel(), getattr(expected, measure).astype(np.float32))
    np.testing.assert_array_equal(found.count.ravel(), seen.sum(axis=1))
    np.testing.assert_array_equal(found.reasons.ravel(), expected.reason)
    assert found.posts_of() == expected.reasons()
    assert found.posts_of()[DopReason.OK] > 100


def test_a_map_in_parts_is_the_map_in_one_piece(monkeypatch):
    minimum = far_and_near(hills())
    whole = dop_map(minimum, ABOVE_M, on_surface=True)
    monkeypatch.setattr("visibility.dilution.dop_maps.POSTS_AT_ONCE", 70)
    parts = dop_map(minimum, ABOVE_M, on_surface=True)
    np.testing.assert_array_equal(parts.dop, whole.dop)
    np.testing.assert_array_equal(parts.count, whole.count)


def with_unknown_ground():
    grid = rough(5, 24, 31)
    heights_m = grid.heights_m.copy()
    heights_m[8:12, 10:13] = np.nan
    return ElevationGrid(heights_m, 30.0, 20.0)


def test_where_an_anchors_visibility_is_unknown_so_is_the_dop():
    grid = with_unknown_ground()
    anchors = [
        clearing_eye(grid, row, col, 30.0, name=f"{row}{col}") for row, col in ((1, 2), (2, 28), (22, 3), (20, 25))
    ]
    minimum = min_visible_altitude(grid, anchors, mode="exact")  # fmt: skip
    unknown = (minimum.visible(above_ground_m=ABOVE_M) == UNKNOWN).any(axis=0)
    found = dop_map(minimum, ABOVE_M)
    np.testing.assert_array_equal(found.unknown, unknown)
    np.testing.assert_array_equal(np.isnan(found.dop), unknown)
    np.testing.assert_array_equal(found.reasons == DopReason.UNKNOWN, unknown)
    assert 9 < unknown.sum() < unknown.size
    assert (found.no_go(3.0)[unknown] == UNKNOWN).all()
    # decided beforehand, only the unknown posts themselves remain unknown
    blocked = dop_map(min_visible_altitude(grid, anchors, mode="exact", unknown="blocked"), ABOVE_M)
    np.testing.assert_array_equal(blocked.unknown, np.isnan(grid.heights_m))


def test_ground_is_no_go_where_the_dop_reaches_the_limit_or_too_few_anchors_are_in_sight():
    minimum = far_and_near(hills())
    found = dop_map(minimum, ABOVE_M)
    for limit, anchors in ((2.5, 0), (1.2, 0), (2.5, 6), (1e9, 0)):
        expected = (found.dop >= np.float32(limit)) | (found.count < anchors)
        np.testing.assert_array_equal(found.no_go(limit, anchors), np.where(expected, NO_GO, GO))
    # a dilution of exactly the limit is no go; under a limit that is the next number up it is go
    dop = found.dop[np.isfinite(found.dop)][0]
    assert (found.no_go(float(dop))[found.dop == dop] == NO_GO).all()
    assert (found.no_go(float(np.nextafter(dop, np.float32(np.inf))))[found.dop == dop] == GO).all()
    # no fix is no go whatever the limit
    assert (found.no_go(1e30)[np.isposinf(found.dop)] == NO_GO).all()


def test_one_dop_per_visible_set_is_that_in_the_middle_of_its_posts():
    grid = hills()
    minimum = far_and_near(grid)
    anchors_m, distant = positions_m(minimum)
    points_m = over_posts(grid, ABOVE_M)
    sets = visible_sets(minimum, points_m)
    found = dop_map(minimum, ABOVE_M, "pseudorange", per_visible_set=True)
    visible = sets.visible()
    for which in np.unique(visible, axis=0):
        same = (visible == which).all(axis=1)
        expected = dop(anchors_m, points_m[same].mean(axis=0), "pseudorange", visible=which, distant=distant)
        np.testing.assert_allclose(found.dop.ravel()[same], np.float32(expected.pdop), rtol=1e-6)
        assert (found.reasons.ravel()[same] == expected.reason).all()
    np.testing.assert_array_equal(found.count, dop_map(minimum, ABOVE_M).count)


def test_one_dop_per_visible_set_is_exact_for_parallel_rays():
    grid = hills()
    satellites = [DistantAnchor(f"S{i}", azimuth_rad=1.3 * i, elevation_rad=0.15 + 0.1 * i) for i in range(8)]
    minimum = min_visible_altitude(grid, satellites)
    each, shared = (dop_map(minimum, ABOVE_M, "pseudorange", per_visible_set=shared) for shared in (False, True))
    np.testing.assert_allclose(shared.dop, each.dop, rtol=1e-6)
    assert len(np.unique(each.dop)) > 3


def test_one_dop_per_visible_set_leaves_the_unknown_out():
    mask = np.array([[7], [7], [7], [3]], np.uint64)
    points_m = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [900.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    anchors_m = np.eye(3) * 50.0
    found = dop_per_visible_set(points_m, anchors_m, mask, unknown=[False, False, True, False])
    middle = dop(anchors_m, [1.0, 0.0, 0.0]).pdop
    np.testing.assert_array_equal(found.pdop, [middle, middle, np.nan, np.inf])
    assert found.reason.tolist() == [DopReason.OK, DopReason.OK, DopReason.UNKNOWN, DopReason.TOO_FEW]


@pytest.mark.parametrize(
    ("arguments", "options", "sentence"),
    [
        ((-0.1,), {}, "Receiver above_ground_m must be >= 0 m, not -0.1"),
        ((math.nan,), {}, "Receiver above_ground_m must be >= 0 m, not nan"),
        ((1.0, "gps"), {}, "kind must be one of ranging, pseudorange, tdoa, not 'gps'"),
        ((1.0,), {"measure": "xdop"}, "measure must be one of gdop, pdop, hdop, vdop, tdop, not 'xdop'"),
        ((1.0,), {"on_surface": True, "per_visible_set": True}, "per_visible_set has no one slope"),
    ],
)
def test_a_map_that_makes_no_sense_is_refused_in_a_sentence(arguments, options, sentence):
    grid = hills()
    with pytest.raises(VisibilityInputError, match=sentence):
        dop_map(min_visible_altitude(grid, eyes(grid, 2)), *arguments, **options)


@pytest.mark.parametrize("limit", [0.0, -2.5, math.nan, math.inf])
def test_a_limit_that_is_no_limit_is_refused(limit):
    grid = hills()
    with pytest.raises(VisibilityInputError, match="dop_limit must be a number > 0"):
        dop_map(min_visible_altitude(grid, eyes(grid, 2)), ABOVE_M).no_go(limit)


def test_along_a_trajectory_over_posts_the_dop_on_the_ground_is_that_of_the_map():
    grid = hills()
    minimum = far_and_near(grid)
    along = dop_along(minimum, over_posts(grid, ABOVE_M), on_surface=True)
    found = dop_map(minimum, ABOVE_M, on_surface=True)
    np.testing.assert_array_equal(along.pdop.astype(np.float32).reshape(grid.shape), found.dop)
