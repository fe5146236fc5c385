"""However ranges lie, the search among them ends after so much work, and says how far it came."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from detection import Classification, DetectionInputError, Detector, RangingAnchor, detect_2d, detect_3d
from detection.kernels import triples
from detection.kernels.fits import ITERATIONS
from detection.subset_search import Ranges, Rules, Search, most_steps, search
from tests.detection.worlds import Floats, true_ranges, world

LIMIT = 1500
TOLERANCE_M = 0.3


def lies(kind: str, seed: int, count: int, dimension: int) -> tuple[Floats, Floats]:
    """Anchors and ranges that make a search long: at random, all too long by other amounts, of two places at once."""
    anchors_m, rover_m = world(seed, count, dimension)
    rng = np.random.default_rng(seed)
    ranges_m = true_ranges(anchors_m, rover_m) + 0.1 * rng.normal(size=count)
    if kind == "random":
        ranges_m = rng.uniform(0.5, 2.0, count) * float(np.median(ranges_m))
    elif kind == "all too long":
        ranges_m += rng.uniform(1.0, 20.0, count)
    elif kind == "two places":
        elsewhere_m = rover_m + rng.uniform(20.0, 60.0, dimension)
        ranges_m[::2] = true_ranges(anchors_m, elsewhere_m)[::2]
    elif kind == "all alike":
        ranges_m[:] = ranges_m[0]
    return anchors_m, np.maximum(ranges_m, 0.1)


def searched(anchors_m: Floats, ranges_m: Floats, limit: int, *, refine: bool = True) -> Search:
    count, dimension = anchors_m.shape
    places_m = np.zeros((count, 3))
    places_m[:, :dimension] = anchors_m
    sigmas_m = np.full(count, TOLERANCE_M / 3.0)
    ranges = Ranges(places_m, ranges_m, sigmas_m, np.full(count, TOLERANCE_M), np.zeros(count))
    return search(ranges, Rules(dimension == 2, refine, refine, dimension + 1, (math.nan,) * 3), limit)


@given(
    kind=st.sampled_from(["random", "all too long", "two places", "all alike"]),
    seed=st.integers(0, 10_000),
    count=st.integers(5, 62),
    dimension=st.sampled_from([2, 3]),
    limit=st.sampled_from([1, 20, LIMIT, 5000]),
    refine=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_no_ranges_whatever_take_more_work_than_the_limit_allows(
    kind: str, seed: int, count: int, dimension: int, limit: int, refine: bool
) -> None:
    found = searched(*lies(kind, seed, count, dimension), limit, refine=refine)
    costliest_fit = count * (count // 2 + 3 * ITERATIONS + 4)
    look = (3 * ITERATIONS + 3) * count * count + costliest_fit  # the last candidate point may be begun at the limit
    all_sets = sum(math.comb(count, out) for out in range(count - dimension))
    if all_sets - 1 <= limit:
        assert found.complete
        assert found.steps <= all_sets * (costliest_fit + 3 * count) + count * count * count
    else:
        assert found.steps <= most_steps(count, limit) + look + count * count
    assert found.tried <= limit + 1
    assert found.steps >= found.tried * count * (count // 2 + 4)  # each fit looks at all pairs, and tests
    assert found.tried <= found.sets


@given(seed=st.integers(0, 10_000), count=st.integers(4, 20), level=st.booleans(), tolerance_m=st.floats(0.01, 5.0))
@settings(max_examples=200, deadline=None)
def test_three_ranges_rule_out_none_that_is_within_tolerance_at_a_place_where_they_are(
    seed: int, count: int, level: bool, tolerance_m: float
) -> None:
    anchors_m, rover_m = world(seed, count, 3)
    rng = np.random.default_rng(seed)
    if level:
        anchors_m[:, 2] = anchors_m[0, 2] + 0.1 * rng.normal(size=count)
    # the worst that tolerance allows: each range off by nearly all of it
    ranges_m = true_ranges(anchors_m, rover_m) + 0.999 * tolerance_m * rng.choice([-1.0, 1.0], count)
    tolerances_m = np.full(count, tolerance_m)
    ranges = Ranges(anchors_m, np.maximum(ranges_m, 0.01), tolerances_m, tolerances_m, np.zeros(count))
    within = np.abs(ranges.ranges_m - true_ranges(anchors_m, rover_m)) <= tolerance_m
    ruled_out = np.bitwise_or.reduce(triples.ruled_out(ranges)[np.ix_(within, within, within)], axis=None)
    assert int(ruled_out) & _bits(within) == 0


def _bits(chosen: npt.NDArray[np.bool_]) -> int:
    return sum(1 << int(number) for number in np.flatnonzero(chosen))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", ["all too long", "two places"])
def test_what_three_ranges_rule_out_changes_no_answer(kind: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    anchors_m, ranges_m = lies(kind, seed, 10, 3)
    pruned = searched(anchors_m, ranges_m, 800)
    monkeypatch.setattr(triples, "ruled_out", lambda ranges: np.zeros((0, 0, 0), np.int64))
    whole = searched(anchors_m, ranges_m, 800)
    assert pruned.complete
    assert pruned.tried <= whole.tried
    if whole.complete:
        assert {one.kept for one in pruned.found} == {one.kept for one in whole.found}


@pytest.mark.parametrize("count", [16, 28, 32])
def test_a_search_at_default_limits_looks_at_two_million_ranges_at_most(count: int) -> None:
    assert most_steps(count, LIMIT) <= 1.8e6


@pytest.mark.parametrize("count", [20, 32, 48])
def test_two_explanations_are_told_though_not_all_sets_were_searched(count: int) -> None:
    anchors_m, rover_m = world(1, count, 3)
    elsewhere_m = rover_m + np.array([40.0, -30.0, 5.0])
    ranges_m = true_ranges(anchors_m, rover_m)
    ranges_m[::2] = true_ranges(anchors_m, elsewhere_m)[::2]
    found = detect_3d(anchors_m, ranges_m, TOLERANCE_M, hint_m=(np.nan, np.nan, 0.0))
    assert found.classification is Classification.UNDETERMINED
    assert not found.occluded.any()
    halves = tuple(range(1, count, 2)), tuple(range(0, count, 2))
    assert set(halves) <= set(found.candidates)


@given(seed=st.integers(0, 10_000), count=st.integers(17, 40), dimension=st.sampled_from([2, 3]))
@settings(max_examples=30, deadline=None)
def test_what_was_not_searched_is_never_guessed(seed: int, count: int, dimension: int) -> None:
    anchors_m, rover_m = world(seed, count, dimension)
    ranges_m = true_ranges(anchors_m, rover_m)
    hidden = np.random.default_rng(seed).permutation(count)[: count // 3]
    ranges_m[hidden] += 3.0 + 2.0 * np.arange(len(hidden))
    detect = detect_2d if dimension == 2 else detect_3d
    for limit in (1, 3, 10, 100, LIMIT):
        found = detect(anchors_m, ranges_m, TOLERANCE_M, search_limit=limit)
        assert set(np.flatnonzero(found.occluded)) <= set(hidden.tolist())
        if found.classification is Classification.MULTIPLE:
            assert set(np.flatnonzero(found.occluded)) == set(hidden.tolist())
        else:
            assert found.classification is Classification.UNDETERMINED
            assert found.checked is False
    assert found.classification is Classification.MULTIPLE


def test_a_search_cut_short_says_how_many_of_how_many_sets_it_tried() -> None:
    found = detect_3d(*lies("all too long", 3, 62, 3), TOLERANCE_M, search_limit=20)
    assert found.search.complete is False
    assert found.search.sets > 1e15
    assert found.unknown.all()
    assert f"{found.search.tried} of {found.search.sets:,} sets of ranges were searched" in found.needed


def test_more_than_62_anchors_are_refused_before_they_are_looked_at() -> None:
    many = [RangingAnchor("the same", 0.0, 0.0)] * 100_000
    with pytest.raises(DetectionInputError, match="at most 62 anchors, not 100000"):
        Detector(many)
