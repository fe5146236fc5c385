"""Dilution of precision against closed forms, and the questions that cannot be answered."""

import math

import numpy as np
import pytest

from visibility import VisibilityInputError, dop
from visibility.dilution import DopReason, dop_at_points, least_anchors, pack_sets

TETRAHEDRON_M = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 70.0
KINDS = ["ranging", "pseudorange", "tdoa"]
ROUNDING = 1e-12


def ring(anchors, distance_m, elevation_rad, turned_rad=0.1):
    """Anchors all round the origin, at one distance and elevation."""
    azimuth_rad = turned_rad + np.arange(anchors) * 2.0 * np.pi / anchors
    across_m = distance_m * math.cos(elevation_rad)
    up_m = np.full(anchors, distance_m * math.sin(elevation_rad))
    return np.column_stack([across_m * np.sin(azimuth_rad), across_m * np.cos(azimuth_rad), up_m])


@pytest.mark.parametrize("kind", KINDS)
def test_a_regular_tetrahedron_around_the_receiver_has_a_pdop_of_one_and_a_half(kind):
    # the four directions sum to zero and their squares to 4/3 in every coordinate: variance 3/4 each, 9/4 together
    found = dop(TETRAHEDRON_M, [0.0, 0.0, 0.0], kind)
    assert found.pdop == pytest.approx(1.5, rel=ROUNDING)
    assert found.hdop == pytest.approx(math.sqrt(1.5), rel=ROUNDING)
    assert found.vdop == pytest.approx(math.sqrt(0.75), rel=ROUNDING)
    # the clock is the mean of four ranges, uncorrelated with the position: variance 1/4
    assert found.tdop == pytest.approx(0.5 if kind == "pseudorange" else 0.0, rel=ROUNDING)
    assert found.gdop == pytest.approx(math.sqrt(2.5) if kind == "pseudorange" else 1.5, rel=ROUNDING)
    assert (found.reason, found.count, found.kind) == (DopReason.OK, 4, kind)


@pytest.mark.parametrize("elevation_deg", [10.0, 35.0, 80.0])
def test_the_four_corners_of_a_square_overhead_have_the_dop_of_their_elevation(elevation_deg):
    # directions at elevation e: cos²e/2 in each horizontal coordinate, sin²e upward, for each of four anchors
    e = math.radians(elevation_deg)
    found = dop(ring(4, 250.0, e), [0.0, 0.0, 0.0])
    assert found.hdop == pytest.approx(1.0 / math.cos(e), rel=ROUNDING)
    assert found.vdop == pytest.approx(1.0 / (2.0 * math.sin(e)), rel=ROUNDING)


@pytest.mark.parametrize("kind", ["pseudorange", "tdoa"])
def test_a_ring_at_one_elevation_cannot_tell_height_from_clock(kind):
    # every direction has the same part upward: a change of height is a change of every range alike, as of the clock
    found = dop(ring(6, 900.0, 0.4), [0.0, 0.0, 0.0], kind)
    assert (found.reason, found.vdop, found.gdop) == (DopReason.SINGULAR, math.inf, math.inf)
    with_one_overhead = np.vstack([ring(6, 900.0, 0.4), [0.0, 0.0, 500.0]])
    assert dop(with_one_overhead, [0.0, 0.0, 0.0], kind).reason == DopReason.OK


def test_anchors_in_one_plane_with_the_receiver_give_no_fix_across_it():
    in_plane = dop(ring(5, 100.0, 0.0), [3.0, -2.0, 0.0])
    assert (in_plane.reason, in_plane.pdop) == (DopReason.SINGULAR, math.inf)
    # co-planar anchors seen from outside their plane are as good as any
    assert dop(ring(5, 100.0, 0.0), [3.0, -2.0, -40.0]).reason == DopReason.OK


def test_dop_grows_as_the_receiver_nears_the_plane_of_the_anchors_until_it_is_called_singular():
    # four anchors at depression d: vertical variance 1 / (4·sin²d)
    for height_m in (10.0, 1.0, 1e-2, 1e-3):
        down_rad = math.atan2(height_m, 100.0)
        found = dop(ring(4, 100.0, 0.0), [0.0, 0.0, height_m])
        assert found.vdop == pytest.approx(1.0 / (2.0 * math.sin(down_rad)), rel=1e-5)
    # a PDOP beyond 1e6 / sqrt(4)
    assert dop(ring(4, 100.0, 0.0), [0.0, 0.0, 0.9e-4]).reason == DopReason.SINGULAR


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("origin_m", [(0.0, 0.0, 0.0), (431_207.3, 3_801_888.7, 1204.9)])
def test_anchors_on_one_line_give_no_fix(kind, origin_m):
    # a line and the receiver span a plane, and the fix may turn about the line
    line_m = np.outer(np.linspace(-300.0, 500.0, 7), [0.6, 0.64, 0.48]) + origin_m
    found = dop(line_m, np.add(origin_m, [40.0, -90.0, 25.0]), kind)
    assert (found.reason, found.pdop, found.hdop, found.vdop) == (DopReason.SINGULAR, *[math.inf] * 3)


@pytest.mark.parametrize(
    ("kind", "on_surface", "needed"),
    [
        ("ranging", False, 3),
        ("ranging", True, 2),
        ("pseudorange", False, 4),
        ("pseudorange", True, 3),
        ("tdoa", False, 4),
        ("tdoa", True, 3),
    ],
)
def test_a_fix_needs_as_many_anchors_as_it_has_unknowns(kind, on_surface, needed):
    assert least_anchors(kind, on_surface=on_surface) == needed
    anchors_m = np.random.default_rng(4).normal(size=(9, 3)) * 100.0
    normal = [0.1, 0.2, 1.0] if on_surface else None
    for anchors in range(10):
        found = dop(anchors_m[:anchors], [1.0, 2.0, 3.0], kind, surface_normal=normal)
        expected = DopReason.OK if anchors >= needed else DopReason.TOO_FEW
        assert (found.reason, found.count) == (expected, anchors)
        assert np.isfinite(found.gdop) == (anchors >= needed)


def test_on_level_ground_only_the_horizontal_is_unknown():
    # two anchors level with the rover at right angles: each fixes its own coordinate
    found = dop([[100.0, 0.0, 0.0], [0.0, 70.0, 0.0]], [0.0, 0.0, 0.0], surface_normal=[0.0, 0.0, 1.0])
    assert (found.hdop, found.vdop, found.gdop) == pytest.approx((math.sqrt(2.0), 0.0, math.sqrt(2.0)), rel=ROUNDING)


@pytest.mark.parametrize("slope_deg", [0.0, 20.0, 60.0, 90.0])
def test_on_a_slope_the_vertical_error_is_that_of_moving_along_it(slope_deg):
    # anchors along the contour and up the slope: variance 1 each way, and going up the slope by 1 m rises sin(slope)
    slope = math.radians(slope_deg)
    anchors_m = np.array([[0.0, 500.0, 0.0], [80.0 * math.cos(slope), 0.0, 80.0 * math.sin(slope)]])
    found = dop(anchors_m, [0.0, 0.0, 0.0], surface_normal=[-math.sin(slope), 0.0, math.cos(slope)])
    assert found.pdop == pytest.approx(math.sqrt(2.0), rel=ROUNDING)
    assert found.vdop == pytest.approx(math.sin(slope), abs=ROUNDING)
    assert found.hdop == pytest.approx(math.sqrt(1.0 + math.cos(slope) ** 2), rel=ROUNDING)


def test_an_anchor_straight_above_says_nothing_about_motion_over_level_ground():
    found = dop([[0.0, 0.0, 90.0], [50.0, 0.0, 0.0]], [0.0, 0.0, 0.0], surface_normal=[0.0, 0.0, 3.0])
    assert (found.reason, found.hdop) == (DopReason.SINGULAR, math.inf)


def test_an_anchor_at_the_receiver_itself_has_no_direction_and_is_left_out():
    with_itself = np.vstack([TETRAHEDRON_M, [0.0, 0.0, 0.0]])
    assert dop(with_itself, [0.0, 0.0, 0.0]).pdop == pytest.approx(1.5, rel=ROUNDING)
    assert dop(with_itself[2:], [0.0, 0.0, 0.0]).reason == DopReason.TOO_FEW


def test_a_distant_source_is_a_direction_of_any_length():
    receivers_m = np.array([[0.0, 0.0, 0.0], [4000.0, -900.0, 250.0]])
    far = dop(TETRAHEDRON_M / 9.0, receivers_m, "pseudorange", distant=True)
    np.testing.assert_allclose(far.gdop, math.sqrt(2.5), rtol=ROUNDING)
    # and it is the limit of one so far away that its rays are parallel
    near = dop(TETRAHEDRON_M * 1e9, receivers_m, "pseudorange")
    np.testing.assert_allclose(near.gdop, far.gdop, rtol=1e-6)


def test_each_receiver_has_its_own_visible_set():
    visible = np.array([[True] * 4, [True, True, True, False], [True, True, False, False]])
    found = dop(TETRAHEDRON_M, np.zeros((3, 3)), visible=visible)
    assert found.count.tolist() == [4, 3, 2]
    assert found.reason.tolist() == [DopReason.OK, DopReason.OK, DopReason.TOO_FEW]
    assert found.pdop[1] == dop(TETRAHEDRON_M[:3], [0.0, 0.0, 0.0]).pdop
    assert found.reasons() == {DopReason.OK: 2, DopReason.TOO_FEW: 1, DopReason.SINGULAR: 0, DopReason.UNKNOWN: 0}


@pytest.mark.parametrize("anchors", [1, 63, 64, 65, 128, 150])
def test_visible_sets_hold_any_number_of_anchors_as_bits(anchors):
    rng = np.random.default_rng(anchors)
    visible = rng.random((20, anchors)) < 0.6
    anchors_m, points_m = rng.normal(size=(anchors, 3)) * 200.0, rng.normal(size=(20, 3)) * 50.0
    mask = pack_sets(visible)
    assert mask.shape == (20, (anchors + 63) // 64)
    assert all(
        bool(mask[i, a // 64] >> np.uint64(a % 64) & np.uint64(1)) == visible[i, a]
        for i, a in np.ndindex(visible.shape)
    )
    found = dop_at_points(points_m, anchors_m, mask)
    assert found.count.tolist() == visible.sum(axis=1).tolist()
    for i in range(20):
        assert found.pdop[i] == dop(anchors_m[visible[i]], points_m[i]).pdop


def test_bits_beyond_the_anchors_are_ignored():
    everything = np.full((1, 1), ~np.uint64(0))
    found = dop_at_points([[0.0, 0.0, 0.0]], TETRAHEDRON_M, everything)
    assert (found.count[0], found.pdop[0]) == (4, pytest.approx(1.5, rel=ROUNDING))
    assert everything[0, 0] == ~np.uint64(0)


@pytest.mark.parametrize("kind", KINDS)
def test_an_unknown_visible_set_has_an_unknown_dop(kind):
    mask = pack_sets(np.ones((2, 4), bool))
    found = dop_at_points(np.zeros((2, 3)), TETRAHEDRON_M, mask, kind, unknown=[True, False])
    for values in (found.gdop, found.pdop, found.hdop, found.vdop, found.tdop):
        assert np.isnan(values).tolist() == [True, False]
    assert found.reason.tolist() == [DopReason.UNKNOWN, DopReason.OK]


def test_ground_of_unknown_slope_has_an_unknown_dop():
    found = dop(TETRAHEDRON_M, np.zeros((2, 3)), surface_normal=[[0.0, 0.0, 1.0], [math.nan] * 3])
    assert found.reason.tolist() == [DopReason.OK, DopReason.UNKNOWN]
    assert np.isnan(found.gdop).tolist() == [False, True]


def test_no_receivers_have_no_dop():
    found = dop(TETRAHEDRON_M, np.empty((0, 3)))
    assert found.gdop.shape == found.reason.shape == (0,)


def test_the_callers_arrays_are_left_as_they_were():
    anchors_m, receivers_m = TETRAHEDRON_M.copy(), np.zeros((1, 3))
    anchors_m.setflags(write=False)
    receivers_m.setflags(write=False)
    dop(anchors_m, receivers_m, distant=True)
    assert (anchors_m == TETRAHEDRON_M).all()


ORIGIN = [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("arguments", "options", "sentence"),
    [
        ((TETRAHEDRON_M, ORIGIN, "range"), {}, "kind must be one of ranging, pseudorange, tdoa, not 'range'"),
        (([[1, 2]], ORIGIN), {}, r"anchor_positions_m must hold one row of east, north .* not shape \(1, 2\)"),
        (([[1, 2, math.nan]], ORIGIN), {}, r"anchor_positions_m\[0\] must be three finite numbers, not \[1"),
        (([["a", "b", "c"]], ORIGIN), {}, "anchor_positions_m must hold numbers: east, north"),
        ((TETRAHEDRON_M, [0.0, 0.0]), {}, r"receiver_m must hold one row of east, north .* not shape \(1, 2\)"),
        ((TETRAHEDRON_M, [0.0, math.inf, 0.0]), {}, r"receiver_m\[0\] must be three finite numbers"),
        ((TETRAHEDRON_M, ORIGIN), {"visible": [True]}, r"each of the 4 anchors whether it is seen, .* \(1,\)"),
        ((TETRAHEDRON_M, ORIGIN), {"distant": [True]*3}, r"one for each of the 4 anchors, not shape \(3,\)"),
        (([ORIGIN], ORIGIN), {"distant": True}, r"anchor_positions_m\[0\] is distant, so it must be a direction"),
        ((TETRAHEDRON_M, ORIGIN), {"surface_normal": [0.0, 1.0]}, r"surface_normal must be one east, north, up vector"),
        ((TETRAHEDRON_M, ORIGIN), {"surface_normal": ORIGIN}, "surface_normal must be a vector of some finite length"),
    ],
)  # fmt: skip
def test_a_question_that_makes_no_sense_is_refused_in_a_sentence(arguments, options, sentence):
    with pytest.raises(VisibilityInputError, match=sentence):
        dop(*arguments, **options)


@pytest.mark.parametrize(
    ("mask", "unknown", "sentence"),
    [
        (np.zeros((1, 2), np.uint64), None, r"mask must be uint64 of shape \(1, 1\) for 1 points and 4 anchors"),
        (np.zeros((1, 1), np.int64), None, "not int64"),
        (np.zeros((1, 1), np.uint64), [True, False], r"unknown must be \(1,\), one for each point, not \(2,\)"),
    ],
)
def test_visible_sets_that_do_not_fit_the_points_are_refused(mask, unknown, sentence):
    with pytest.raises(VisibilityInputError, match=sentence):
        dop_at_points([ORIGIN], TETRAHEDRON_M, mask, unknown=unknown)


def test_visible_sets_are_packed_from_a_table_only():
    with pytest.raises(VisibilityInputError, match=r"visible must be \(points, anchors\), not shape \(4,\)"):
        pack_sets([True, False, True, True])
