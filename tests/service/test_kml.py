"""KML: where things lie is told in degrees, and how high as KML means it, above the EGM96 geoid."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely
from fastkml.kml import KML, Folder, Placemark
from fastkml.validator import validate

from service.files.kml import Mark, anchor_mark, write_kml
from service.products.visibility import VISIBILITY_MAP
from terrain import ElevationGrid, VerticalDatumError, egm96_height_m
from tests.service.small_maps import small_map

EAST_M, NORTH_M = 500_300.0, 5_099_800.0


def grid_of(datum: str | None, crs: str = "EPSG:32632", east_m: float = 500_000.0) -> ElevationGrid:
    heights_m = np.full((40, 50), 700.0, np.float32)
    return ElevationGrid(heights_m, 30.0, 30.0, east_m, 5_100_000.0, crs, vertical_datum=datum)


def written(grid: ElevationGrid, marks: list[Mark], path: Path) -> tuple[str, list[Placemark]]:
    """(what the document tells, its placemarks), held against the schema of the OGC."""
    file = path / "some.kml"
    write_kml(grid, "some", {"all": marks, "none": []}, file)
    read = KML.from_string(file.read_bytes())
    assert validate(element=read.etree_element())
    (document,) = read.features
    (folder,) = document.features
    assert isinstance(folder, Folder)
    return document.description, list(folder.features)


def test_a_place_is_in_degrees_and_above_egm96(tmp_path: Path) -> None:
    grid = grid_of("ellipsoid of WGS 84")
    told, (mark,) = written(
        grid, [anchor_mark(grid, "D1", (EAST_M, NORTH_M, 900.0), 200.0, {"what": "drone"})], tmp_path
    )
    lon_deg, lat_deg = pyproj.Transformer.from_crs(32632, 4326, always_xy=True).transform(EAST_M, NORTH_M)
    lon, lat, up_m = mark.geometry.coords[0]
    assert (lon, lat) == pytest.approx((lon_deg, lat_deg), abs=2e-8)
    assert up_m == pytest.approx(900.0 - float(egm96_height_m(lon_deg, lat_deg)), abs=0.01)
    assert mark.kml_geometry.altitude_mode.value == "absolute"
    assert "above EGM96" in told
    assert {data.name: data.value for data in mark.extended_data.elements} == {"id": "D1", "what": "drone"}


@pytest.mark.parametrize("datum", ["mean sea level", "EGM96 geoid"])
def test_altitudes_above_the_sea_stay_as_they_are(datum: str, tmp_path: Path) -> None:
    grid = grid_of(datum)
    line = shapely.LineString([(EAST_M, NORTH_M, 800.0), (EAST_M + 90.0, NORTH_M, 812.5)])
    _, (mark,) = written(grid, [Mark("way", line, "altitude")], tmp_path)
    assert [place[2] for place in mark.geometry.coords] == [800.0, 812.5]


def test_a_levelling_datum_without_its_model_is_taken_as_it_is_and_told(tmp_path: Path) -> None:
    grid = grid_of("NAVD88 height")
    told, (mark,) = written(grid, [Mark("way", shapely.Point(EAST_M, NORTH_M, 800.0), "altitude")], tmp_path)
    if "as they are" not in told:
        pytest.skip("PROJ has the grids of NAVD88 here")
    assert mark.geometry.coords[0][2] == 800.0
    assert "NAVD88" in told


def test_without_a_datum_anchors_stand_above_the_ground(tmp_path: Path) -> None:
    grid = grid_of(None)
    marks = [
        anchor_mark(grid, "over ground", (EAST_M, NORTH_M, 780.0), 80.0, {}),
        anchor_mark(grid, "over nothing known", (EAST_M, NORTH_M, 780.0), None, {}),
    ]
    _, (one, other) = written(grid, marks, tmp_path)
    assert one.kml_geometry.altitude_mode.value == "relativeToGround"
    assert one.geometry.coords[0][2] == 80.0
    assert other.kml_geometry.altitude_mode.value == "clampToGround"
    assert len(other.geometry.coords[0]) == 2
    with pytest.raises(VerticalDatumError, match="read it with vertical_datum"):
        write_kml(grid, "x", {"a": [Mark("a", shapely.Point(EAST_M, NORTH_M, 1.0), "altitude")]}, tmp_path / "x.kml")


def test_a_line_on_the_ground_follows_it_and_is_cut_at_180_degrees(tmp_path: Path) -> None:
    there = pyproj.Transformer.from_crs(4326, 32701, always_xy=True).transform(-179.9995, -16.0)
    heights_m = np.full((10, 30), 5.0, np.float32)
    grid = ElevationGrid(heights_m, 30.0, 30.0, there[0] - 300.0, there[1] + 100.0, "EPSG:32701")
    west, east = (there[0] - 200.0, there[1]), (there[0] + 200.0, there[1])
    _, (mark,) = written(grid, [Mark("way", shapely.LineString([west, east]))], tmp_path)
    parts = list(mark.geometry.geoms)
    assert len(parts) == 2
    assert sorted(abs(parts[n].coords[m][0]) == 180.0 for n, m in ((0, -1), (1, 0))) == [True, True]
    assert all(part.tessellate for part in mark.kml_geometry.kml_geometries)


def test_a_visibility_map_shows_anchors_and_what_each_sees(tmp_path: Path) -> None:
    found = small_map()
    grid = replace(found.grid, vertical_datum="EGM96 geoid")
    file = tmp_path / "map.kml"
    VISIBILITY_MAP.layer["map.kml"].write(replace(found, grid=grid), file)
    anchors, seen = KML.from_string(file.read_bytes()).features[0].features
    assert [mark.name for mark in anchors.features] == [anchor.id for anchor in found.anchors]
    geod = pyproj.Geod(ellps="WGS84")
    for mark in seen.features:
        number = next(n for n, anchor in enumerate(found.anchors) if mark.name == f"in sight of {anchor.id}")
        geometry = shapely.from_wkt(mark.geometry.wkt)
        posts = np.count_nonzero(found.visible[number] == 1)
        # half cells at the borders of the map are beyond its posts, and UTM's scale is not quite 1
        area_m2 = abs(geod.geometry_area_perimeter(geometry)[0])
        assert area_m2 == pytest.approx(posts * grid.cell_east_m * grid.cell_north_m, rel=0.02)
    assert len(seen.features) >= 2


def test_ids_of_strangers_do_no_harm(tmp_path: Path) -> None:
    grid = grid_of("EGM96 geoid")
    name = "<b>&amp;]]></name><script>"
    _, (mark,) = written(grid, [anchor_mark(grid, name, (EAST_M, NORTH_M, 800.0), 100.0, {})], tmp_path)
    assert mark.name == name
