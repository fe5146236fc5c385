"""The geometric step: which ranges meet in one point, held against brute force, and when it is unable to tell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from detection import Classification, detect_2d, detect_3d
from tests.detection.worlds import DRONES_M, ROVER_M, Floats, true_ranges, world
from tests.reference import occlusion

TOLERANCE_M = 0.1


@given(
    seed=st.integers(0, 10_000),
    dimension=st.sampled_from([2, 3]),
    occluded=st.integers(0, 3),
    hint_up_m=st.sampled_from([0.0, 1.0]),
)
@example(seed=4041, dimension=3, occluded=3, hint_up_m=0.0)  # a descent through the anchors' plane, once a second place
@example(
    seed=8978, dimension=3, occluded=2, hint_up_m=0.0
)  # the floor lies nearer to the anchors' plane than the rover
@example(seed=423, dimension=3, occluded=3, hint_up_m=1.0)  # two explanations
@settings(max_examples=60, deadline=None)
def test_occluded_ranges_among_clear_ones_are_found_wherever_they_are(
    seed: int, dimension: int, occluded: int, hint_up_m: float
) -> None:
    anchors_m, rover_m = world(seed, 9, dimension)
    ranges_m = true_ranges(anchors_m, rover_m)
    hidden = np.random.default_rng(seed).permutation(9)[:occluded]
    ranges_m[hidden] += 3.0 + 4.0 * np.arange(occluded)
    detect = detect_2d if dimension == 2 else detect_3d
    found = detect(anchors_m, ranges_m, TOLERANCE_M, hint_m=None if dimension == 2 else (np.nan, np.nan, hint_up_m))
    assert found.count == 9 - occluded
    # a hint that is a metre wrong may hold the place that far from the rover's
    assert found.position_m == pytest.approx(rover_m, abs=1e-6 if dimension == 2 or hint_up_m == rover_m[2] else 1.0)
    if found.classification is Classification.UNDETERMINED:
        # right just where other sets, as large, meet too; all 80 000 worlds of this test hold two of them
        size, sets = occlusion.largest_meeting(anchors_m, ranges_m, TOLERANCE_M, dimension + 1)
        assert size == found.count
        assert len(sets) > 1
        assert tuple(sorted(hidden.tolist())) in found.candidates
        return
    assert set(np.flatnonzero(found.occluded)) == set(hidden.tolist())
    assert found.classification == ("none", "single", "multiple", "multiple")[occluded]
    assert found.checked


@pytest.mark.parametrize("dimension", [2, 3])
def test_ranges_without_error_give_the_place_and_the_excess(dimension: int) -> None:
    off_m, excess_off_m = [], []
    for seed in range(200):
        anchors_m, rover_m = world(seed, 9, dimension)
        ranges_m = true_ranges(anchors_m, rover_m)
        hidden = np.random.default_rng(seed).permutation(9)[: seed % 4]
        ranges_m[hidden] += 3.0 + 4.0 * np.arange(len(hidden))
        detect = detect_2d if dimension == 2 else detect_3d
        found = detect(anchors_m, ranges_m, TOLERANCE_M, hint_m=None if dimension == 2 else (np.nan, np.nan, 0.0))
        assert found.position_m is not None
        off_m.append(np.linalg.norm(found.position_m - rover_m))
        too_long_m = ranges_m - true_ranges(anchors_m, rover_m)
        excess_off_m.extend(np.abs(found.excess_m - too_long_m)[hidden])
    assert max(off_m) < 1e-6
    assert max(excess_off_m) < 1e-6


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_the_largest_set_is_that_of_brute_force(seed: int, dimension: int) -> None:
    anchors_m, rover_m = world(seed, 6, dimension)
    rng = np.random.default_rng(seed)
    ranges_m = true_ranges(anchors_m, rover_m) + 0.05 * rng.normal(size=6)
    ranges_m[:2] += (0.3, 1.0)
    size, sets = occlusion.largest_meeting(anchors_m, ranges_m, TOLERANCE_M, dimension + 1)
    found = (detect_2d if dimension == 2 else detect_3d)(anchors_m, ranges_m, TOLERANCE_M)
    assert found.count == size
    if len(sets) == 1:
        assert tuple(np.flatnonzero(~found.occluded & ~found.unknown)) in (sets[0], ())
        if found.mirror_m is None and not found.unknown.any():
            assert tuple(np.flatnonzero(~found.occluded)) == sets[0]


@given(seed=st.integers(0, 10_000), occluded=st.integers(0, 2))
@settings(max_examples=40, deadline=None)
def test_to_the_letter_as_many_circles_meet_as_at_the_best_of_all_intersections(seed: int, occluded: int) -> None:
    anchors_m, rover_m = world(seed, 6, 2)
    ranges_m = true_ranges(anchors_m, rover_m)
    ranges_m[:occluded] += (2.0, 5.0)[:occluded]
    assert detect_2d(anchors_m, ranges_m, TOLERANCE_M, method="seed").count == occlusion.most_circles(
        anchors_m, ranges_m, TOLERANCE_M
    )


def test_refinement_uses_what_the_linear_system_leaves_lying() -> None:
    rng = np.random.default_rng(4)
    error_m: dict[str, list[float]] = {"refined": [], "seed": []}
    for _ in range(200):
        ranges_m = true_ranges(DRONES_M, ROVER_M) + 0.1 * rng.normal(size=8)
        for method, errors in error_m.items():
            found = detect_3d(DRONES_M, ranges_m, 1.0, method="refined" if method == "refined" else "seed")
            assert found.position_m is not None
            errors.append(float(np.linalg.norm(found.position_m - ROVER_M)))
    refined, linear = (float(np.sqrt(np.mean(np.square(errors)))) for errors in error_m.values())
    assert refined < 0.9 * linear


def test_the_covariance_is_that_of_the_errors_it_is_told() -> None:
    rng = np.random.default_rng(5)
    normalised = []
    for _ in range(400):
        found = detect_3d(DRONES_M, true_ranges(DRONES_M, ROVER_M) + 0.1 * rng.normal(size=8), 1.0, sigma_m=0.1)
        assert found.position_m is not None
        assert found.covariance_m2 is not None
        off_m = found.position_m - ROVER_M
        normalised.append(off_m @ np.linalg.solve(found.covariance_m2, off_m))
    # mean of 400 chi-squared numbers of 3 degrees: 3 with a sigma of sqrt(6 / 400)
    assert np.mean(normalised) == pytest.approx(3.0, abs=5.0 * np.sqrt(6.0 / 400.0))


def test_far_coordinates_lose_no_digits() -> None:
    far_m = np.array([430_000.0, 5_200_000.0, 1500.0])
    found = detect_3d(DRONES_M + far_m, true_ranges(DRONES_M, ROVER_M), TOLERANCE_M)
    assert found.position_m == pytest.approx(ROVER_M + far_m, abs=1e-5)


def test_drones_at_one_height_leave_two_places_and_both_are_told() -> None:
    level_m = DRONES_M.copy()
    level_m[:, 2] = 80.0
    found = detect_3d(level_m, true_ranges(level_m, ROVER_M), TOLERANCE_M)
    assert found.position_m == pytest.approx(ROVER_M, abs=1e-4)  # the lower of both
    assert found.mirror_m == pytest.approx([150.0, 160.0, 158.0], abs=1e-4)
    assert "altitude" in found.needed


@pytest.mark.parametrize(("hint_m", "up_m"), [(0.0, 2.0), (300.0, 158.0)])
def test_an_altitude_hint_settles_which_of_both_places_it_is(hint_m: float, up_m: float) -> None:
    level_m = DRONES_M.copy()
    level_m[:, 2] = 80.0
    ranges_m = true_ranges(level_m, ROVER_M)
    ranges_m[3] += 5.0
    found = detect_3d(level_m, ranges_m, TOLERANCE_M, hint_m=(np.nan, np.nan, hint_m))
    assert found.position_m == pytest.approx([150.0, 160.0, up_m], abs=1e-4)
    assert found.mirror_m is None
    assert found.needed == ""
    assert np.flatnonzero(found.occluded).tolist() == [3]


@pytest.mark.parametrize("aside_m", [0.0, 2.0, 20.0])
def test_anchors_beside_one_another_check_only_each_other(aside_m: float) -> None:
    anchors_m = np.array([[0.0, 0.0, 100.0], [aside_m, 0.0, 100.0], [400.0, 30.0, 60.0], [380.0, 420.0, 140.0]])
    ranges_m = np.linalg.norm(anchors_m - [150.0, 160.0, 2.0], axis=1)
    ranges_m[3] += 30.0
    found = detect_3d(anchors_m, ranges_m, TOLERANCE_M, hint_m=(np.nan, np.nan, 2.0))
    # the place takes up the 30 m: nothing shows them, so nothing may call that range clear or the place checked
    assert found.classification is Classification.UNDETERMINED
    assert found.unknown[3]
    assert not found.checked
    assert "nothing checks" in found.needed


def test_anchors_on_a_line_in_the_plane_leave_two_sides_and_a_hint_settles_them() -> None:
    line_m = np.array([(0.0, 0.0), (50.0, 50.0), (120.0, 120.0), (200.0, 200.0)])
    ranges_m = true_ranges(line_m, np.array([90.0, 10.0]))
    both = detect_2d(line_m, ranges_m, TOLERANCE_M)
    assert both.mirror_m is not None
    assert both.position_m is not None
    places_m = sorted([both.position_m.tolist(), both.mirror_m.tolist()])
    np.testing.assert_allclose(places_m, [(10.0, 90.0), (90.0, 10.0)], atol=1e-4)
    assert "side" in both.needed
    assert detect_2d(line_m, ranges_m, TOLERANCE_M, hint_m=(0.0, 60.0)).position_m == pytest.approx([10.0, 90.0])


def test_anchors_on_a_line_in_space_allow_no_position() -> None:
    line_m = np.outer([0.0, 50.0, 120.0, 200.0, 260.0], [1.0, 0.5, 0.3])
    found = detect_3d(line_m, true_ranges(line_m, ROVER_M), TOLERANCE_M)
    assert found.classification is Classification.UNDETERMINED
    assert found.position_m is None
    assert found.unknown.all()
    assert found.needed


def test_two_anchors_at_one_place_count_as_two_ranges_and_break_nothing() -> None:
    twin_m = np.vstack([DRONES_M[:5], DRONES_M[:1]])
    ranges_m = true_ranges(twin_m, ROVER_M)
    clear = detect_3d(twin_m, ranges_m, TOLERANCE_M)
    assert clear.classification is Classification.NONE
    ranges_m[5] += 4.0  # concentric spheres of different radius: one of both is wrong
    assert np.flatnonzero(detect_3d(twin_m, ranges_m, TOLERANCE_M).occluded).tolist() == [5]
    all_one = np.repeat(DRONES_M[:1], 5, axis=0)
    assert detect_3d(all_one, np.full(5, 100.0), TOLERANCE_M).position_m is None


def test_a_triple_in_line_among_others_is_no_trap() -> None:
    anchors_m = np.vstack([[(0, 0, 50), (100, 0, 50), (200, 0, 50)], DRONES_M[2:6]]).astype(float)
    ranges_m = true_ranges(anchors_m, ROVER_M)
    ranges_m[1] += 2.0
    found = detect_3d(anchors_m, ranges_m, TOLERANCE_M)
    assert np.flatnonzero(found.occluded).tolist() == [1]
    assert found.position_m == pytest.approx(ROVER_M, abs=1e-4)


def test_ranges_that_meet_nowhere_are_undetermined_not_guessed() -> None:
    ranges_m = np.array([5.0, 9.0, 4.0, 7.0, 6.0, 3.0, 8.0, 5.0])  # all spheres apart
    found = detect_3d(DRONES_M, ranges_m, TOLERANCE_M)
    assert found.classification is Classification.UNDETERMINED
    assert found.unknown.all()
    assert not found.occluded.any()
    assert found.position_m is None
    assert "meet in one point" in found.needed


@pytest.mark.parametrize(("dimension", "chosen"), [(3, [0, 1, 2, 3]), (2, [0, 1, 3])])
def test_one_range_more_than_unknowns_detects_an_occlusion_but_cannot_tell_which(
    dimension: int, chosen: list[int]
) -> None:
    anchors_m, rover_m = DRONES_M[chosen, :dimension], ROVER_M[:dimension]
    detect = detect_2d if dimension == 2 else detect_3d
    ranges_m = true_ranges(anchors_m, rover_m)
    assert detect(anchors_m, ranges_m, TOLERANCE_M).classification is Classification.NONE
    ranges_m[1] += 6.0
    found = detect(anchors_m, ranges_m, TOLERANCE_M)
    assert found.classification is Classification.UNDETERMINED
    assert found.least_occluded == 1
    assert found.unknown.all()
    assert found.needed.startswith("More ranges")


def test_one_of_five_is_flagged_only_where_the_others_cannot_as_well_be_it() -> None:
    """Any four of five ranges that meet by chance explain them too: then nobody is flagged, and the remedy is told."""
    told = {"right": 0, "wrong": 0, "undetermined": 0}
    for seed in range(100):
        anchors_m, rover_m = world(seed, 5, 3)
        ranges_m = true_ranges(anchors_m, rover_m)
        ranges_m[0] += 2.0
        found = detect_3d(anchors_m, ranges_m, TOLERANCE_M, hint_m=(np.nan, np.nan, 0.0))
        if found.classification is Classification.UNDETERMINED:
            told["undetermined"] += 1
            assert "One more range" in found.needed
            assert not found.occluded[~found.unknown].any() or found.occluded[0]
        else:
            told["right" if np.flatnonzero(found.occluded).tolist() == [0] else "wrong"] += 1
    assert told["right"] > 30
    assert told["undetermined"] > 5
    assert told["wrong"] <= 5  # an explanation is believed from 95 % on


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_too_few_ranges_say_how_many_are_missing(count: int) -> None:
    found = detect_3d(DRONES_M[:count], true_ranges(DRONES_M[:count], ROVER_M), TOLERANCE_M)
    assert found.classification is Classification.UNDETERMINED
    assert not found.occluded.any()
    assert found.checked is False
    assert ("One more range" if count == 3 else f"{4 - count} more ranges") in found.needed
    assert (found.position_m is None) == (count < 3)


def sixteen() -> tuple[Floats, Floats]:
    anchors_m, rover_m = world(16, 16, 3)
    ranges_m = true_ranges(anchors_m, rover_m) + 0.02 * np.random.default_rng(16).normal(size=16)
    ranges_m[:7] += np.linspace(2.0, 30.0, 7)
    return anchors_m, ranges_m


def test_sixteen_anchors_with_seven_occluded_stay_inside_the_search_budget() -> None:
    anchors_m, ranges_m = sixteen()
    found = detect_3d(anchors_m, ranges_m, TOLERANCE_M, search_limit=500)
    assert found.search.tried <= 500
    assert np.flatnonzero(found.occluded).tolist() == list(range(7))


def test_a_search_that_was_cut_short_says_so_and_a_complete_one_too() -> None:
    anchors_m, ranges_m = sixteen()
    assert detect_3d(anchors_m, ranges_m, TOLERANCE_M, search_limit=20).search.complete is False
    small = detect_3d(DRONES_M, true_ranges(DRONES_M, ROVER_M), TOLERANCE_M)
    assert (small.search.tried, small.search.complete) == (1, True)


def test_nothing_that_the_caller_gave_is_written_to() -> None:
    anchors_m, ranges_m = DRONES_M.copy(), true_ranges(DRONES_M, ROVER_M)
    ranges_m[2] += 3.0
    before = ranges_m.copy()
    detect_3d(anchors_m, ranges_m, TOLERANCE_M)
    np.testing.assert_array_equal(anchors_m, DRONES_M)
    np.testing.assert_array_equal(ranges_m, before)


@given(angle=st.floats(0.0, 6.28), east_m=st.floats(-1e4, 1e4), swap=st.permutations(range(8)))
@settings(max_examples=30, deadline=None)
def test_the_answer_turns_moves_and_reorders_with_the_world(angle: float, east_m: float, swap: list[int]) -> None:
    ranges_m = true_ranges(DRONES_M, ROVER_M)
    ranges_m[[1, 4]] += (2.0, 7.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    moved_m = DRONES_M @ turn.T + (east_m, 0.0, 0.0)
    found = detect_3d(moved_m[swap], ranges_m[swap], TOLERANCE_M)
    assert {swap[i] for i in np.flatnonzero(found.occluded).tolist()} == {1, 4}
    assert found.position_m == pytest.approx(turn @ ROVER_M + (east_m, 0.0, 0.0), abs=1e-3)
