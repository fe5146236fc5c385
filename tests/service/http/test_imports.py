"""Places of other programs' files on a ground, there and back: metres, datums, and what was lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fastkml import Data, ExtendedData, Placemark
from fastkml.enums import AltitudeMode
from fastkml.geometry import create_kml_geometry
from fastkml.kml import KML
from pygeoif import Point
from pyproj import Transformer

from service.cli.asking.anchor_files import anchors_from_file
from tests.service.http.test_missions import kept, mission_on
from tests.service.running import Server

FORMATS = ("anchors.csv", "mission.geojson", "mission.kml", "mission.kmz", "mission.gpx", "anchors.plan")


def imported(server: Server, dem: dict[str, Any], name: str, content: bytes) -> dict[str, Any]:
    answer = server.client.post("/imports", params={"dem_id": dem["id"]}, files={"file": (name, content)})
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def place_in(dem: dict[str, Any], across: float, up: float) -> dict[str, float]:
    """A place at shares of the way from west to east and from south to north."""
    bounds = dem["bounds_of_posts_m"]
    east_m = bounds["west"] + across * (bounds["east"] - bounds["west"])
    return {"east_m": east_m, "north_m": bounds["south"] + up * (bounds["north"] - bounds["south"])}


def mission_with_shapes(dem: dict[str, Any]) -> dict[str, Any]:
    mission = mission_on(dem, "There and back")
    places = [place_in(dem, *shares) for shares in ((0.1, 0.1), (0.3, 0.2), (0.2, 0.4))]
    first = {**mission["anchors"][0], **place_in(dem, 0.15, 0.15)}
    second = {**first, "id": "D2", **place_in(dem, 0.25, 0.35), "ranging_sigma_m": 0.25, "kind": "mast"}
    route = {"start": places[0], "goal": places[1], "way_points": [places[2]], "no_go": [places]}
    return {**mission, "anchors": [first, second], "route": route}


def files_of(server: Server, mission: dict[str, Any]) -> dict[str, str]:
    """Paths of the files of a mission, by name."""
    told = kept(server, mission)
    return {file["name"]: file["href"] for file in server.client.get(told["links"]["self"]).json()["files"]}


@pytest.mark.parametrize("name", FORMATS)
def test_what_a_mission_is_written_as_is_read_again(server: Server, ground: dict[str, Any], name: str) -> None:
    mission = mission_with_shapes(ground)
    links = files_of(server, mission)
    rows = server.client.get(links["anchors.json"]).json()["anchors"]
    answer = server.client.get(links[name])
    assert answer.status_code == 200, answer.text
    again = imported(server, ground, name, answer.content)
    assert len(again["points"]) == 2
    for point, anchor, row in zip(again["points"], mission["anchors"], rows, strict=True):
        assert (point["east_m"], point["north_m"]) == pytest.approx((anchor["east_m"], anchor["north_m"]), abs=0.01)
        by_height = (point["above_ground_m"], row["above_ground_m"]), (point["altitude_m"], row["altitude_m"])
        (height_m, wanted_m), *_ = [(one, other) for one, other in by_height if one is not None]
        assert height_m == pytest.approx(wanted_m, abs=0.01)
        if not name.endswith(".plan"):
            assert point["id"] == anchor["id"]
    if not name.startswith("anchors"):
        line = [(place["east_m"], place["north_m"]) for place in again["lines"][0]["places"]]
        route = mission["route"]
        wanted = [route["start"], *route["way_points"], route["goal"]]
        assert line == [pytest.approx((place["east_m"], place["north_m"]), abs=0.01) for place in wanted]
    if name in ("mission.geojson", "mission.kml", "mission.kmz"):
        (area,) = again["areas"]
        assert area["what"] == "no-go"
        corners = {(round(place["east_m"]), round(place["north_m"])) for place in area["places"]}
        assert corners == {(round(one["east_m"]), round(one["north_m"])) for one in mission["route"]["no_go"][0]}


@pytest.mark.parametrize("name", ["anchors.csv", "mission.geojson", "mission.kml", "mission.kmz"])
def test_anchors_come_back_with_their_radios_and_all_else_that_they_were_given(
    server: Server, ground: dict[str, Any], tmp_path: Path, name: str
) -> None:
    first = {**mission_on(ground)["anchors"][0], **place_in(ground, 0.15, 0.15), "radio": "868MHz", "height_m": 80.25}
    sector = {"max_range_m": 2500.0, "azimuth_from_deg": 20.0, "azimuth_to_deg": 140.0}
    second = {**first, "id": "M2", **place_in(ground, 0.25, 0.35), **sector, "ranging_sigma_m": 0.25}
    second |= {"kind": "mast", "radio": "uwb", "height_m": 2000.0, "height_from": "altitude_m"}
    third = {**first, "id": "B3", **place_in(ground, 0.4, 0.4), "kind": "beacon", "radio": None, "height_m": 0.0}
    mission = {**mission_on(ground, "Radios"), "anchors": [first, second, third]}
    content = server.client.get(files_of(server, mission)[name]).content
    again = imported(server, ground, name, content)["points"]
    for point, anchor in zip(again, mission["anchors"], strict=True):
        assert (point["east_m"], point["north_m"]) == pytest.approx((anchor["east_m"], anchor["north_m"]), abs=0.01)
        assert point[anchor["height_from"]] == pytest.approx(anchor["height_m"], abs=0.01)
        assert point[({"above_ground_m", "altitude_m"} - {anchor["height_from"]}).pop()] is None
        for field in ("id", "kind", "radio"):
            assert point[field] == anchor[field]
        assert [point[field] for field in sector] == [anchor.get(field) for field in sector]
        assert point["ranging_sigma_m"] == anchor.get("ranging_sigma_m", 0.1)
    # as the command line takes them
    path = tmp_path / name
    path.write_bytes(content)
    if name == "anchors.csv":
        taken = anchors_from_file(path)
        assert [one.radio and one.radio.preset for one in taken] == ["868MHz", "uwb", None]
        assert [one.id for one in taken] == ["D1", "M2", "B3"]


def test_a_radio_that_nobody_knows_is_told_and_left_out(server: Server, ground: dict[str, Any]) -> None:
    at = place_in(ground, 0.2, 0.2)
    table = f"id,east_m,north_m,above_ground_m,radio\nD1,{at['east_m']},{at['north_m']},50,walkie-talkie\n"
    found = imported(server, ground, "one.csv", table.encode())
    assert found["points"][0]["radio"] is None
    assert any("left out: D1 (walkie-talkie)" in sentence for sentence in found["told"])


def test_absolute_altitudes_of_kml_are_those_of_a_ground_above_egm96(server: Server, ground: dict[str, Any]) -> None:
    place = place_in(ground, 0.2, 0.2)
    lon, lat = Transformer.from_crs(ground["crs"], 4326, always_xy=True).transform(place["east_m"], place["north_m"])
    geometry = create_kml_geometry(Point(lon, lat, 2500.0), altitude_mode=AltitudeMode.absolute)
    document = KML(features=[Placemark(name="D1", kml_geometry=geometry)]).to_string().encode()
    (point,) = imported(server, ground, "one.kml", document)["points"]
    assert (point["east_m"], point["north_m"]) == pytest.approx((place["east_m"], place["north_m"]), abs=0.001)
    assert (point["altitude_m"], point["above_ground_m"]) == (2500.0, None)


def test_what_lies_outside_is_told_and_left_out(server: Server, ground: dict[str, Any]) -> None:
    within, outside = place_in(ground, 0.2, 0.2), place_in(ground, -0.2, 0.2)
    rows = [f"{name},{at['east_m']},{at['north_m']},50" for name, at in (("in", within), ("out", outside))]
    table = "\n".join(["id,east_m,north_m,above_ground_m", *rows])
    found = imported(server, ground, "two.csv", table.encode())
    assert [point["id"] for point in found["points"]] == ["in"]
    assert "Outside the ground, and left out: out." in found["told"]


def mast(max_range_m: str) -> bytes:
    told = ExtendedData(elements=[Data(name="max_range_m", value=max_range_m)])
    at = create_kml_geometry(Point(10.9, 46.4))
    return bytes(KML(features=[Placemark(name="D1", kml_geometry=at, extended_data=told)]).to_string().encode())


@pytest.mark.parametrize(
    ("name", "content", "status", "words"),
    [
        ("a.txt", b"hello", 422, "must end in"),
        ("a.json", b'[{"id": "\\ud800", "east_m": 1, "north_m": 1}]', 422, "not JSON"),
        ("a.json", b"[" * 100_000, 422, "not JSON"),
        ("a.kml", b"<!DOCTYPE kml [<!ENTITY a 'b'>]><kml>&a;</kml>", 422, "declares a document type"),
        ("a.csv", b"id,colour\nD1,red\n", 422, "colour"),
        ("a.geojson", b"{}", 422, "no GeoJSON"),
        ("a.gpx", b"<gpx></gpx>", 422, "holds no places"),
        ("a.kml", mast("nan"), 422, "a.kml, D1: max_range_m is 'nan', not a finite number"),
        ("a.kml", mast("1_0"), 422, "a.kml, D1: max_range_m is '1_0', not a finite number"),
        ("a.csv", b"id,east_m,north_m,max_range_m\nD1,1,1,nan\n", 422, "D1: max_range_m is 'nan', not a finite"),
        ("a.csv", b"id,east_m,north_m,max_range_m\nD1,1,1,1_0\n", 422, "line 2: max_range_m is '1_0', not a number"),
        ("a.json", b'[{"id": "D1", "east_m": 1, "north_m": 1, "max_range_m": 1e999}]', 422, "not a finite number"),
        ("a.json", b'[{"id": "D1", "east_m": 1, "north_m": 1, "azimuth_from_deg": "10"}]', 422, "not a finite number"),
    ],
)
def test_what_cannot_be_read_is_refused(
    server: Server, ground: dict[str, Any], name: str, content: bytes, status: int, words: str
) -> None:
    answer = server.client.post("/imports", params={"dem_id": ground["id"]}, files={"file": (name, content)})
    assert (answer.status_code, words in answer.json()["detail"]) == (status, True), answer.text


def test_an_unknown_ground_is_refused(server: Server) -> None:
    answer = server.client.post("/imports", params={"dem_id": "0" * 32}, files={"file": ("a.csv", b"id\n")})
    assert answer.status_code == 404
