"""A planned path as the service answers it: outcome, totals, files and pictures."""

import csv
import json
from xml.etree import ElementTree

import gpxpy
import numpy as np
import pytest
import shapely

from planning import PathProblemError, PlaceError
from planning.paths import RoverModel
from planning.words import time_words
from service.errors import RequestError
from service.products.paths import PATH
from service.products.paths.files import LAYERS
from service.products.paths.picture import draw_path
from service.products.paths.profile import draw_profile
from service.products.paths.question import check_path_request, limits_of, rover_of
from service.products.paths.request import PathLimitsIn, PathParameters, RoverIn
from terrain import height_at, to_grid_frame
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from tests.service.small_paths import ACROSS, WEST_OF_WALL, at, path_request, small_path
from visibility import VisibilityInputError

MILLIMETRE = 1e-3


@pytest.fixture(scope="module")
def found():
    return small_path(limits={"min_anchors": 1})


@pytest.fixture(scope="module")
def blocked():
    return small_path(ACROSS)


@pytest.fixture
def written(tmp_path):
    def write(finished, name):
        PATH.layer[name].write(finished, tmp_path / name)
        return (tmp_path / name).read_text(encoding="utf-8")

    return write


def layers_of(finished):
    asked, told = (model.model_dump(mode="json") for model in (finished.parameters, finished.answer))
    return [layer.name for layer in LAYERS if layer.is_of(asked) and layer.is_in(told)]


def test_a_path_leads_from_the_start_to_the_goal_around_the_no_go_area(found):
    answer = found.answer
    assert answer.status == "found"
    ends = [(found.column("east_m")[i], found.column("north_m")[i]) for i in (0, -1)]
    assert ends == [tuple(place.values()) for place in WEST_OF_WALL]
    line = shapely.LineString(np.column_stack([found.column("east_m"), found.column("north_m")]))
    box = shapely.box(WEST_M + 150.0, NORTH_M - 300.0, WEST_M + 300.0, NORTH_M - 200.0)
    assert line.distance(box) >= 0.5
    assert answer.validation.passed
    assert answer.totals.length_m == pytest.approx(found.column("distance_m")[-1])
    assert answer.ratio == pytest.approx(answer.cost / answer.reference_cost)
    assert sum(answer.cost_split.values()) == pytest.approx(answer.cost, rel=1e-6)


def test_the_wall_makes_the_goal_unreachable_and_the_answer_says_what_would_open_a_way(blocked):
    answer = blocked.answer
    assert answer.status == "unreachable"
    assert not blocked.found
    assert answer.totals is answer.cost is answer.ratio is answer.validation is None
    cut = answer.unreachable
    assert cut.reason == "slope"
    assert WEST_M + 500.0 < cut.where.east_m < WEST_M + 600.0
    assert cut.relaxations[0].sentence


def test_geojson_holds_the_line_with_totals_and_what_holds_at_each_vertex(found, written):
    document = json.loads(written(found, "path.geojson"))
    line, *points = document["features"]
    assert line["geometry"]["type"] == "LineString"
    assert len(points) == len(line["geometry"]["coordinates"]) == len(found.vertices)
    lon_deg, lat_deg, up_m = np.array(line["geometry"]["coordinates"]).T
    east_m, north_m = to_grid_frame(found.grid, lon_deg, lat_deg)
    assert east_m == pytest.approx(found.column("east_m"), abs=2 * MILLIMETRE)
    assert north_m == pytest.approx(found.column("north_m"), abs=2 * MILLIMETRE)
    assert up_m == pytest.approx(height_at(found.grid, east_m, north_m), abs=0.02)
    assert line["properties"]["length_m"] == found.answer.totals.length_m
    assert line["properties"]["vertices"][3] == {
        key: value for key, value in points[3]["properties"].items() if key not in ("what", "number")
    }
    assert set(points[0]["properties"]) >= {
        *("visible_anchors", "dop", "bubble_radius_m", "clearance_m", "slope_deg", "margin_m", "time_s"),
    }
    seen = [len(point["properties"]["visible_anchors"]) for point in points]
    assert seen == [point["properties"]["anchor_count"] for point in points]


def test_geojson_without_a_path_shows_where_it_is_cut_and_by_what(blocked, written):
    document = json.loads(written(blocked, "path.geojson"))
    whats = [feature["properties"]["what"] for feature in document["features"]]
    assert whats == ["start", "goal", "blocked"]
    assert document["features"][-1]["properties"]["reason"] == "slope"


def test_on_a_dem_without_crs_geojson_is_in_local_metres_and_says_so(written):
    local = small_path(crs=None)
    document = json.loads(written(local, "path.geojson"))
    assert "local frame" in document["coordinates_are"]
    assert document["features"][0]["geometry"]["coordinates"][0][:2] == list(WEST_OF_WALL[0].values())
    names = layers_of(local)
    assert names == ["path.geojson", "path.csv", "map.png", "profile.png"]


def test_a_path_has_every_layer_and_a_plan_without_one_only_the_map(found, blocked):
    assert layers_of(found) == [layer.name for layer in LAYERS if layer.needs is None]
    assert layers_of(blocked) == ["path.geojson", "map.png"]


def test_the_table_has_a_row_per_vertex(found, written):
    rows = list(csv.DictReader(written(found, "path.csv").splitlines()))
    assert len(rows) == len(found.vertices)
    assert float(rows[-1]["distance_m"]) == pytest.approx(found.column("distance_m")[-1], abs=1e-3)
    assert rows[0]["bubble_radius_m"] == ""
    assert {len(row["visible_anchors"].split()) == int(row["anchor_count"]) for row in rows} == {True}


def test_other_programs_read_the_gpx_track_and_its_route(found, written):
    text = written(found, "path.gpx")
    gpx = gpxpy.parse(text)
    (track,), (route,) = gpx.tracks, gpx.routes
    points = track.segments[0].points
    assert len(points) == len(found.vertices)
    assert len(route.points) == len(found.corners)
    assert (points[-1].time - points[0].time).total_seconds() == pytest.approx(found.column("time_s")[-1], abs=2e-3)
    assert track.length_2d() == pytest.approx(_flat_length_m(found), rel=5e-3)
    root = ElementTree.fromstring(text)
    assert root.tag == "{http://www.topografix.com/GPX/1/1}gpx"
    assert root.get("version") == "1.1"


def _flat_length_m(finished):
    return np.hypot(np.diff(finished.column("east_m")), np.diff(finished.column("north_m"))).sum()


def test_the_mission_has_a_way_point_for_each_corner_in_order_and_is_for_a_rover(found, written):
    plan = json.loads(written(found, "path.plan"))
    mission = plan["mission"]
    assert (plan["fileType"], plan["version"], mission["vehicleType"]) == ("Plan", 1, 10)
    assert len(mission["items"]) == len(found.corners)
    assert [item["doJumpId"] for item in mission["items"]] == list(range(1, len(found.corners) + 1))
    assert {(item["type"], item["command"], item["frame"]) for item in mission["items"]} == {("SimpleItem", 16, 10)}
    lat_deg, lon_deg = mission["items"][-1]["params"][4:6]
    east_m, north_m = to_grid_frame(found.grid, lon_deg, lat_deg)
    assert (float(east_m), float(north_m)) == pytest.approx(tuple(WEST_OF_WALL[1].values()), abs=2 * MILLIMETRE)


def words_of(figure):
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend() is not None]
    labels = [text.get_text() for legend in legends for text in legend.get_texts()]
    return [*labels, *(text.get_text() for text in figure.texts), *(axes.get_ylabel() for axes in figure.axes)]


def test_the_picture_shows_the_way_the_areas_and_the_ends(found, blocked):
    words = words_of(draw_path(found))
    assert {"way", "start", "goal", "no-go area", "anchor"} <= set(words)
    assert any("cost 1.0" in word for word in words)
    words = words_of(draw_path(blocked))
    assert "cut: slope" in words
    assert any(word.startswith("There is no way") for word in words)


def test_without_anchors_the_picture_shows_the_ground_alone(tmp_path):
    bare = small_path(
        anchors=[], way_points=[at(200.0, 400.0)], keep_in=[{"ring": [at(0, 0), at(530, 0), at(530, 460), at(0, 460)]}]
    )
    words = words_of(draw_path(bare))
    assert {"way-point", "keep-in area"} <= set(words)
    assert any(word.startswith("may be driven") for word in words)
    assert "PDOP" not in words_of(draw_profile(bare))
    assert bare.answer.totals.worst_dop is None


def test_the_profile_has_a_panel_for_everything_that_is_known(found):
    words = words_of(draw_profile(found))
    assert [word for word in words if word in ("altitude, m", "slope, °", "in sight", "sight margin, m", "PDOP")]
    assert len(draw_profile(found).axes) == 7


def test_a_goal_may_be_an_area_and_degrees_and_metres_may_be_mixed():
    area = {"ring": [at(400.0, 20.0), at(500.0, 20.0), at(500.0, 120.0), at(400.0, 120.0)]}
    finished = small_path(goals=[area], start={"lon_deg": -118.085859, "lat_deg": 34.335279})
    assert finished.found
    end = finished.column("east_m")[-1] - WEST_M, NORTH_M - finished.column("north_m")[-1]
    assert 400.0 <= end[0] <= 500.0
    assert 20.0 <= end[1] <= 120.0


def test_a_morphing_map_takes_the_place_of_anchors():
    air = {"anchors": path_request()["anchors"], "ceiling_above_ground_m": 40.0, "dop_limit": 30.0, "min_anchors": 3}
    finished = small_path((at(220.0, 430.0), at(300.0, 350.0)), anchors=[], morphing_map=air)
    assert finished.found
    assert "height over the morphing map" in {check.limit for check in finished.answer.validation.checks}
    assert finished.anchors == ()
    assert np.isfinite(finished.dop).any()


TRACK = {
    "id": "T",
    "points": [{"time_s": t, **at(e, 60.0), "above_ground_m": 80.0} for t, e in ((0.0, 60.0), (5000.0, 480.0))],
}


def test_an_anchor_on_a_track_is_ranged_to_and_drawn_where_it_is_at_the_start(written):
    finished = small_path(tracks=[TRACK], departure_s=100.0, frame_s=300.0)
    assert finished.found
    assert finished.answer.ranged_to == ["W", "N", "S", "E", "T"]
    assert finished.visible.shape[1] == 5
    assert [anchor.id for anchor in finished.anchors] == ["W", "N", "S", "E"]
    line = json.loads(written(finished, "path.geojson"))["features"][0]["properties"]
    assert any("T" in vertex["visible_anchors"] for vertex in line["vertices"])
    assert "T" in [text.get_text() for text in draw_path(finished).axes[0].texts]


def test_a_safety_bubble_is_kept_told_and_drawn(written):
    navigation = {"initial_sigma_m": 0.3, "ground_sigma_m": 0.2, "motion_m2_per_s3": 0.001}
    finished = small_path(limits={"bubble_epsilon": 1.0, "dem_sigma_m": 0.1}, no_go=[], navigation=navigation)
    assert finished.found, finished.answer.sentence
    assert "room for the safety bubble" in {check.limit for check in finished.answer.validation.checks}
    assert (finished.column("bubble_radius_m") > 0.1).all()
    assert (finished.column("clearance_m") >= finished.column("bubble_radius_m") - 1e-3).all()
    rows = list(csv.DictReader(written(finished, "path.csv").splitlines()))
    assert float(rows[-1]["position_sigma_m"]) > 0.0
    assert "radius of the safety bubble" in words_of(draw_profile(finished))


def test_position_error_may_be_part_of_the_price():
    finished = small_path(weights={"position_error": 5.0})
    assert finished.answer.cost_split["position_error"] > 0.0
    assert finished.answer.totals.mean_position_sigma_m > 0.0


def test_a_start_that_cannot_be_stood_on_says_why_and_what_is_nearest():
    with pytest.raises(PlaceError, match="start cannot be stood on: slope") as raised:
        small_path((at(540.0, 200.0), at(470.0, 70.0)))
    assert raised.value.nearest_m is not None


@pytest.mark.parametrize(
    ("changes", "error", "sentence"),
    [
        ({"no_go": [{"ring": [at(0, 0), at(100, 100), at(100, 0), at(0, 100)]}]}, RequestError, "Self-intersection"),
        ({"limits": {"min_anchors": 9}}, PathProblemError, "9 anchors in sight are asked for, and there are only 4"),
        ({"tracks": [TRACK], "departure_s": 6000.0}, VisibilityInputError, "runs from 0 s to 5000 s"),
        ({"tracks": [TRACK], "way_points": [at(200, 100)]}, PathProblemError, "each leg is a plan of its own"),
        ({"weights": {"length": 0.0, "time": 0.0}}, PathProblemError, "must cost something"),
        (
            {"rover": {"speed_over_slope": [{"slope_deg": s, "speed_m_per_s": 1.0} for s in (5.0, -5.0)]}},
            PathProblemError,
            "ascending slopes",
        ),
    ],
)
def test_what_contradicts_itself_is_refused_before_anything_is_calculated(changes, error, sentence):
    asked = PathParameters.model_validate(path_request(**changes))
    with pytest.raises(error, match=sentence):
        check_path_request(small_grid(), asked)


def test_a_request_checks_how_many_are_ranged_to():
    assert check_path_request(small_grid(), PathParameters.model_validate(path_request())) == 4


def test_the_defaults_of_a_request_are_those_of_the_library():
    assert rover_of(RoverIn.model_validate({})) == RoverModel()
    assert limits_of(PathLimitsIn.model_validate({})).needed_in_sight == 3


@pytest.mark.parametrize(("seconds", "words"), [(3.0, "3 s"), (150.0, "2 min"), (9000.0, "2 h 30 min")])
def test_times_are_told_as_people_say_them(seconds, words):
    assert time_words(seconds) == words
