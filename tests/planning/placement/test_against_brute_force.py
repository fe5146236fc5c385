"""Small instances: what is placed is what going through every set finds."""

from __future__ import annotations

import numpy as np
import pytest

from planning.placement import Goal, SearchOptions, SightOptions, place_anchors
from tests.planning.placement.grounds import exact_sight, small_question
from tests.reference import placement as oracle

EXACT = SightOptions(mode="exact")


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.parametrize(("visible", "count"), [(1, 3), (2, 4), (3, 4)])
def test_coverage_is_that_of_the_best_of_all_sets(seed: int, visible: int, count: int) -> None:
    grid, candidates, targets = small_question(seed, 14)
    sight = exact_sight(grid, candidates.position_m, targets.point_m)
    counts = sight.astype(int)
    best = max(
        np.mean(counts[list(chosen)].sum(axis=0) >= visible)
        for chosen in __import__("itertools").combinations(range(14), count)
    )
    placement = place_anchors(grid, candidates, targets, count, Goal("coverage", min_anchors=visible), sight=EXACT)
    assert placement.proved
    assert placement.value == pytest.approx(best, abs=1e-12)
    assert placement.gap == pytest.approx(0.0, abs=1e-12)
    assert oracle.share_covered(sight.tolist(), placement.candidate.tolist(), visible) == pytest.approx(best)


def test_local_search_alone_finds_the_best_coverage_of_small_instances() -> None:
    grid, candidates, targets = small_question(5, 16)
    proved = place_anchors(grid, candidates, targets, 4, Goal("coverage", min_anchors=2))
    searched = place_anchors(
        grid, candidates, targets, 4, Goal("coverage", min_anchors=2), options=SearchOptions(exact=False)
    )
    assert searched.value == pytest.approx(proved.value)
    assert proved.value <= searched.bound + 1e-12


@pytest.mark.parametrize("seed", [1, 2])
def test_dilutions_are_within_one_per_cent_of_the_best_of_all_sets(seed: int) -> None:
    grid, candidates, whole = small_question(seed, 10)
    from planning.placement.sight import sampled_targets

    targets = sampled_targets(whole, np.arange(0, len(whole), 41))
    sight = exact_sight(grid, candidates.position_m, targets.point_m).tolist()
    position_m, point_m = candidates.position_m, targets.point_m
    best, _ = oracle.best_set(
        lambda chosen: oracle.share_with_dilution(sight, position_m, point_m, chosen, 3, 6.0), 10, 4
    )
    for exact in (True, False):
        placement = place_anchors(
            grid,
            candidates,
            targets,
            4,
            Goal("dop", min_anchors=3, dop_limit=6.0),
            sight=EXACT,
            options=SearchOptions(exact=exact),
        )
        assert placement.value == pytest.approx(best, rel=0.01)
    least, _ = oracle.best_set(lambda chosen: -oracle.mean_error(sight, position_m, point_m, chosen, 0.1, 10.0), 10, 4)
    placement = place_anchors(grid, candidates, targets, 4, Goal("mean_error"), sight=EXACT)
    assert placement.value == pytest.approx(-least, rel=0.01)
    assert placement.bound <= placement.value + 1e-9
