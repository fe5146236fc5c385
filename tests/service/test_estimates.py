"""What would take too much is refused before anything is allocated, with the limit's name and both numbers."""

import pytest

from service.errors import LimitError
from service.estimates import refuse_frames, refuse_volume
from service.settings import GIB, Settings

SETTINGS = Settings(max_voxels=1000, max_job_s=100.0, max_worker_memory_bytes=GIB)


def test_a_volume_may_have_as_many_voxels_as_the_limit_and_no_more():
    refuse_volume(1000, SETTINGS)
    with pytest.raises(
        LimitError, match=r"1,001 voxels, more than the limit of 1,000.*SIGHTLINE_MAX_VOXELS"
    ) as refused:
        refuse_volume(1001, SETTINGS)
    assert (refused.value.limit_name, refused.value.limit, refused.value.given) == ("max_voxels", 1000, 1001)


@pytest.mark.parametrize(
    ("cells", "frames", "moving", "mode", "limit_name"),
    [
        (1_000_000, 500, 0, "fast", "max_worker_memory_bytes"),
        (1_000_000, 20, 12, "exact", "max_job_s"),
    ],
)
def test_frames_beyond_memory_or_time_are_refused(cells, frames, moving, mode, limit_name):
    with pytest.raises(LimitError, match=f"{frames} frames over 1,000,000 cells would take about") as refused:
        refuse_frames(cells, frames, moving, mode, SETTINGS)
    assert refused.value.limit_name == limit_name


def test_what_stands_still_costs_only_the_columns():
    refuse_frames(1_000_000, 20, 0, "exact", SETTINGS)
