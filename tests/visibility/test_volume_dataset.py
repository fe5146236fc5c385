"""A control volume as an xarray dataset: the same voxels with their coordinates."""

import numpy as np
import pyproj
import pytest
import xarray

from tests.service.small_maps import small_grid
from visibility import Anchor, altitude_layers, control_volume, min_visible_altitude
from visibility.air import volume_dataset, whole_volume

CORNERS = ((0.1, 0.2), (0.9, 0.1), (0.5, 0.9), (0.3, 0.6))


@pytest.fixture(scope="module", params=[4, 70])
def volume(request):
    grid = small_grid()
    west_m, south_m, east_m, north_m = grid.bounds_m
    random = np.random.default_rng(3)
    places = [*CORNERS, *random.uniform(0.0, 1.0, (request.param - 4, 2)).tolist()]
    anchors = [
        Anchor(f"A{n}", west_m + x * (east_m - west_m), south_m + y * (north_m - south_m), 250.0 + 3.0 * n)
        for n, (x, y) in enumerate(places)
    ]
    return control_volume(min_visible_altitude(grid, anchors), altitude_layers(0.0, 300.0, 37.5))


def test_the_dataset_holds_the_voxels_of_the_volume_however_it_is_cut(volume):
    expected = whole_volume(volume)
    dataset = volume_dataset(volume, block_voxels=2 * volume.shape[1] * volume.shape[2])
    assert len(dataset["dop"].chunks[0]) > 1
    for name in ("dop", "count", "unknown_count", "seen", "unknown"):
        assert dataset[name].dtype == getattr(expected, name).dtype
        np.testing.assert_array_equal(dataset[name].values, getattr(expected, name))
    assert dataset.sizes["word"] == (len(dataset["anchor"]) + 63) // 64


def test_coordinates_place_every_voxel(volume):
    dataset, grid = volume_dataset(volume), volume.grid
    layer, row, col = 3, 5, 7
    east_m, north_m = grid.position_of(row, col)
    by_place = dataset["dop"].sel(layer=volume.layers.altitudes_m[layer], north=north_m, east=east_m, method="nearest")
    np.testing.assert_equal(float(by_place), float(dataset["dop"][layer, row, col]))
    assert float(dataset["ground"].sel(north=north_m, east=east_m)) == grid.heights_m[row, col]
    assert pyproj.CRS.from_wkt(dataset["spatial_ref"].attrs["crs_wkt"]) == grid.crs
    assert list(dataset["anchor"].values) == [anchor.id for anchor in volume.surfaces.anchors]
    assert dataset.attrs["dilution"] == "pdop"


def test_it_comes_back_from_a_file(volume, tmp_path):
    dataset = volume_dataset(volume)
    dataset.to_netcdf(tmp_path / "volume.nc")
    with xarray.open_dataset(tmp_path / "volume.nc") as again:
        xarray.testing.assert_equal(again.drop_vars("anchor"), dataset.drop_vars("anchor").compute())
        assert list(again["anchor"].values) == list(dataset["anchor"].values)
