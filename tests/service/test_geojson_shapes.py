"""GeoJSON is read in one way everywhere: all of it is used, or a sentence says what is not."""

from __future__ import annotations

from typing import Any

import pyproj
import pytest

from service.errors import RequestError
from service.parts.geojson_reading import line_of, polygons_of, shapes_of

RING = [[11.0, 46.0], [11.1, 46.0], [11.1, 46.1], [11.0, 46.0]]
POLYGON = {"type": "Polygon", "coordinates": [RING]}
POINT = {"type": "Point", "coordinates": [11.0, 46.0]}
INNER = {"type": "GeometryCollection", "geometries": [POLYGON]}
LINE = {"type": "LineString", "coordinates": RING[:3]}
PLACES = [{"lon_deg": lon, "lat_deg": lat} for lon, lat in RING]


def feature(geometry: Any, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def collection(*features: Any, **members: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": list(features), **members}


def named(crs: str) -> dict[str, Any]:
    return {"type": "name", "properties": {"name": crs}}


@pytest.mark.parametrize(
    "document",
    [
        POLYGON,
        feature(POLYGON),
        {"type": "MultiPolygon", "coordinates": [[RING]]},
        {"type": "GeometryCollection", "geometries": [POLYGON]},
        feature({"type": "GeometryCollection", "geometries": [INNER]}),
        collection(collection(feature(POLYGON))),
        collection(feature({"type": "MultiPolygon", "coordinates": []}), feature(POLYGON)),
    ],
)
def test_a_polygon_is_found_however_it_is_wrapped(document: Any) -> None:
    assert [fields for fields, _ in polygons_of(document, "It")] == [{"ring": PLACES, "holes": []}]


def test_the_parts_of_a_collection_have_its_features_properties() -> None:
    document = feature({"type": "GeometryCollection", "geometries": [POLYGON, POLYGON]}, weight=3.0)
    assert [properties["weight"] for _, properties in polygons_of(document, "It")] == [3.0, 3.0]


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        (collection(feature(POLYGON), feature(LINE)), "It holds a LineString beside its polygons"),
        (collection(feature(POLYGON), feature(POINT)), "It holds a Point beside its polygons"),
        (LINE, "It holds no polygons."),
        (collection(feature(POLYGON), feature(None)), "a feature without a geometry"),
        (collection(feature(POLYGON), 7), "a part that is no GeoJSON object"),
        ({"type": "Topology", "objects": {}}, "type 'Topology', which GeoJSON does not know"),
        ({"type": ["Polygon"]}, "GeoJSON does not know"),
        (collection(), "holds no GeoJSON geometries"),
        ({"type": "FeatureCollection"}, "without a list 'features'"),
        ({"type": "Polygon", "coordinates": [[]]}, "a Polygon without places"),
        ({"type": "Polygon", "coordinates": [[[10**400, 1]]]}, "no finite numbers"),
        ({"type": "Point", "coordinates": [True, 1]}, "no numbers"),
        ({"type": "Point", "coordinates": [1]}, "two coordinates"),
        ([POLYGON], "is not GeoJSON"),
    ],
)
def test_what_is_not_used_is_refused(document: Any, sentence: str) -> None:
    with pytest.raises(RequestError, match=sentence):
        polygons_of(document, "It")


def test_collections_in_collections_end_somewhere() -> None:
    document: dict[str, Any] = POLYGON
    for _ in range(500):
        document = {"type": "GeometryCollection", "geometries": [document]}
    with pytest.raises(RequestError, match="deeper than 32"):
        shapes_of(document, "It")


@pytest.mark.parametrize(
    "crs",
    ["EPSG:4326", "urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84", "urn:ogc:def:crs:EPSG::4326", "CRS84"],
)
def test_degrees_on_wgs_84_stay_as_they_are(crs: str) -> None:
    ((fields, _),) = polygons_of({**POLYGON, "crs": named(crs)}, "It")
    assert fields["ring"] == [{**place, "body": "Earth"} for place in PLACES]


@pytest.mark.parametrize(
    ("crs", "x", "y"),
    [
        ("urn:ogc:def:crs:EPSG::4301", 139.7123917587151, 35.684658204110754),
        ("EPSG:25832", 600_000.0, 5_100_000.0),
        ("http://www.opengis.net/def/crs/EPSG/0/3857", 1_200_000.0, 5_800_000.0),
        ("http://www.opengis.net/gml/srs/epsg.xml#27700", 400_000.0, 300_000.0),
    ],
)
def test_another_crs_is_brought_to_wgs_84_as_proj_does(crs: str, x: float, y: float) -> None:
    (shape,) = shapes_of({"type": "Point", "coordinates": [x, y], "crs": named(crs)}, "It")
    code = crs.replace("#", ":").replace("/", ":").split(":")[-1]
    lon, lat = pyproj.Transformer.from_crs(f"EPSG:{code}", "EPSG:4326", always_xy=True).transform(x, y)
    (place,) = shape.lines[0]
    assert (place["lon_deg"], place["lat_deg"]) == pytest.approx((lon, lat), abs=1e-9)
    assert place["body"] == "Earth"


def test_the_tokyo_datum_lies_where_the_case_says() -> None:
    document = {"type": "Point", "coordinates": [139.7123917587151, 35.684658204110754], "crs": named("EPSG:4301")}
    (place,) = shapes_of(document, "It")[0].lines[0]
    to_utm = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32654", always_xy=True)
    assert to_utm.transform(place["lon_deg"], place["lat_deg"]) == pytest.approx((383_200.0, 3_950_100.0), abs=0.01)


@pytest.mark.parametrize(
    ("crs", "sentence"),
    [
        (named("+init=/etc/hosts:x"), "named by authority and code"),
        (named("/etc/hosts"), "named by authority and code"),
        (named("PROJCS[]"), "named by authority and code"),
        (named("EPSG:999999"), "which is not known"),
        (named("EPSG:4978"), "which is no CRS of a map"),
        (named("EPSG:5773"), "which is no CRS of a map"),
        ({"type": "link", "properties": {"href": "x"}}, "names no CRS"),
        ({"properties": {"name": "EPSG:32611"}}, "is in the CRS 'EPSG:32611'"),
        ("EPSG:4326", "names no CRS"),
    ],
)
def test_a_crs_that_cannot_be_heeded_is_refused(crs: Any, sentence: str) -> None:
    with pytest.raises(RequestError, match=sentence):
        shapes_of({**POLYGON, "crs": crs}, "It")


def test_a_crs_counts_for_the_part_that_has_it() -> None:
    there = {"type": "Point", "coordinates": [500_000.0, 0.0], "crs": named("EPSG:32632")}
    here, turned = shapes_of(collection(feature(POINT), feature(there)), "It")
    assert here.lines[0] == [{"lon_deg": 11.0, "lat_deg": 46.0}]
    assert turned.lines[0][0]["lon_deg"] == pytest.approx(9.0)


def test_the_body_is_told_by_a_member_or_a_crs() -> None:
    for moon in ({"body": "Moon"}, {"crs": named("IAU_2015:30100")}):
        (shape,) = shapes_of({**POINT, **moon}, "It")
        assert shape.lines[0][0]["body"] == "Moon"
    with pytest.raises(RequestError, match="lies on Earth, not on Moon"):
        shapes_of({**POINT, "body": "Moon", "crs": named("EPSG:4326")}, "It")


def test_coordinates_that_are_nobody_knows_what_are_refused() -> None:
    with pytest.raises(RequestError, match="'pixels', which is not understood"):
        shapes_of({**POINT, "coordinates_are": "pixels"}, "It")


def test_a_line_that_was_cut_at_180_degrees_is_one_again() -> None:
    parts = [[[179.0, 1.0], [180.0, 1.5]], [[-180.0, 1.5], [-179.0, 2.0]]]
    document = {"type": "MultiLineString", "coordinates": parts}
    assert [place["lon_deg"] for place in line_of(document, "It")] == [179.0, 180.0, -179.0]


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        (collection(feature(LINE), feature(LINE)), "several lines that do not meet"),
        (collection(feature(LINE), feature({**POINT, "coordinates": [11.05, 46.0]})), "points beside its line"),
        (collection(feature(LINE), feature(POLYGON)), "a path has no Polygon"),
        (POINT, "holds no LineString"),
    ],
)
def test_a_path_is_one_line(document: Any, sentence: str) -> None:
    with pytest.raises(RequestError, match=sentence):
        line_of(document, "It")


def test_points_at_the_corners_of_a_path_tell_nothing_more() -> None:
    document = collection(feature(LINE), *(feature({"type": "Point", "coordinates": [*at, 7.0]}) for at in RING[:3]))
    assert line_of(document, "It") == PLACES[:3]
