"""Layers hold what the map holds, where the map holds it, for any program that reads the format."""

import json
from dataclasses import replace

import numpy as np
import pytest
import rasterio

from service.parts.anchors import AnchorIn
from service.products.visibility import VISIBILITY_MAP
from terrain import ElevationGrid, to_grid_frame
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, COLS, HOLE, NORTH_M, ROWS, WEST_M, small_map
from visibility import HIDDEN, VISIBLE

LAYERS = VISIBILITY_MAP.layer
MILLIMETRE = 1e-3
MARS = "+proj=eqc +lat_ts=0 +lon_0=0 +R=3396190 +units=m +no_defs"


@pytest.fixture(scope="module")
def finished():
    return small_map()


@pytest.fixture
def opened(finished, tmp_path):
    datasets = []

    def write_and_open(name, of=finished):
        LAYERS[name].save(of, tmp_path / name)
        datasets.append(rasterio.open(tmp_path / name))
        return datasets[-1]

    yield write_and_open
    for dataset in datasets:
        dataset.close()


@pytest.mark.parametrize("name", ["visible.tif", "min_visible_altitude.tif", "count.tif"])
def test_a_raster_lies_where_its_posts_are_the_cell_centres(opened, name):
    dataset = opened(name)
    assert (dataset.height, dataset.width) == (ROWS, COLS)
    assert dataset.crs.to_epsg() == 32611
    west, south, east, north = dataset.bounds
    assert west == pytest.approx(WEST_M - CELL_EAST_M / 2, abs=MILLIMETRE)
    assert north == pytest.approx(NORTH_M + CELL_NORTH_M / 2, abs=MILLIMETRE)
    assert east == pytest.approx(WEST_M + (COLS - 0.5) * CELL_EAST_M, abs=MILLIMETRE)
    assert south == pytest.approx(NORTH_M - (ROWS - 0.5) * CELL_NORTH_M, abs=MILLIMETRE)
    assert dataset.xy(0, 0) == pytest.approx((WEST_M, NORTH_M), abs=MILLIMETRE)


@pytest.mark.parametrize("name", ["visible.tif", "min_visible_altitude.tif", "count.tif"])
def test_a_raster_is_a_cloud_optimised_geotiff_that_says_what_it_is(opened, finished, name):
    dataset = opened(name)
    assert dataset.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
    tags = dataset.tags()
    assert tags["mode"] == "fast"
    assert tags["version"] == finished.answer.version
    assert tags["dem_sha256"] == finished.grid.digest
    assert tags["receiver"] == "1.5 m above ground"
    assert tags["units"]


def test_visible_has_a_band_per_anchor_in_ones_zeros_and_nodata(opened, finished):
    dataset = opened("visible.tif")
    np.testing.assert_array_equal(dataset.read(), finished.visible)
    assert dataset.descriptions == ("west", "east", "outside")
    assert set(dataset.dtypes) == {"uint8"}
    assert set(dataset.nodatavals) == {255.0}
    assert set(np.unique(dataset.read(1))) == {0, 1, 255}


def test_minimum_visible_altitude_keeps_unknown_and_never_apart(opened, finished):
    dataset = opened("min_visible_altitude.tif")
    np.testing.assert_array_equal(dataset.read(), finished.altitude_m)
    assert np.isnan(dataset.nodatavals).all()
    assert set(dataset.units) == {"metre"}
    out_of_range = dataset.read(2)
    assert np.isposinf(out_of_range).any()
    assert np.isnan(dataset.read(1)[HOLE]).all()


def test_count_is_nodata_only_where_nothing_is_known(opened, finished):
    dataset = opened("count.tif")
    count, unknown = dataset.read()
    nothing_known = (finished.visible == 255).all(axis=0)
    assert nothing_known.any()
    np.testing.assert_array_equal(count == 255, nothing_known)
    np.testing.assert_array_equal(count[~nothing_known], (finished.visible == 1).sum(axis=0)[~nothing_known])
    np.testing.assert_array_equal(unknown, (finished.visible == 255).sum(axis=0))
    assert dataset.descriptions == ("visible anchors", "unknown anchors")


def test_a_local_grid_is_written_without_a_place_on_earth(opened):
    dataset = opened("visible.tif", small_map(None))
    assert dataset.crs is None
    assert dataset.xy(0, 0) == pytest.approx((WEST_M, NORTH_M), abs=MILLIMETRE)


def test_another_planet_keeps_its_radius(opened, finished):
    on_mars = replace(finished, grid=replace(finished.grid, crs=MARS))
    assert "3396190" in opened("count.tif", on_mars).crs.to_wkt()


def test_arrays_can_be_read_without_pickles(finished, tmp_path):
    LAYERS["arrays.npz"].save(finished, tmp_path / "arrays.npz")
    with np.load(tmp_path / "arrays.npz", allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["heights_m"], finished.grid.heights_m)
        np.testing.assert_array_equal(arrays["visible"], finished.visible)
        np.testing.assert_array_equal(arrays["min_visible_altitude_m"], finished.altitude_m)
        np.testing.assert_array_equal(arrays["count"], finished.count)
        assert arrays["anchor_ids"].tolist() == ["west", "east", "outside"]
        assert arrays["anchor_positions_m"][1].tolist() == [WEST_M + 750.0, NORTH_M - 200.0, 60.0]
        again = ElevationGrid(arrays["heights_m"], *arrays["cell_m"], *arrays["origin_m"], str(arrays["crs"]))
    assert again.digest == finished.grid.digest


def test_anchors_are_points_on_the_globe(finished, tmp_path):
    LAYERS["anchors.geojson"].save(finished, tmp_path / "anchors.geojson")
    collection = json.loads((tmp_path / "anchors.geojson").read_text())
    assert [feature["id"] for feature in collection["features"]] == ["west", "east", "outside"]
    for feature, anchor in zip(collection["features"], finished.anchors, strict=True):
        place = to_grid_frame(finished.grid, *feature["geometry"]["coordinates"])
        assert place == pytest.approx((anchor.east_m, anchor.north_m), abs=MILLIMETRE)
        assert feature["properties"]["altitude_m"] == anchor.altitude_m
        assert 0.0 <= feature["properties"]["visible_share"] <= 1.0
    assert collection["features"][1]["properties"]["max_range_m"] == 600.0


def test_anchors_of_a_local_grid_say_that_they_are_in_metres(tmp_path):
    LAYERS["anchors.geojson"].save(small_map(None), tmp_path / "anchors.geojson")
    collection = json.loads((tmp_path / "anchors.geojson").read_text())
    assert "metres" in collection["coordinates_are"]
    assert collection["features"][0]["geometry"]["coordinates"] == [WEST_M + 95.0, NORTH_M - 305.0]


def test_a_strange_id_survives_every_format(tmp_path, opened, finished):
    anchor_id = 'Träger "7" <b>[red]&amp;'
    odd = AnchorIn(id=anchor_id, east_m=WEST_M, north_m=NORTH_M, altitude_m=99.0)
    parameters = finished.parameters.model_copy(update={"anchors": [odd, *finished.parameters.anchors[1:]]})
    renamed = replace(
        finished, parameters=parameters, anchors=(replace(finished.anchors[0], id=anchor_id), *finished.anchors[1:])
    )
    assert opened("visible.tif", renamed).descriptions[0] == anchor_id
    for name in set(LAYERS) - {"visible.tif", "margin_db.tif"}:
        LAYERS[name].save(renamed, tmp_path / name)


def test_counts_of_many_anchors_are_written_as_wide_numbers(opened, finished):
    wide = replace(
        finished,
        anchors=finished.anchors[:1] * 300,
        count=np.full((ROWS, COLS), 299, np.uint16),
        unknown_count=np.ones((ROWS, COLS), np.uint16),
    )
    dataset = opened("count.tif", wide)
    assert set(dataset.dtypes) == {"uint16"}
    assert set(np.unique(dataset.read(1))) == {299}


def test_a_layer_that_fails_leaves_the_old_file_and_no_rest(finished, tmp_path):
    path = tmp_path / "arrays.npz"
    path.write_bytes(b"old")
    broken = replace(finished, visible=np.array([object()], dtype=object))
    with pytest.raises(ValueError, match="allow_pickle"):
        LAYERS["arrays.npz"].save(broken, path)
    assert [p.name for p in tmp_path.iterdir()] == ["arrays.npz"]
    assert path.read_bytes() == b"old"


def test_the_registry_names_files_and_says_what_they_hold():
    assert list(LAYERS) == [
        "visible.tif", "min_visible_altitude.tif", "margin_db.tif", "count.tif", "map.png", "overlay.png",
        "legend.json", "arrays.npz", "anchors.geojson", "map.kml",
    ]  # fmt: skip
    assert all(layer.name == name and layer.description.endswith(".") for name, layer in LAYERS.items())


def test_hidden_and_visible_are_what_the_engine_calls_them():
    assert (int(HIDDEN), int(VISIBLE)) == (0, 1)
