"""Other ways and other times to leave, as the service and the command line tell of them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from planning.alternatives import alternatives_to, plan_departures
from planning.paths import PathStatus, plan_path
from service.products.paths.files import LAYERS
from service.products.paths.picture import draw_path
from service.products.paths.question import path_question, path_sources, path_tracks
from service.products.paths.request import PathParameters
from terrain import to_lon_lat
from tests.service.small_maps import WEST_M, small_grid
from tests.service.small_paths import at, path_request, small_path
from visibility import VisibilityInputError

TRACK = {
    "id": "T",
    "points": [
        {"time_s": 0.0, **at(700.0, 60.0), "above_ground_m": 40.0},
        {"time_s": 900.0, **at(250.0, 200.0), "above_ground_m": 150.0},
        {"time_s": 5000.0, **at(250.0, 200.0), "above_ground_m": 150.0},
    ],
}


def test_alternatives_are_those_of_the_library_and_its_layer_has_a_line_for_each(tmp_path):
    finished = small_path(alternatives=2)
    asked = PathParameters.model_validate(path_request(alternatives=2))
    grid = small_grid()
    problem = path_question(grid, asked, path_sources(grid, asked))
    expected = alternatives_to(problem, plan_path(problem), 2)
    told = finished.answer.alternatives
    assert len(told) == len(expected.paths) >= 1
    assert finished.answer.alternatives_sentence == expected.sentence
    for one, other in zip(told, expected.paths, strict=True):
        assert (one.what, one.sentence) == (other.what, other.sentence)
        assert one.totals.length_m == pytest.approx(other.path.totals.length_m)
        places = [(place.east_m, place.north_m) for place in one.corners]
        turns = np.column_stack([other.path.east_m, other.path.north_m])[other.path.corners]
        np.testing.assert_allclose(places, turns, atol=1e-6)
    (layer,) = (layer for layer in LAYERS if layer.name == "alternatives.geojson")
    layer.save(finished, tmp_path / layer.name)
    lines = json.loads((tmp_path / layer.name).read_text())["features"]
    assert [line["properties"]["what"] for line in lines] == ["path", *(one.what for one in told)]
    assert lines[1]["properties"]["length_m"] == told[0].totals.length_m
    first = told[0].corners[0]
    assert lines[1]["geometry"]["coordinates"][0][:2] == pytest.approx(to_lon_lat(grid, first.east_m, first.north_m))


def test_only_who_asks_for_alternatives_has_them_and_their_layer():
    plain = small_path()
    assert (plain.answer.alternatives, plain.answer.alternatives_sentence) == ([], "")
    (layer,) = (layer for layer in LAYERS if layer.name == "alternatives.geojson")
    asked, not_asked = (PathParameters.model_validate(path_request(**more)) for more in ({"alternatives": 1}, {}))
    assert layer.is_of(asked.model_dump(mode="json"))
    assert not layer.is_of(not_asked.model_dump(mode="json"))


def test_of_a_window_the_cheapest_departure_is_taken():
    window = {"anchors": [], "tracks": [TRACK], "limits": {"in_sight_from": 1}, "leave_by_s": 1200.0}
    finished = small_path(**window)
    asked = PathParameters.model_validate(path_request(**window))
    grid = small_grid()
    problem = path_question(grid, asked, path_sources(grid, asked), tracks=path_tracks(grid, asked))
    expected = plan_departures(problem, 1200.0)
    assert expected.best is not None
    told = finished.answer
    assert [one.departure_s for one in told.departures] == [0.0, 300.0, 600.0, 900.0, 1200.0]
    assert [one.taken for one in told.departures] == [one is expected.best for one in expected.tried]
    assert told.cost == min(one.cost for one in told.departures if one.cost is not None)
    assert told.departures_sentence == expected.sentence
    in_time = small_path(**window, arrive_by_s=700.0).answer.departures_sentence
    assert in_time == "Of 5 departures the one at 0 s costs least of those that arrive by 12 min; it arrives at 10 min."
    with pytest.raises(VisibilityInputError, match="runs from 0 s to 5000 s, so nothing is known of it at 5001 s"):
        small_path(**window | {"leave_by_s": 5001.0})
    late = small_path(**window, arrive_by_s=1.0)
    assert late.answer.status is PathStatus.UNDECIDED
    assert "does a path arrive by 1 s; the soonest arrives at" in late.answer.sentence
    assert not late.found


def test_both_are_told_where_the_first_departure_has_no_path_and_others_come_too_late(monkeypatch):
    window = {"anchors": [], "tracks": [TRACK], "limits": {"in_sight_from": 1}, "leave_by_s": 600.0}

    def lost(problem, **watched):
        outcome = plan_path(problem, **watched)
        return replace(outcome, status=PathStatus.UNDECIDED, path=None, validation=None, sentence="No sight at first.")

    monkeypatch.setattr("service.products.paths.calculate.plan_path", lost)
    answer = small_path(**window, arrive_by_s=1.0).answer
    assert answer.sentence.startswith(
        "No sight at first. At none of 5 departures does a path arrive by 1 s; the soonest "
    )
    assert answer.sentence.count("No sight at first.") == 1


def test_a_way_that_costs_less_but_comes_too_late_gives_way_to_that_of_the_departure(monkeypatch):
    window = {"anchors": [], "tracks": [TRACK], "limits": {"in_sight_from": 1}, "leave_by_s": 600.0}
    (soonest, *_) = [one for one in small_path(**window).answer.departures if one.taken]

    def slower(problem, **watched):
        outcome = plan_path(problem, **watched)
        totals = replace(outcome.path.totals, time_s=outcome.path.totals.time_s + 9.0)
        return replace(outcome, path=replace(outcome.path, cost=outcome.path.cost - 9.0, totals=totals))

    monkeypatch.setattr("service.products.paths.calculate.plan_path", slower)
    free = small_path(**window, arrive_by_s=soonest.arrival_s + 10.0).answer
    bound = small_path(**window, arrive_by_s=soonest.arrival_s + 1.0).answer
    assert free.cost == pytest.approx(soonest.cost - 9.0)
    assert bound.cost == pytest.approx(soonest.cost)
    assert soonest.departure_s + bound.totals.time_s <= soonest.arrival_s + 1.0


def test_other_ways_arrive_in_time_too():
    window = {"anchors": [], "tracks": [TRACK], "limits": {"in_sight_from": 1}, "leave_by_s": 600.0, "alternatives": 1}
    free = small_path(**window).answer
    (taken,) = [one for one in free.departures if one.taken]
    (other,) = free.alternatives
    assert other.totals.time_s > free.totals.time_s + 2.0
    bound = small_path(**window, arrive_by_s=taken.departure_s + other.totals.time_s - 1.0).answer
    assert bound.status is PathStatus.FOUND
    assert all(one.totals.time_s < other.totals.time_s - 1.0 for one in bound.alternatives)


def test_the_picture_has_moving_anchors_where_they_are_when_the_rover_leaves():
    finished = small_path(anchors=[], tracks=[TRACK], limits={"in_sight_from": 1}, leave_by_s=1200.0)
    (taken,) = [one for one in finished.answer.departures if one.taken]
    assert taken.departure_s == 300.0
    (label,) = [text for text in draw_path(finished).axes[0].texts if text.get_text() == "T"]
    assert 1000.0 * label.xy[0] == pytest.approx(WEST_M + 550.0, abs=0.1)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"alternatives": 0}, "greater than or equal to 1"),
        ({"alternatives": 2, "rover": {"min_turning_radius_m": 2.0}}, "turns on the spot"),
        ({"leave_by_s": 60.0}, "leave_by_s goes with tracks"),
        ({"arrive_by_s": 60.0}, "arrive_by_s goes with leave_by_s"),
        ({"tracks": [TRACK], "departure_s": 60.0, "leave_by_s": 60.0}, "leave_by_s has to be after departure_s"),
        ({"tracks": [TRACK], "leave_by_s": 60.0, "arrive_by_s": 0.0}, "arrive_by_s has to be after departure_s"),
    ],
)
def test_choices_that_make_no_sense_are_refused(changes, sentence):
    with pytest.raises(ValidationError, match=sentence):
        PathParameters.model_validate(path_request(**changes))
