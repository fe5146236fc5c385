"""Satellites over hours, as frames of a morphing map take them."""

import pytest

from tests.visibility.satellites.constellation import NOON, walker
from tests.visibility.satellites.test_eyes import GRIDS, flat_grid
from visibility import VisibilityInputError
from visibility.satellites import satellite_eyes, satellite_tracks

TIMES_S = [0.0, 3600.0, 7200.0]


@pytest.fixture(scope="module")
def eyes():
    return satellite_eyes(flat_grid(*GRIDS[0]), walker(), [NOON.plus(time_s) for time_s in TIMES_S])


def test_at_each_time_there_are_the_satellites_in_view_then(eyes):
    tracks = satellite_tracks(eyes, TIMES_S, ranging_sigma_m=2.0)
    for number, time_s in enumerate(TIMES_S):
        here = [track.at(time_s) for track in tracks]
        assert tuple(anchor for anchor in here if anchor is not None) == eyes.distant_anchors(
            number, ranging_sigma_m=2.0
        )
    assert any(track.at(0.0) is None for track in tracks)
    assert all(any(track.at(time_s) is not None for time_s in TIMES_S) for track in tracks)


def test_between_its_instants_nothing_is_known_of_a_satellite(eyes):
    with pytest.raises(VisibilityInputError, match="known at 3 instants only, and 5 s is none of them"):
        satellite_tracks(eyes, TIMES_S)[0].at(5.0)
    with pytest.raises(VisibilityInputError, match="stand at 3 instants; 2 times were given"):
        satellite_tracks(eyes, TIMES_S[:2])
