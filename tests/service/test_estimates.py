"""What would take too much is refused before anything is allocated, with the limit's name and both numbers."""

from collections.abc import Iterator

import pytest

from service.errors import LimitError
from service.estimates import Demand, budget, calculation, refuse_beyond, sight_lines, signals_over
from service.products.morphing.frames import frames_demand
from service.products.registry import PRODUCTS
from service.settings import GIB, Settings
from tests.service.asked import ASKED
from tests.service.small_maps import small_grid

SETTINGS = Settings(max_voxels=1000, max_job_s=100.0, max_worker_memory_bytes=GIB)


def voxels(count: int) -> Demand:
    return Demand("max_voxels", count, f"The volume has {count:,} voxels,", "; ask for less")


def test_as_much_as_the_limit_is_taken_and_no_more():
    refuse_beyond([voxels(1000)], SETTINGS)
    with pytest.raises(LimitError) as refused:
        refuse_beyond([voxels(1001)], SETTINGS)
    sentence = "The volume has 1,001 voxels, more than the limit of 1,000; ask for less (setting SIGHTLINE_MAX_VOXELS)."
    assert str(refused.value) == sentence
    assert (refused.value.limit_name, refused.value.limit, refused.value.given) == ("max_voxels", 1000, 1001)


def test_what_is_beyond_its_limit_is_refused_before_the_rest_is_worked_out():
    def demands() -> Iterator[Demand]:
        yield voxels(2000)
        pytest.fail("worked out for nothing")

    with pytest.raises(LimitError, match="2,000 voxels"):
        refuse_beyond(demands(), SETTINGS)


@pytest.mark.parametrize(
    ("demands", "settings", "sentence"),
    [
        (
            sight_lines(100, 65, "fast"),
            Settings(max_anchors=64),
            "65 anchors and satellites are more than the limit of 64 in one request (setting SIGHTLINE_MAX_ANCHORS).",
        ),
        (
            sight_lines(40_000, 3, "exact"),
            Settings(max_anchor_cells=100_000),
            "40,000 cells x 3 anchors would take about 0.0019 GiB of memory and 0.06 s, more than the limit of 100,000 "
            "cells x anchors; ask for fewer anchors or a smaller DEM (setting SIGHTLINE_MAX_ANCHOR_CELLS).",
        ),
        (
            [budget(100.5)],
            SETTINGS,
            "A budget of 100.5 s is more than the limit of 100 s for one job (setting SIGHTLINE_MAX_JOB_S).",
        ),
        (
            calculation("All of it", 1.5 * GIB, 2.0, "less"),
            SETTINGS,
            "All of it would take about 1.5 GiB of memory and 2 s, more than the limit of 1 GiB of memory; ask for "
            "less (setting SIGHTLINE_MAX_WORKER_MEMORY_BYTES).",
        ),
    ],
)
def test_every_limit_is_told_in_its_own_unit(demands, settings, sentence):
    with pytest.raises(LimitError) as refused:
        refuse_beyond(demands, settings)
    assert str(refused.value) == sentence


@pytest.mark.parametrize("name", ["visibility-map", "dop-map", "morphing-map"])
def test_what_is_usable_is_refused_where_sight_is_not(name):
    product, grid = PRODUCTS[name], small_grid()
    still = {key: value for key, value in ASKED[name].items() if key not in ("frames", "tracks")}
    asked = {**still, "cover": {"canopy": {"top_m": 9.0}}}
    asked |= {"anchors": [{**one, "radio": "uwb"} for one in asked["anchors"]]}
    cells, anchors = grid.heights_m.size, len(asked["anchors"])
    seconds = signals_over(cells, anchors, trees=True).amount
    assert seconds == 2.0 * signals_over(cells, anchors, trees=False).amount
    settings = Settings(max_job_s=0.99 * seconds)
    refuse_beyond(product.estimate(grid, product.parameters.model_validate(asked)), settings)
    usable = product.parameters.model_validate({**asked, "sight": "usable"})
    with pytest.raises(LimitError, match=f"What is usable over {cells:,} cells x {anchors} anchors with trees would"):
        refuse_beyond(product.estimate(grid, usable), settings)


@pytest.mark.parametrize(
    ("cells", "frames", "moving", "mode", "limit_name"),
    [
        (1_000_000, 500, 0, "fast", "max_worker_memory_bytes"),
        (1_000_000, 20, 12, "exact", "max_job_s"),
    ],
)
def test_frames_beyond_memory_or_time_are_refused(cells, frames, moving, mode, limit_name):
    with pytest.raises(LimitError, match=f"{frames} frames over 1,000,000 cells would take about") as refused:
        refuse_beyond(frames_demand(cells, frames, moving, mode), SETTINGS)
    assert refused.value.limit_name == limit_name


def test_what_stands_still_costs_only_the_columns():
    refuse_beyond(frames_demand(1_000_000, 20, 0, "exact"), SETTINGS)
