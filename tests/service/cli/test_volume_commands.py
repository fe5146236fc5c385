"""sightline dop with a control volume: cuts as pictures, voxels as files that other programs read."""

import json
from dataclasses import replace

import numpy as np
import pytest
import rasterio
import xarray
from PIL import Image

from service.products.dop.request import DopMapParameters
from service.products.dop.volumes import check_air
from terrain import to_lon_lat
from tests.service.cli.positioning_words import ANCHORS, PLACES
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from visibility import (
    Anchor,
    VisibilityInputError,
    altitude_layers,
    anchor_above_ground,
    control_volume,
    min_visible_altitude,
)
from visibility.air import whole_volume

LINE = f"{WEST_M + 60},{NORTH_M - 320},{WEST_M + 400},{NORTH_M - 200},{WEST_M + 700},{NORTH_M - 40}"


def volume_of(layers, anchors=None, bounds_m=None):
    grid = small_grid()
    if anchors is None:
        anchors = [anchor_above_ground(grid, name, WEST_M + e, NORTH_M + n, h) for name, (e, n, h) in PLACES.items()]
    return control_volume(min_visible_altitude(grid, anchors), layers, bounds_m=bounds_m)


def test_the_files_of_a_volume_hold_what_the_library_answers(sightline, dem_file, tmp_path):
    ended = sightline(
        *("dop", dem_file, *ANCHORS, "--volume", "--ceiling", "320msl", "--floor", "20", "--layer", "25"),
        *("--out", tmp_path, "--json"),
    )
    assert ended.code == 0, ended.stderr
    volume = volume_of(altitude_layers(20.0, 320.0, 25.0))
    expected = whole_volume(volume)
    assert json.loads(ended.stdout)["volume"] == {"layers": 13, "rows": 24, "cols": 30, "voxels": 13 * 24 * 30} | {
        "lowest_layer_m": 20.0,
        "highest_layer_m": 320.0,
        "layers_above_ground": False,
    }
    with np.load(tmp_path / "volume.npz", allow_pickle=False) as arrays:
        for name in ("dop", "count", "seen", "unknown"):
            np.testing.assert_array_equal(arrays[name], getattr(expected, name))
        np.testing.assert_array_equal(arrays["layers_m"], volume.layers.altitudes_m)
        assert list(arrays["anchor_ids"]) == list(PLACES)
    with rasterio.open(tmp_path / "volume_dop.tif") as bands:
        np.testing.assert_array_equal(bands.read(), expected.dop)
        assert bands.descriptions[0] == "altitude 20 m"
        assert bands.xy(0, 0) == pytest.approx((WEST_M, NORTH_M), abs=1e-3)
    with rasterio.open(tmp_path / "volume_count.tif") as bands:
        unknown = expected.unknown_count > 0
        np.testing.assert_array_equal(bands.read(), np.where(unknown, 255, expected.count))
        assert unknown.any()
    with xarray.open_dataset(tmp_path / "volume.nc") as dataset:
        np.testing.assert_array_equal(dataset["dop"].values, expected.dop)
        np.testing.assert_array_equal(dataset["seen"].values, expected.seen)


def test_bounds_and_layers_above_ground_choose_the_voxels(sightline, dem_file, tmp_path):
    bounds_m = (WEST_M + 100.0, NORTH_M - 260.0, WEST_M + 500.0, NORTH_M - 50.0)
    ended = sightline(
        *("dop", dem_file, *ANCHORS, "--volume", "--ceiling", "60agl", "--layer", "20"),
        *("--bounds", ",".join(map(str, bounds_m)), "--out", tmp_path),
    )
    assert ended.code == 0, ended.stderr
    volume = volume_of(altitude_layers(0.0, 60.0, 20.0, above_ground=True), bounds_m=bounds_m)
    with rasterio.open(tmp_path / "volume_dop.tif") as bands:
        np.testing.assert_array_equal(bands.read(), whole_volume(volume).dop)
        assert bands.xy(0, 0) == pytest.approx((volume.grid.origin_east_m, volume.grid.origin_north_m), abs=1e-3)
        assert bands.descriptions == tuple(f"above ground {height} m" for height in (0, 20, 40, 60))


def test_more_than_64_anchors_take_a_second_word(sightline, dem_file, tmp_path):
    grid, random = small_grid(), np.random.default_rng(2)
    places = [(WEST_M + e, NORTH_M - n, 300.0 + h) for e, n, h in random.uniform(0.0, 300.0, (70, 3)).round(2).tolist()]
    names = ("id", "east_m", "north_m", "altitude_m")
    listed = [dict(zip(names, (f"A{n}", *at), strict=True)) for n, at in enumerate(places)]
    (tmp_path / "many.json").write_text(json.dumps(listed))
    ended = sightline(
        *("dop", dem_file, "--anchors", tmp_path / "many.json", "--volume", "--ceiling", "60agl", "--layer", "30"),
        *("--out", tmp_path / "out"),
    )
    assert ended.code == 0, ended.stderr
    seen = np.load(tmp_path / "out" / "volume.npz")["seen"]
    assert seen.shape[-1] == 2
    row, col = 3, 4
    heights_m = grid.heights_m[row, col] + 30.0
    lowest_m = min_visible_altitude(grid, [Anchor(f"A{n}", *at) for n, at in enumerate(places)]).altitude_m[:, row, col]
    bits = [bool(seen[1, row, col, a // 64] >> np.uint64(a % 64) & np.uint64(1)) for a in range(70)]
    assert bits == (lowest_m <= heights_m).tolist()


@pytest.mark.parametrize("more", [[], ["--ceiling", "200agl"], ["--ceiling", "500msl", "--layer", "5"]])
def test_one_cut_is_one_picture_and_no_volume_is_written(sightline, dem_file, tmp_path, more):
    ended = sightline("dop", dem_file, *ANCHORS, "--cut", LINE, "--cut", "150msl", *more, "--out", tmp_path)
    assert ended.code == 0, ended.stderr
    written = {path.name for path in tmp_path.iterdir()}
    assert {"cut-1.png", "cut-2.png"} <= written
    assert not [name for name in written if name.startswith("volume") or name == "cut-3.png"]
    for name in ("cut-1.png", "cut-2.png"):
        with Image.open(tmp_path / name) as picture:
            assert len(set(picture.convert("RGB").resize((300, 200)).get_flattened_data())) > 20


def test_a_cut_may_be_given_in_degrees(sightline, dem_file, tmp_path):
    grid = small_grid()
    words = []
    for name, (east_m, north_m, _) in PLACES.items():
        lon, lat = to_lon_lat(grid, WEST_M + east_m, NORTH_M + north_m)
        words += ["--anchor", f"{name},{lon},{lat},400msl"]
    ends = (to_lon_lat(grid, WEST_M + east_m, NORTH_M - 200.0) for east_m in (60.0, 700.0))
    line = ",".join(f"{lon},{lat}" for lon, lat in ends)
    ended = sightline("dop", dem_file, *words, "--lonlat", "--cut", line, "--out", tmp_path)
    assert ended.code == 0, ended.stderr
    assert (tmp_path / "cut-1.png").is_file()


BAD_AIR = [
    (["--volume"], "--volume, --floor, --layer and --bounds need --ceiling"),
    (["--layer", "5", "--cut", "100msl"], "--volume, --floor, --layer and --bounds need --ceiling"),
    (["--volume", "--ceiling", "high"], "--ceiling 'high' is not of the form"),
    (["--volume", "--ceiling", "-100msl"], "is below the ground, which begins at"),
    (["--volume", "--ceiling", "300msl", "--floor", "301"], "The floor at 301 m is not below the ceiling at 300 m"),
    (["--volume", "--ceiling", "300msl", "--layer", "0"], "--layer: Input should be greater than 0"),
    (["--volume", "--ceiling", "300msl", "--layer", "0.001"], "every 0.001 m are more than the limit of 100,000"),
    (["--volume", "--ceiling", "300agl", "--floor", "-5"], "Layers above ground must be >= 0 m"),
    (["--volume", "--ceiling", "300msl", "--bounds", "0,0,1"], "--bounds '0,0,1' is not of the form"),
    (["--volume", "--ceiling", "300msl", "--bounds", "0,0,1,1"], "No post lies within west 0"),
    (["--cut", "here"], "--cut 'here' is neither a line"),
    (["--cut", "1,2,3"], "--cut '1,2,3' is neither a line"),
    (["--cut", "1,2,3,4"], "cuts[0] leaves the volume at (1 m east, 2 m north)"),
    (["--cut", f"{WEST_M + 60},{NORTH_M - 60},{WEST_M + 60},{NORTH_M - 60}"], "cuts[0] is a single place"),
    (["--cut", "-5agl"], "HEIGHT: Input should be greater than or equal to 0"),
    (["--cut", "100msl"] * 9, "cuts: List should have at most 8 items"),
    (["--cut", "100msl", "--surface"], "Air has no slope"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "sentence"), BAD_AIR, ids=[line[1][:40] for line in BAD_AIR])
def test_air_that_cannot_be_is_refused_in_one_sentence(sightline, dem_file, tmp_path, words, sentence):
    ended = sightline("dop", dem_file, *ANCHORS, *words, "--out", tmp_path / "out", "--json")
    assert (ended.code, sentence in ended.stderr, ended.stderr.count("\n")) == (2, True, 1), ended.stderr
    assert not list((tmp_path / "out").glob("*"))


def test_more_layers_than_a_tiff_has_bands_are_refused(sightline, dem_file, tmp_path, monkeypatch):
    monkeypatch.setattr("service.products.dop.volume_files.MOST_BANDS", 3)
    ended = sightline(
        *("dop", dem_file, *ANCHORS, "--volume", "--ceiling", "60agl", "--layer", "20", "--out", tmp_path)
    )
    assert (ended.code, ended.stderr.count("\n")) == (2, 1)
    assert "4 layers are more than the 3 bands that a GeoTIFF holds" in ended.stderr


def test_over_unknown_ground_alone_there_is_no_air(sightline, dem_file):
    hole = f"{WEST_M + 8 * 30},{NORTH_M - 6 * 20},{WEST_M + 10 * 30},{NORTH_M - 4 * 20}"
    ended = sightline("dop", dem_file, *ANCHORS, "--volume", "--ceiling", "100msl", "--bounds", hole)
    assert (ended.code, "No ground is known" in ended.stderr, ended.stderr.count("\n")) == (2, True, 1), ended.stderr
    void = replace(small_grid(), heights_m=np.full((5, 6), np.nan, np.float32))
    asked = {"anchors": [{"id": "A", "east_m": 1.0, "north_m": 1.0, "altitude_m": 9.0}], "cuts": [{"altitude_m": 1.0}]}
    with pytest.raises(VisibilityInputError, match="No ground is known"):
        check_air(void, DopMapParameters.model_validate(asked))
