"""What must hold of dilution of precision whatever the geometry: numpy's inverse, and what may not change it."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.reference import dop as reference
from visibility import dop

KINDS = ["ranging", "pseudorange", "tdoa"]
many = settings(max_examples=80, deadline=None)
seeds = st.integers(0, 2**32 - 1)
counts = st.integers(4, 20)
kinds = st.sampled_from(KINDS)
# the oracle's own rounding grows with the square of the condition of its design matrix
WELL_CONDITIONED = 1e3
AGREEMENT = 1e-8


def case(seed, anchors):
    """Anchors all round a receiver, near and far, some nearly in a plane; and a normal."""
    rng = np.random.default_rng(seed)
    spread_m = 10.0 ** rng.uniform(1.0, 5.0) * np.array([1.0, 1.0, 10.0 ** rng.uniform(-2.0, 0.0)])
    origin_m = rng.uniform(-1.0, 1.0, 3) * [5e5, 4e6, 3e3]
    anchors_m = origin_m + rng.normal(size=(anchors, 3)) * spread_m
    return anchors_m, origin_m + rng.normal(size=3) * spread_m, rng.normal(size=3)


def rotation(seed):
    """A random rotation."""
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return turn


def found_values(found):
    return np.array([found.gdop, found.pdop, found.hdop, found.vdop, found.tdop])


@many
@given(seeds, counts, kinds, st.booleans())
def test_every_dop_is_that_of_numpys_inverse(seed, anchors, kind, on_surface):
    anchors_m, receiver_m, normal = case(seed, anchors)
    normal = normal if on_surface else None
    expected = reference.dilutions(anchors_m, receiver_m, kind, normal)
    assume(expected[0] < WELL_CONDITIONED)
    np.testing.assert_allclose(
        found_values(dop(anchors_m, receiver_m, kind, surface_normal=normal)), expected, rtol=AGREEMENT, atol=1e-12
    )


@many
@given(seeds, counts, st.data())
def test_differences_of_arrival_with_their_correlation_are_pseudoranges_whatever_the_reference(seed, anchors, data):
    anchors_m, receiver_m, _ = case(seed, anchors)
    variances_m2 = np.random.default_rng(seed).uniform(0.2, 5.0, anchors)
    first = data.draw(st.integers(0, anchors - 1))
    unknown_clock, _ = reference.covariance(anchors_m, receiver_m, "pseudorange", variances_m2)
    assume(np.trace(unknown_clock) < WELL_CONDITIONED**2)
    differenced, _ = reference.covariance(anchors_m, receiver_m, "tdoa", variances_m2, reference=first)
    np.testing.assert_allclose(differenced, unknown_clock, rtol=1e-6, atol=1e-6 * np.trace(unknown_clock))
    assert dop(anchors_m, receiver_m, "tdoa").gdop == dop(anchors_m, receiver_m, "pseudorange").pdop


@many
@given(seeds, counts, kinds)
def test_turning_the_world_leaves_position_and_clock_as_good_as_they_were(seed, anchors, kind):
    anchors_m, receiver_m, normal = case(seed, anchors)
    turn = rotation(seed)
    for tilt, turned_tilt in ((None, None), (normal, turn @ normal)):
        before = dop(anchors_m, receiver_m, kind, surface_normal=tilt)
        assume(before.gdop < WELL_CONDITIONED)
        after = dop((anchors_m - receiver_m) @ turn.T, [0.0, 0.0, 0.0], kind, surface_normal=turned_tilt)
        assert [after.gdop, after.pdop, after.tdop] == pytest.approx([before.gdop, before.pdop, before.tdop], rel=1e-6)


@many
@given(seeds, counts, kinds)
def test_turning_about_the_vertical_changes_nothing_at_all(seed, anchors, kind):
    anchors_m, receiver_m, _ = case(seed, anchors)
    before = dop(anchors_m, receiver_m, kind)
    assume(before.gdop < WELL_CONDITIONED)
    angle = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi)
    turn = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    after = dop((anchors_m - receiver_m) @ turn.T, [0.0, 0.0, 0.0], kind)
    assert found_values(after) == pytest.approx(found_values(before), rel=1e-6)


@many
@given(seeds, counts, kinds, st.booleans())
def test_one_more_anchor_never_makes_it_worse(seed, anchors, kind, on_surface):
    anchors_m, receiver_m, normal = case(seed, anchors)
    normal = normal if on_surface else None
    fewer = found_values(dop(anchors_m[:-1], receiver_m, kind, surface_normal=normal))
    more = found_values(dop(anchors_m, receiver_m, kind, surface_normal=normal))
    assert (more <= fewer * (1.0 + 1e-6)).all()


@many
@given(seeds, counts, kinds, st.floats(1e-3, 1e3))
def test_only_directions_count_not_distances(seed, anchors, kind, scale):
    anchors_m, receiver_m, _ = case(seed, anchors)
    before = dop(anchors_m, receiver_m, kind)
    assume(before.gdop < WELL_CONDITIONED)
    own = np.random.default_rng(seed).uniform(0.1, 10.0, (anchors, 1))
    after = dop((anchors_m - receiver_m) * scale * own, [0.0, 0.0, 0.0], kind)
    assert found_values(after) == pytest.approx(found_values(before), rel=1e-6)


@many
@given(seeds, counts)
def test_the_more_is_unknown_the_worse(seed, anchors):
    anchors_m, receiver_m, normal = case(seed, anchors)
    for tilt in (None, normal):
        ranging = dop(anchors_m, receiver_m, "ranging", surface_normal=tilt)
        clockless = dop(anchors_m, receiver_m, "pseudorange", surface_normal=tilt)
        assert ranging.pdop <= clockless.pdop * (1.0 + 1e-6)
    bound = dop(anchors_m, receiver_m, "ranging", surface_normal=normal)
    assert bound.pdop <= dop(anchors_m, receiver_m, "ranging").pdop * (1.0 + 1e-6)


@many
@given(seeds, counts, kinds)
def test_each_dop_is_made_of_its_parts(seed, anchors, kind):
    anchors_m, receiver_m, _ = case(seed, anchors)
    found = dop(anchors_m, receiver_m, kind)
    assert found.pdop**2 == pytest.approx(found.hdop**2 + found.vdop**2, rel=1e-12)
    assert found.gdop**2 == pytest.approx(found.pdop**2 + found.tdop**2, rel=1e-12)


@many
@given(seeds, counts)
def test_the_order_of_the_anchors_does_not_matter(seed, anchors):
    anchors_m, receiver_m, _ = case(seed, anchors)
    shuffled_m = np.random.default_rng(seed).permutation(anchors_m)
    for kind in KINDS:
        before = dop(anchors_m, receiver_m, kind)
        assume(before.gdop < WELL_CONDITIONED)
        assert found_values(dop(shuffled_m, receiver_m, kind)) == pytest.approx(found_values(before), rel=1e-6)
