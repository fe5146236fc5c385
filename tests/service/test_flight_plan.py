"""A planned flight as the service answers it: outcome, totals, files and pictures."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from planning import PathProblemError, PlaceError
from service.errors import LimitError, RequestError
from service.products import Given, Work
from service.products.flights import FLIGHT
from service.products.flights.calculate import calculate_flight, check_flight_request
from service.products.flights.files import LAYERS
from service.products.flights.picture import draw_flight, draw_flight_profile
from service.products.flights.request import FlightIn, FlightParameters
from service.settings import Settings
from terrain import to_grid_frame
from tests.service.small_flights import HIGH, MAP, flight_request, small_flight
from tests.service.small_maps import small_grid
from tests.service.small_paths import at


@pytest.fixture(scope="module")
def found():
    return small_flight()


@pytest.fixture(scope="module")
def above():
    return small_flight(morphing_map=MAP, **HIGH)


@pytest.fixture(scope="module")
def shut():
    return small_flight(ceiling_altitude_m=70.0)


@pytest.fixture
def written(tmp_path):
    def write(finished, name):
        FLIGHT.layer[name].write(finished, tmp_path / name)
        return (tmp_path / name).read_text(encoding="utf-8")

    return write


def layers_of(finished):
    return [layer.name for layer in LAYERS if layer.is_in(finished.answer.model_dump(mode="json"))]


def test_a_flight_goes_over_the_wall_and_keeps_its_bubble(found):
    answer = found.answer
    assert answer.status == "found", answer.sentence
    assert answer.validation.passed
    assert answer.totals.clearance_m >= 15.0 - 2e-3
    assert answer.totals.highest_m > 60.0 + 15.0
    assert answer.totals.margin_m is None
    assert answer.corners[0].altitude_m == 60.0
    assert answer.corners[-1].above_ground_m == pytest.approx(40.0)
    assert answer.totals.time_s == pytest.approx(answer.totals.length_m / 12.0)


def test_a_flight_stays_above_the_morphing_map_that_it_is_given(above):
    answer = above.answer
    assert answer.status == "found", answer.sentence
    assert answer.totals.margin_m >= -2e-3
    limits = {check.limit for check in answer.validation.checks}
    assert {"height over the morphing map", "height under the ceiling", "distance to the ground"} <= limits
    assert above.answer.mode == "exact"
    assert above.answer.error_statement


def test_under_a_ceiling_below_the_wall_there_is_no_flight(shut):
    assert (shut.answer.status, shut.answer.stopped_by) == ("unreachable", "proof")
    assert not shut.found
    assert shut.answer.totals is None
    assert shut.answer.corners == []


def test_told_to_stop_it_answers_with_the_best_that_it_has():
    asked = FlightParameters.model_validate(flight_request(budget={"iterations": 10_000_000}))
    stopped = calculate_flight(small_grid(), asked, Work(stop=lambda: True))
    assert (stopped.answer.status, stopped.answer.stopped_by) == ("found", "stop")
    assert stopped.answer.validation.passed


def test_geojson_has_altitudes_and_a_point_for_each_corner(found, written):
    line, *corners = json.loads(written(found, "flight.geojson"))["features"]
    lon_deg, lat_deg, up_m = np.array(line["geometry"]["coordinates"]).T
    east_m, north_m = to_grid_frame(found.grid, lon_deg, lat_deg)
    np.testing.assert_allclose(np.column_stack([east_m, north_m, up_m]), found.corners_m, atol=2e-3)
    assert line["properties"]["length_m"] == found.answer.totals.length_m
    assert len(corners) == len(found.corners_m)
    assert {"above_ground_m", "time_s", "altitude_m"} <= set(corners[0]["properties"])


def test_geojson_without_a_flight_shows_its_ends(shut, written):
    features = json.loads(written(shut, "flight.geojson"))["features"]
    assert [feature["properties"]["what"] for feature in features] == ["start", "goal"]


def test_without_a_crs_geojson_is_in_local_metres_and_there_is_no_mission(written):
    local = small_flight(crs=None)
    document = json.loads(written(local, "flight.geojson"))
    assert "local frame" in document["coordinates_are"]
    assert document["features"][0]["geometry"]["coordinates"][0] == [*at(100.0, 400.0).values(), 60.0]
    names = layers_of(local)
    assert names == ["flight.geojson", "flight.csv", "map.png", "profile.png"]


def test_the_mission_takes_a_drone_off_and_through_every_corner_at_its_altitude(found, written):
    found = replace(found, grid=replace(found.grid, vertical_datum="EGM96 geoid"))
    mission = json.loads(written(found, "flight.plan"))["mission"]
    assert (mission["vehicleType"], mission["cruiseSpeed"]) == (2, 12.0)
    assert [item["command"] for item in mission["items"]] == [22] + [16] * (len(found.corners_m) - 1)
    assert [item["Altitude"] for item in mission["items"]] == pytest.approx(found.corners_m[:, 2], abs=1e-3)


def test_the_table_tells_the_air_along_the_flight(above, found, written):
    rows = list(csv.DictReader(written(above, "flight.csv").splitlines()))
    assert float(rows[-1]["distance_m"]) == pytest.approx(above.answer.totals.length_m, abs=1e-3)
    assert all(float(row["floor_m"]) <= float(row["altitude_m"]) + 2e-3 <= float(row["top_m"]) + 4e-3 for row in rows)
    bare = list(csv.DictReader(written(found, "flight.csv").splitlines()))
    assert {(row["floor_m"], row["top_m"]) for row in bare} == {("", "")}


def test_the_pictures_show_the_flight_between_map_and_ceiling(above, shut):
    legend = draw_flight_profile(above).axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["ground", "morphing map", "ceiling", "flight"]
    words = [text.get_text() for text in draw_flight(shut).axes[0].get_legend().get_texts()]
    assert words == ["start", "goal"]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"anchors": MAP["anchors"]}, "belong into its morphing_map"),
        ({"ceiling_altitude_m": 90.0, "ceiling_above_ground_m": 50.0}, "only one of ceiling_altitude_m"),
        ({"start": at(1.0, 1.0)}, "exactly one of above_ground_m and altitude_m"),
        ({"bubble_m": -1.0}, "bubble_m"),
        ({"budget": {"seconds": 0.0}}, "seconds"),
        ({"morphing_map": {**MAP, "frames": {"from_s": 0.0, "to_s": 10.0, "step_s": 5.0}}}, "leave out its frames"),
    ],
)
def test_what_makes_no_request_is_refused_in_a_sentence(changes, sentence):
    with pytest.raises(ValidationError, match=sentence):
        FlightParameters.model_validate(flight_request(**changes))


def test_start_and_goal_must_differ_and_be_in_air_that_may_be_flown():
    same = FlightParameters.model_validate(flight_request(goal=flight_request()["start"]))
    with pytest.raises(PathProblemError, match="same place"):
        check_flight_request(small_grid(), same)
    with pytest.raises(PlaceError, match=r"start at 20.0 m is below the floor; it may be there from \d+\.\d m up"):
        small_flight(start={**at(100.0, 400.0), "altitude_m": 20.0})
    with pytest.raises(PlaceError, match=r"above the ceiling; it may be there up to 80.0 m"):
        small_flight(start={**at(100.0, 400.0), "altitude_m": 95.0}, ceiling_altitude_m=80.0)


def test_a_budget_beyond_the_limit_of_a_job_is_refused():
    asked = FlightParameters.model_validate(flight_request(budget={"seconds": 1e6}))
    with pytest.raises(LimitError, match="more than the limit"):
        FLIGHT.refuse(small_grid(), asked, Settings())


def test_a_finished_morphing_map_is_flown_above_unless_it_has_frames():
    asked = FlightIn.model_validate({"dem_id": "D", "map_id": "M", **flight_request(**HIGH)})
    assert FLIGHT.needs(asked).map_kinds == ("morphing-map",)
    assert FLIGHT.completed(asked, Given("morphing-map", MAP)).morphing_map.dop_limit == 30.0
    frames = {**MAP, "frames": {"from_s": 0.0, "to_s": 10.0, "step_s": 5.0}}
    with pytest.raises(RequestError, match="has frames; a flight is planned above one without"):
        FLIGHT.completed(asked, Given("morphing-map", frames))
