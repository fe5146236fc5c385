"""Navigated drives as a product: over a map, with and without asking it, and what is refused."""

import numpy as np
import pytest
from pydantic import ValidationError

from navigation import MeasurementError, TimeOrderError
from service.products.navigations.calculate import calculate_navigation
from service.products.navigations.request import NavigationParameters
from tests.service.small_drives import drive_request, true_places_m
from tests.service.small_maps import small_grid


def asked(**changes):
    return calculate_navigation(small_grid(), NavigationParameters.model_validate(drive_request(**changes)))


def off_m(finished):
    numbers = finished.numbers()
    places_m = np.column_stack([numbers[name] for name in ("east_m", "north_m", "altitude_m")])
    return np.linalg.norm(places_m - true_places_m(numbers["time_s"]), axis=1)


def creeping(m_per_s):
    """The ranges of the drive, those to the anchors that the wall hides longer and longer, which no gate notices."""
    ranges = drive_request()["ranges"]
    return [
        {**one, "range_m": one["range_m"] + m_per_s * one["time_s"] * (one["anchor_id"] in "WNS")} for one in ranges
    ]


def test_the_map_tells_which_ranges_lie_and_how_high_the_ground_is():
    ranges = creeping(0.25)
    alone, over_map = asked(ranges=ranges, ask_the_map=False), asked(ranges=ranges)
    assert alone.answer.hidden_ranges is None
    assert over_map.answer.hidden_ranges == sum(one["anchor_id"] in "WNS" for one in ranges)
    # from behind the wall one anchor is left, and the ground
    assert off_m(over_map).max() < 1.5
    assert off_m(over_map).max() < 0.5 * off_m(alone).max()
    assert {one.source for one in over_map.answer.sources} == {"range", "position", "velocity", "ground"}


def test_places_are_told_once_an_interval_and_the_last_one():
    finished = asked(interval_s=2.0)
    numbers = finished.numbers()
    assert finished.answer.places == len(finished.points) == len(numbers["time_s"])
    assert np.diff(numbers["time_s"]).max() < 2.5
    assert numbers["heading_deg"] == pytest.approx(90.0, abs=1.0)
    assert np.all(off_m(finished) < numbers["radius_m"])


def test_a_request_that_makes_no_drive_is_refused():
    plain = drive_request()
    for changes, sentence in (
        ({"fixes": [], "ranges": []}, "readings alone lose their way"),
        ({"anchors": plain["anchors"][1:]}, "goes to 'W', which is no anchor here"),
        ({"anchors": plain["anchors"] + plain["anchors"][:1]}, "must be unique; repeated: W"),
        ({"readings": {**plain["readings"], "rates": [[0.0, 0.0, 0.0]]}}, "must be equally long, not 401, 401 and 1"),
        ({"settings": {"imu": "HG1700"}}, "imu"),
    ):
        with pytest.raises(ValidationError, match=sentence):
            NavigationParameters.model_validate({**plain, **changes})


def test_readings_that_cannot_be_so_are_refused_with_what_to_say():
    readings = drive_request()["readings"]
    in_g = [[x, y, z / 9.80665] for x, y, z in readings["forces"]]
    with pytest.raises(MeasurementError, match="say force_unit='g'"):
        asked(readings={**readings, "forces": in_g})
    settings = {"heading_deg": 90.0}
    said = asked(readings={**readings, "forces": in_g}, settings={**settings, "force_unit": "g"})
    np.testing.assert_allclose(said.drive.place_m, asked(settings=settings).drive.place_m, atol=1e-6)
    with pytest.raises(MeasurementError, match="where axes='frd' has it down"):
        asked(readings=readings, settings={"axes": "frd"})
    with pytest.raises(MeasurementError, match="axes are three letters"):
        asked(readings=readings, settings={"axes": "fly"})
    back = [*readings["times_s"][:-1], 3.0]
    with pytest.raises(TimeOrderError, match="goes backwards"):
        asked(readings={**readings, "times_s": back})
