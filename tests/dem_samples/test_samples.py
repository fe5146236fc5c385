"""The bundled DEMs are whole, small, what their manifest says, and can be made again."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import dem_samples
from dem_samples import catalog, load_sample, make, sample_manifest, sample_names, sample_path
from terrain import SampleError, body_of, read_dem, to_lon_lat

FOLDER = Path(dem_samples.__file__).parent


def test_one_real_dem_and_two_made_up_ones() -> None:
    assert sample_names() == ("crater", "jacksboro", "valley")
    assert [sample_manifest(name)["kind"] for name in sample_names()] == ["synthetic", "real", "synthetic"]


@pytest.mark.parametrize("name", sample_names())
def test_checksum_size_licence_and_source_are_as_the_manifest_says(name: str) -> None:
    entry = sample_manifest(name)
    assert hashlib.sha256((FOLDER / str(entry["file"])).read_bytes()).hexdigest() == entry["sha256"]
    assert sample_path(name) == sample_path(str(entry["file"])) == FOLDER / str(entry["file"])
    assert all(str(entry[key]) for key in ("title", "source", "licence", "shows"))
    assert str(entry["file"]) in (FOLDER / "LICENSES.md").read_text(encoding="utf-8")
    with np.errstate(all="raise"):
        assert load_sample(name).unknown_posts < load_sample(name).heights_m.size / 10


def test_all_together_they_stay_below_a_megabyte() -> None:
    assert sum(path.stat().st_size for path in FOLDER.iterdir() if path.is_file()) < 1_000_000


def test_making_them_again_gives_the_same_ground(tmp_path: Path) -> None:
    make.make_all(tmp_path)
    again = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))
    assert sorted(again) == list(sample_names())
    for name in sample_names():
        assert read_dem(tmp_path / again[name]["file"]).digest == load_sample(name).digest
        assert (again[name]["rows"], again[name]["cols"]) == (
            sample_manifest(name)["rows"],
            sample_manifest(name)["cols"],
        )


def test_the_highest_post_of_jacksboro_is_cross_mountain() -> None:
    # Cross Mountain, Tennessee: 36.1983° N 84.2306° W, 1077 m
    grid = load_sample("jacksboro")
    row, col = np.unravel_index(np.nanargmax(grid.heights_m), grid.shape)
    assert to_lon_lat(grid, *grid.position_of(float(row), float(col))) == pytest.approx((-84.2306, 36.1983), abs=0.0006)
    assert float(np.nanmax(grid.heights_m)) == pytest.approx(1077.0, abs=10.0)
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 32616


def test_the_crater_is_on_the_moon_scaled_and_partly_unknown() -> None:
    grid = load_sample("crater")
    assert grid.crs is not None
    assert body_of(grid.crs).name == "Moon"
    assert grid.cell_east_m != grid.cell_north_m
    assert grid.unknown_posts > 0
    assert grid.provenance.warnings == ()


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(SampleError, match="no bundled DEM 'everest'; there are crater, jacksboro, valley"):
        sample_path("everest")
    with pytest.raises(SampleError, match="no bundled DEM"):
        sample_path("../../etc/jacksboro")


def test_damage_is_found_before_the_file_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "valley.npz").write_bytes((FOLDER / "valley.npz").read_bytes()[:-1])
    monkeypatch.setattr(catalog, "_FOLDER", tmp_path)
    with pytest.raises(SampleError, match=r"valley\.npz is damaged: its checksum"):
        sample_path("valley")
    with pytest.raises(SampleError, match=r"crater\.tif is missing"):
        sample_path("crater")
