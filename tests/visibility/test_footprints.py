"""Footprints of buildings as OpenStreetMap's tools write them: heights, what is passed over, what is refused."""

import pytest
import shapely

from tests.visibility.meshes import level
from visibility import CoverError
from visibility.cover import Footprint, FootprintHeights, parse_footprints, standing_footprints, with_standing

SQUARE = [[140.0, -110.0], [160.0, -110.0], [160.0, -90.0], [140.0, -90.0], [140.0, -110.0]]


def collection(*features):
    return {"type": "FeatureCollection", "features": list(features)}


def feature(tags, rings=(SQUARE,), kind="Polygon", id="way/1"):
    coordinates = list(rings) if kind == "Polygon" else [list(rings)]
    return {"type": "Feature", "id": id, "properties": tags, "geometry": {"type": kind, "coordinates": coordinates}}


@pytest.mark.parametrize(
    ("tags", "height_m"),
    [
        ({"building": "yes", "height": 12}, 12.0),
        ({"building": "yes", "height": "12.5"}, 12.5),
        ({"building": "yes", "height": "12 m"}, 12.0),
        ({"height": "40 ft"}, 12.192),
        ({"building": "yes", "height": "40'6\""}, 12.3444),
        ({"building:part": "yes", "height": "9", "min_height": "3"}, 9.0),
        ({"type": "way", "tags": {"building": "yes", "height": "7"}}, 7.0),
    ],
)
def test_heights_are_read_as_openstreetmap_writes_them(tags, height_m):
    found, told = parse_footprints(collection(feature(tags)), level())
    assert found[0].height_m == pytest.approx(height_m)
    assert told == ()


def test_levels_count_only_when_they_are_asked_for():
    tags = {"building": "yes", "building:levels": "4", "building:min_level": "1"}
    with pytest.raises(CoverError, match="1 of 1 footprints have no height, the first is way/1"):
        parse_footprints(collection(feature(tags)), level())
    found, told = parse_footprints(collection(feature(tags)), level(), FootprintHeights(level_m=3.0))
    assert (found[0].height_m, found[0].min_height_m) == (12.0, 3.0)
    assert told == ("The footprints: heights told as levels, taken as 3.0 m each, as asked: 1.",)


def test_what_is_no_building_is_passed_over_and_told():
    node = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [1.0, 2.0]}}
    park = feature({"leisure": "park"})
    hall = feature({"building": "yes", "height": "5"}, kind="MultiPolygon")
    found, told = parse_footprints(collection(node, park, hall), level())
    assert len(found) == 1
    assert told == (
        "The footprints: polygons that are no buildings, passed over: 1.",
        "The footprints: features that are no polygons, passed over: 1.",
    )


def test_footprints_outside_are_left_out_and_told_and_all_outside_are_refused():
    grid = level()
    inside, far = Footprint(shapely.box(140, -110, 160, -90), 9.0), Footprint(shapely.box(9000, 0, 9010, 10), 9.0)
    assert standing_footprints(grid, [inside, far]).notes == (
        "1 of 2 footprints have no known ground under their middle and are left out.",
    )
    with pytest.raises(CoverError, match="None of 1 footprints has known ground"):
        standing_footprints(grid, [far])
    bridge = Footprint(shapely.box(140, -110, 160, -90), 9.0, 4.0)
    assert "count as solid below" in standing_footprints(grid, [bridge]).notes[0]
    warned = with_standing(grid, [standing_footprints(grid, [inside, far])])
    assert any("left out" in warning for warning in warned.provenance.warnings)


BOW_TIE = [[140.0, -110.0], [160.0, -90.0], [160.0, -110.0], [140.0, -90.0], [140.0, -110.0]]


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        (collection(feature({"building": "yes", "height": 5}, (BOW_TIE,))), "no simple polygon"),
        (collection(feature({"building": "yes", "height": 5}, ([[1.0, 2.0], [3.0, 4.0]],))), "fewer than three"),
        (collection(feature({"building": "yes", "height": "tall"})), "'tall', which is no length"),
        (collection(feature({"building": "yes", "height": -4})), "a roof is above 0 m"),
        (collection(feature({"building": "yes", "height": 4, "min_height": 6})), "above its min_height"),
        (collection(feature({"building": "no"})), "holds no footprints"),
        (collection(), "holds no footprints"),
        ([], "no GeoJSON object"),
        ({"type": "FeatureCollection"}, "without a list of features"),
        (collection({"type": "way"}), "no GeoJSON feature"),
        ({**collection(), "crs": {"type": "name", "properties": {"name": "EPSG:25832"}}}, "longitude and latitude"),
        ({**collection(), "crs": {"type": "name", "properties": None}}, "longitude and latitude"),
        (collection({"type": "Feature", "geometry": {"type": "Polygon", "coordinates": 5}}), "no list of coordinates"),
        (collection({"type": "Feature", "geometry": {"type": "MultiPolygon", "coordinates": [5]}}), "no list of rings"),
        (collection(feature({"building": "yes", "height": 5}, ([["a", "b"], [1.0, 1.0], [2.0, 3.0]],))), "no list of"),
    ],
)
def test_footprints_that_cannot_be_used_are_refused_with_a_sentence(document, sentence):
    with pytest.raises(CoverError, match=sentence):
        parse_footprints(document, level())
