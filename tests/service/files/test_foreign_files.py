"""Files of other programs: what their own writers and specifications mean is what is read, and bombs do not go off."""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import gpxpy.gpx
import pytest
from fastkml import Data, Document, ExtendedData, Placemark
from fastkml.enums import AltitudeMode
from fastkml.geometry import create_kml_geometry
from fastkml.kml import KML
from pygeoif import LineString, Point, Polygon
from pyproj import Geod

from service.errors import RequestError
from service.files.foreign.features import Foreign
from service.files.foreign.reading import read_foreign

POINT = "<Placemark><Point><coordinates>%s</coordinates></Point></Placemark>"
KML_HEAD = '<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>'


def kml_of(*marks: Placemark) -> bytes:
    return KML(features=[Document(features=list(marks))]).to_string().encode()


def mark(name: str, geometry: Any, mode: AltitudeMode | None = None, **data: str) -> Placemark:
    told = ExtendedData(elements=[Data(name=key, value=value) for key, value in data.items()]) if data else None
    return Placemark(name=name, kml_geometry=create_kml_geometry(geometry, altitude_mode=mode), extended_data=told)


def points(foreign: Foreign) -> dict[str, tuple[list[float], dict[str, Any]]]:
    return {
        str(one["id"]): (one["geometry"]["coordinates"], one["properties"])
        for one in foreign.features
        if one["geometry"]["type"] == "Point"
    }


def heights(properties: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in properties.items() if key.startswith(("altitude", "above"))}


def test_altitude_modes_of_kml_say_what_a_height_counts_from() -> None:
    at = Point(-84.2, 36.4, 700.0)
    document = kml_of(
        mark("absolute", at, AltitudeMode.absolute),
        mark("relative", at, AltitudeMode.relative_to_ground),
        mark("clamped", at, AltitudeMode.clamp_to_ground),
        mark("default", at),
    )
    read = read_foreign("anchors.kml", document)
    found = points(read)
    assert {name: heights(properties) for name, (_, properties) in found.items()} == {
        "absolute": {"altitude_m": 700.0, "altitude_datum": "EGM96"},
        "relative": {"above_ground_m": 700.0},
        "clamped": {"above_ground_m": 0.0},
        "default": {"above_ground_m": 0.0},
    }
    assert found["absolute"][0] == [-84.2, 36.4], "longitude first"
    assert any("clamped, default" in sentence for sentence in read.told)


def test_extended_data_are_fields_and_heights_are_the_geometrys() -> None:
    sigma = mark("D1", Point(1.0, 2.0, 3.0), AltitudeMode.relative_to_ground, ranging_sigma_m="0.25", altitude_m="9")
    (_, properties) = points(read_foreign("a.kml", kml_of(sigma)))["D1"]
    assert properties == {"id": "D1", "ranging_sigma_m": 0.25, "above_ground_m": 3.0}


def test_lines_and_areas_of_kml_keep_their_order_and_holes() -> None:
    ring = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 0.0)]
    hole = [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.5)]
    read = read_foreign("a.kml", kml_of(mark("way", LineString(ring[:3])), mark("area", Polygon(ring, [hole]))))
    line, area = (one["geometry"] for one in read.features)
    assert line == {"type": "LineString", "coordinates": [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0]]}
    assert area["coordinates"] == [[list(place) for place in ring], [list(place) for place in hole]]


def test_what_kml_has_besides_placemarks_is_told() -> None:
    text = (
        f"{KML_HEAD}<NetworkLink/><GroundOverlay/><GroundOverlay/><Placemark><name>no place</name></Placemark>"
        "<Folder><Placemark><Point><coordinates> 1.5,2.5,3 </coordinates></Point></Placemark></Folder></Document></kml>"
    )
    read = read_foreign("a.kml", text.encode())
    assert points(read)["P2"][0] == [1.5, 2.5]
    told = " ".join(read.told)
    for words in ("1 × NetworkLink", "2 × GroundOverlay", "1 × Placemark without a geometry"):
        assert words in told


def test_a_track_of_googles_extension_is_a_line() -> None:
    text = (
        '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Placemark><gx:Track>'
        "<when>2026-01-01T00:00:00Z</when><gx:coord>7 46 100</gx:coord><gx:coord>7.5 46.5 110</gx:coord></gx:Track>"
        "</Placemark></kml>"
    )
    (feature,) = read_foreign("a.kml", text.encode()).features
    assert feature["geometry"] == {"type": "LineString", "coordinates": [[7.0, 46.0], [7.5, 46.5]]}


def test_a_kmz_is_its_first_document() -> None:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("files/icon.png", b"no picture")
        archive.writestr("doc.kml", kml_of(mark("D1", Point(1.0, 2.0))))
    assert list(points(read_foreign("a.KMZ", packed.getvalue()))) == ["D1"]


def test_gpx_of_its_own_library_counts_elevations_from_sea_level() -> None:
    gpx = gpxpy.gpx.GPX()
    gpx.waypoints.append(gpxpy.gpx.GPXWaypoint(46.4, 10.9, elevation=1650.0, name="D1"))
    gpx.waypoints.append(gpxpy.gpx.GPXWaypoint(46.5, 10.8, name="D2"))
    route = gpxpy.gpx.GPXRoute(name="over the pass")
    route.points += [gpxpy.gpx.GPXRoutePoint(46.4, 10.9), gpxpy.gpx.GPXRoutePoint(46.5, 10.8)]
    gpx.routes.append(route)
    read = read_foreign("a.gpx", gpx.to_xml().encode())
    found = points(read)
    assert found["D1"][0] == [10.9, 46.4]
    assert heights(found["D1"][1]) == {"altitude_m": 1650.0, "altitude_datum": "msl"}
    assert heights(found["D2"][1]) == {}
    assert "Without an elevation in the file: D2." in read.told
    assert read.features[-1]["geometry"] == {"type": "LineString", "coordinates": [[10.9, 46.4], [10.8, 46.5]]}


def item(command: int, frame: int, lat: float, lon: float, up: float | None) -> dict[str, Any]:
    """As QGroundControl's file format page has a SimpleItem."""
    params = [0, 0, 0, None, lat, lon, up]
    return {"type": "SimpleItem", "command": command, "frame": frame, "params": params, "autoContinue": True}


def plan(*items: dict[str, Any], home_m: float | None = 500.0, **more: Any) -> bytes:
    mission = {"version": 2, "plannedHomePosition": [46.0, 11.0, home_m], "items": list(items)}
    return json.dumps({"fileType": "Plan", "version": 1, "mission": mission, **more}).encode()


def test_frames_of_a_plan_say_what_a_height_counts_from() -> None:
    sea, home, ground = item(16, 0, 46.1, 11.1, 900.0), item(17, 3, 46.2, 11.2, 80.0), item(16, 10, 46.3, 11.3, 60.0)
    read = read_foreign("a.plan", plan(sea, home, ground))
    found = points(read)
    assert [place for place, _ in found.values()] == [[11.1, 46.1], [11.2, 46.2], [11.3, 46.3]]
    assert [heights(properties) for _, properties in found.values()] == [
        {"altitude_m": 900.0, "altitude_datum": "msl"},
        {"altitude_m": 580.0, "altitude_datum": "msl"},
        {"above_ground_m": 60.0},
    ]
    assert read.features[-1]["geometry"]["coordinates"] == [[11.1, 46.1], [11.2, 46.2], [11.3, 46.3]]
    unknown = read_foreign("a.plan", plan(home, home_m=None))
    assert heights(points(unknown)["W1"][1]) == {}
    assert "whose own the plan does not tell" in unknown.told[0]
    (sentence,) = read_foreign("a.plan", plan(item(16, 0, 46.1, 11.1, None))).told
    assert "1 × height that is no number" in sentence


def test_fences_patterns_rally_points_and_other_commands_of_a_plan() -> None:
    ring = [[46.0, 11.0], [46.0, 11.1], [46.1, 11.1]]
    fence = {
        "polygons": [{"polygon": ring, "inclusion": True}],
        "circles": [{"circle": {"center": [46.0, 11.0], "radius": 250.0}, "inclusion": False}],
    }
    survey = {"type": "ComplexItem", "complexItemType": "survey", "polygon": ring}
    speed = {"type": "SimpleItem", "command": 178, "frame": 2, "params": [1, 5, -1, 0, 0, 0, 0]}
    rally = {"points": [[46.0, 11.0, 30.0]]}
    read = read_foreign("a.plan", plan(survey, speed, geoFence=fence, rallyPoints=rally))
    found = {one["properties"]["what"]: one["geometry"] for one in read.features}
    assert found["keep-in"]["coordinates"] == [[[11.0, 46.0], [11.1, 46.0], [11.1, 46.1], [11.0, 46.0]]]
    assert found["survey"] == found["keep-in"]
    # the polygon lies round the circle: no side comes nearer than its radius, no corner is much farther
    (circle,) = found["no-go"]["coordinates"]
    distances = [Geod(ellps="WGS84").inv(11.0, 46.0, *corner)[2] for corner in circle]
    assert min(distances) == pytest.approx(max(distances), abs=1e-6)
    assert 250.0 < min(distances) < 250.5
    assert read.told == ("1 × command 178: not taken; it goes to no place.",)
    (_, rally_told) = points(read)["R1"]
    assert heights(rally_told) == {"altitude_m": 530.0, "altitude_datum": "msl"}


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE kml [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">'
    '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><kml><Placemark><name>&c;</name></Placemark></kml>'
)
OUTSIDE = BOMB.replace('"aaaaaaaaaa"', 'SYSTEM "file:///etc/passwd"')


def zipped(name: str, content: bytes) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return packed.getvalue()


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.kml", BOMB.encode(), "declares a document type"),
        ("a.kml", OUTSIDE.encode(), "declares a document type"),
        ("a.gpx", BOMB.replace("kml", "gpx").encode(), "declares a document type"),
        ("a.kmz", zipped("doc.kml", b" " * 40_000_000), "unpacks to more than"),
        ("a.kmz", zipped("doc.txt", b"no document"), "a zip without a KML document"),
        ("a.kmz", b"no zip", "no KMZ that can be read"),
        ("a.kml", b"no xml", "no XML that can be read"),
        ("a.kml", b"<gpx/>", "XML of another kind"),
        ("a.kml", f"{KML_HEAD}<Placemark><Point/></Placemark></Document></kml>".encode(), "without coordinates"),
        ("a.kml", f"{KML_HEAD}{POINT % 'east,2'}</Document></kml>".encode(), "no numbers"),
        ("a.kml", f"{KML_HEAD}{POINT % '1_0,2'}</Document></kml>".encode(), "no numbers"),
        ("a.gpx", b"<gpx><wpt/></gpx>", "no GPX that can be read"),
        ("a.gpx", b"<gpx><wpt lat='4_6' lon='11'/></gpx>", "a place whose numbers are none: '4_6'"),
        ("a.gpx", b"<gpx><wpt lat='46' lon='11'><ele>nan</ele></wpt></gpx>", "a place whose numbers are none: 'nan'"),
        ("a.plan", b"{}", "not a plan"),
        ("a.plan", b"[", "not JSON"),
        ("a.plan", b'{"fileType": "Plan\\ud800"}', "not JSON"),
        ("a.plan", b"[" * 100_000, "not JSON"),
        ("a.plan", plan(geoFence={"polygons": [5]}), "a fence that is none"),
        ("a.plan", b"[" + b"9" * 5000 + b"]", "not JSON"),
        ("a.plan", plan(geoFence={"polygons": [{"polygon": [[10**400, 7.0]]}]}), "has not two coordinates"),
        ("a.plan", plan(geoFence={"polygons": [{"polygon": [[46.0]]}]}), "has not two coordinates"),
    ],
)
def test_what_is_none_is_refused_in_one_sentence(name: str, data: bytes, words: str) -> None:
    with pytest.raises(RequestError, match=words) as refused:
        read_foreign(name, data)
    assert str(refused.value).startswith(f"The file {name}")
