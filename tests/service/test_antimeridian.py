"""What crosses 180° is cut there (RFC 7946, 3.1.9), and covers the same ground."""

from __future__ import annotations

import json

import numpy as np
import pyproj
import pytest
import shapely
from shapely.geometry import shape

from service.files.geojson import cut, write_collection
from terrain import ElevationGrid, to_lon_lat


def polygon(*rings):
    return {"type": "Polygon", "coordinates": [[list(at) for at in ring] for ring in rings]}


def parts_within_half_a_turn(geometry) -> bool:
    return all(part.bounds[2] - part.bounds[0] < 180.0 for part in shapely.get_parts(shape(geometry)))


@pytest.mark.parametrize(
    "geometry",
    [
        polygon([(10, 0), (11, 0), (11, 1), (10, 0)]),
        {"type": "LineString", "coordinates": [[179.0, 0.0], [180.0, 0.0]]},
        {"type": "MultiLineString", "coordinates": []},
        {"type": "Point", "coordinates": [180.0, 0.0]},
    ],
)
def test_what_does_not_cross_stays_as_it_is(geometry):
    assert cut(geometry) == geometry


def test_a_line_is_cut_between_its_corners_with_its_height():
    line = {"type": "LineString", "coordinates": [[179.0, 10.0, 100.0], [-179.0, 12.0, 200.0]]}
    parts = [[[179.0, 10.0, 100.0], [180.0, 11.0, 150.0]], [[-180.0, 11.0, 150.0], [-179.0, 12.0, 200.0]]]
    assert cut(line) == {"type": "MultiLineString", "coordinates": parts}
    back = {"type": "LineString", "coordinates": line["coordinates"][::-1]}
    assert cut(back)["coordinates"] == [part[::-1] for part in reversed(parts)]


def test_a_line_is_cut_at_a_corner_on_the_border_and_as_often_as_it_crosses():
    line = {"type": "LineString", "coordinates": [[179.0, 0.0], [-180.0, 0.0], [-179.0, 0.0], [179.0, 1.0]]}
    parts = cut(line)["coordinates"]
    assert [[at[0] for at in part] for part in parts] == [[179.0, 180.0], [-180.0, -179.0, -180.0], [180.0, 179.0]]


def test_a_polygon_with_a_hole_keeps_its_area_and_winding():
    outer = [(179, 0), (-179, 0), (-179, 2), (179, 2), (179, 0)]
    hole = [(179.5, 0.5), (179.5, 1.5), (-179.5, 1.5), (-179.5, 0.5), (179.5, 0.5)]
    result = cut(polygon(outer, hole))
    assert result["type"] == "MultiPolygon"
    found = shape(result)
    assert found.is_valid
    assert found.area == pytest.approx(4.0 - 1.0)
    assert parts_within_half_a_turn(result)
    assert all(part.exterior.is_ccw for part in found.geoms)


def test_a_hole_on_one_side_stays_there():
    outer = [(179, 0), (-179, 0), (-179, 2), (179, 2), (179, 0)]
    hole = [(-179.8, 0.5), (-179.8, 1.5), (-179.2, 1.5), (-179.2, 0.5), (-179.8, 0.5)]
    found = shape(cut(polygon(outer, hole)))
    assert [len(part.interiors) for part in sorted(found.geoms, key=lambda part: part.bounds[0])] == [1, 0]


def test_a_ring_round_the_pole_has_the_pole_inside():
    around = [(lon, 80.0) for lon in (*range(-180, 180, 30), -180)]
    inner = [(lon, 85.0) for lon in (*range(150, -210, -30), 150)]
    cap = shape(cut(polygon(around)))
    assert cap.area == pytest.approx(360.0 * 10.0)
    assert cap.covers(shapely.Point(13.0, 90.0))
    assert shape(cut(polygon(around, inner))).area == pytest.approx(360.0 * 5.0)


def test_lines_of_a_dem_at_180_degrees_are_written_in_parts(tmp_path):
    grid = ElevationGrid(np.zeros((3, 3)), 100.0, 100.0, crs="EPSG:32601")
    ring_m = np.array([(-5e3, 0.0), (5e3, 0.0), (5e3, 5e3), (-5e3, 5e3), (-5e3, 0.0)])
    east_m, north_m = pyproj.Transformer.from_crs(4326, 32601, always_xy=True).transform(180.0, 51.5)
    ring = np.column_stack(to_lon_lat(grid, ring_m[:, 0] + east_m, ring_m[:, 1] + north_m)).tolist()
    features = [{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]}, "properties": {}}]
    write_collection(grid, features, tmp_path / "x.geojson")
    document = json.loads((tmp_path / "x.geojson").read_text())
    geometry = document["features"][0]["geometry"]
    assert geometry["type"] == "MultiPolygon"
    assert parts_within_half_a_turn(geometry)
    geod = pyproj.Geod(ellps="WGS84")
    area_m2 = sum(geod.geometry_area_perimeter(part)[0] for part in shape(geometry).geoms)
    assert area_m2 == pytest.approx(10e3 * 5e3, rel=0.003)  # the scale of the zone's border, squared
