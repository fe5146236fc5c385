"""Anchors come in three forms of file, and what is written can be read again."""

import json

import pytest

from service.cli.asking.anchor_files import anchors_from_file
from service.cli.asking.path_files import path_fields, polygon_fields
from service.cli.asking.texts import anchor_from_text
from service.errors import RequestError
from service.missions.document import MissionIn
from service.parts.anchors import AnchorIn
from service.parts.shapes_in_grid import resolve_anchor
from service.products.visibility import VISIBILITY_MAP
from tests.service.small_maps import small_map

MILLIMETRE = 1e-3
D1 = AnchorIn(id="D1", east_m=1.0, north_m=2.0, above_ground_m=80.0, max_range_m=500.0)
D2 = AnchorIn(id="D2", east_m=-3.5, north_m=4e3, altitude_m=612.0, azimuth_from_deg=350.0, azimuth_to_deg=90.0)


@pytest.mark.parametrize("wrapped", [False, True])
def test_json_is_a_list_as_in_requests(tmp_path, wrapped):
    entries = [anchor.model_dump(exclude_none=True) for anchor in (D1, D2)]
    path = tmp_path / "anchors.json"
    path.write_text(json.dumps({"anchors": entries} if wrapped else entries))
    assert anchors_from_file(path) == [D1, D2]


def test_csv_has_the_fields_as_columns_and_empty_cells_for_what_is_not_given(tmp_path):
    path = tmp_path / "anchors.csv"
    path.write_text(
        "﻿id, east_m, north_m, above_ground_m, altitude_m, max_range_m, azimuth_from_deg, azimuth_to_deg\r\n"
        "D1, 1, 2, 80, , 500, ,\r\n"
        "D2, -3.5, 4e3, , 612, , 350, 90\r\n",
        encoding="utf-8",
    )
    assert anchors_from_file(path) == [D1, D2]


def test_x_y_z_of_a_radio_are_east_north_and_altitude_and_are_told(tmp_path, capsys):
    path = tmp_path / "anchors.csv"
    path.write_text("ID;X;Y;Z_m\n101;1,5;-2;3,25\n")
    assert anchors_from_file(path) == [AnchorIn(id="101", east_m=1.5, north_m=-2.0, altitude_m=3.25)]
    assert capsys.readouterr().err == "anchors.csv: X, Y, Z_m are taken for east_m, north_m, altitude_m.\n"
    path.write_text("id,x,east_m,y,z\n101,1,1,2,3\n")
    with pytest.raises(RequestError, match="has the column 'east_m' twice"):
        anchors_from_file(path)


def test_geojson_points_are_in_degrees_and_other_properties_pass(tmp_path):
    feature = {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [-118.05, 34.29, 7.0]},
        "properties": {"id": "D1", "above_ground_m": 80.0, "colour": "red"},
    }
    path = tmp_path / "anchors.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    assert anchors_from_file(path) == [AnchorIn(id="D1", lon_deg=-118.05, lat_deg=34.29, above_ground_m=80.0)]


@pytest.mark.parametrize("crs", ["EPSG:32611", None])
def test_anchors_of_a_result_can_be_the_next_input(tmp_path, crs):
    finished = small_map(crs)
    VISIBILITY_MAP.layer["anchors.geojson"].save(finished, tmp_path / "anchors.geojson")
    again = [resolve_anchor(finished.grid, asked) for asked in anchors_from_file(tmp_path / "anchors.geojson")]
    for anchor, original in zip(again, finished.anchors, strict=True):
        assert (anchor.id, anchor.limits) == (original.id, original.limits)
        assert (anchor.east_m, anchor.north_m) == pytest.approx((original.east_m, original.north_m), abs=MILLIMETRE)
        assert anchor.altitude_m == original.altitude_m


GROUND = {"dem_id": "0" * 32, "name": "valley.npz", "sha256": "0f3c2d"}


def test_anchors_of_an_answer_and_of_a_mission_can_be_the_next_input(tmp_path):
    finished = small_map("EPSG:32611")
    (tmp_path / "visibility.json").write_text(finished.answer.model_dump_json())
    told = anchors_from_file(tmp_path / "visibility.json")
    assert [(one.id, one.east_m, one.north_m, one.altitude_m) for one in told] == [
        (one.id, one.east_m, one.north_m, one.altitude_m) for one in finished.anchors
    ]
    anchors = [
        {"id": "D1", "east_m": 1.0, "north_m": 2.0, "kind": "drone", "height_m": 80.0, "height_from": "above_ground_m",
         "max_range_m": 500.0, "ranging_sigma_m": 0.1},
        {"id": "D2", "east_m": -3.5, "north_m": 4e3, "kind": "mast", "height_m": 612.0, "height_from": "altitude_m",
         "azimuth_from_deg": 350.0, "azimuth_to_deg": 90.0, "ranging_sigma_m": 0.1},
    ]  # fmt: skip
    mission = MissionIn.model_validate({"ground": GROUND, "anchors": anchors})
    (tmp_path / "mission.json").write_text(mission.model_dump_json())
    assert anchors_from_file(tmp_path / "mission.json") == [
        one.model_copy(update={"ranging_sigma_m": 0.1}) for one in (D1, D2)
    ]


AT = {"east_m": 1.0, "north_m": 2.0}
ODD = {"east_m": -1.5, "north_m": 2000.0}


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        ("D1,1,2,80agl", {"id": "D1", **AT, "above_ground_m": 80.0}),
        ("D1, -1.5 ,2e3, 612.5MSL", {"id": "D1", **ODD, "altitude_m": 612.5, "altitude_datum": "msl"}),
        ("Mast two,1,2,-4450msl", {"id": "Mast two", **AT, "altitude_m": -4450.0, "altitude_datum": "msl"}),
        ("D1,1,2,1e3msl", {"id": "D1", **AT, "altitude_m": 1000.0, "altitude_datum": "msl"}),
        ("D1,1,2,650HAE", {"id": "D1", **AT, "altitude_m": 650.0, "altitude_datum": "hae"}),
    ],
)
def test_an_option_is_id_east_north_height(text, fields):
    assert anchor_from_text(text, lonlat=False) == AnchorIn(**fields)


def test_lonlat_switches_the_pair():
    assert anchor_from_text("D1,-118,34,80agl", lonlat=True) == AnchorIn(
        id="D1", lon_deg=-118.0, lat_deg=34.0, above_ground_m=80.0
    )


KML = (
    '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>D1</name><ExtendedData><Data '
    'name="max_range_m"><value>500</value></Data></ExtendedData><Point><altitudeMode>relativeToGround</altitudeMode>'
    "<coordinates>-118.05,34.29,80</coordinates></Point></Placemark><Placemark><name>way</name><LineString>"
    "<coordinates>-118.05,34.29 -118.06,34.3</coordinates></LineString></Placemark></Document></kml>"
)


def test_a_file_of_another_program_gives_anchors_and_says_what_it_left_out(tmp_path, capsys):
    path = tmp_path / "anchors.kml"
    path.write_text(KML)
    (anchor,) = anchors_from_file(path)
    assert anchor == AnchorIn(id="D1", lon_deg=-118.05, lat_deg=34.29, above_ground_m=80.0, max_range_m=500.0)
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", "anchors.kml: 1 × LineString: not taken; Points were asked for.\n")
    assert path_fields(path) == [{"lon_deg": -118.05, "lat_deg": 34.29}, {"lon_deg": -118.06, "lat_deg": 34.3}]
    with pytest.raises(RequestError, match="holds no Polygon, only 1 × LineString and 1 × Point"):
        polygon_fields(path)


@pytest.mark.parametrize("suffix", [".kml", ".geojson", ".json"])
def test_a_file_of_more_than_ten_thousand_anchors_is_refused_in_every_form(tmp_path, suffix):
    point = {"type": "Point", "coordinates": [8.0, 47.0]}
    mark = "<Placemark><Point><coordinates>8,47</coordinates></Point></Placemark>"
    text = {
        ".kml": f"<kml><Document>{mark * 10_001}</Document></kml>",
        ".geojson": json.dumps(
            {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": point}] * 10_001}
        ),
        ".json": json.dumps([{}] * 10_001),
    }[suffix]
    (tmp_path / f"many{suffix}").write_text(text)
    with pytest.raises(RequestError, match="holds more than 10,000 anchors"):
        anchors_from_file(tmp_path / f"many{suffix}")
