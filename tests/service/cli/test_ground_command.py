"""``sightline ground``: from folders of tiles to what an area would take."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from PIL import Image

from tests.terrain.files import write_tif
from tests.terrain.tiles.cutting import cut_tif, rough

METRES = rasterio.Affine(30, 0, 700_000, 0, -30, 5_100_000)


@pytest.fixture
def tiles(tmp_path: Path) -> Path:
    cut_tif(tmp_path / "tiles", rough(120, 150), METRES, shared=True)
    fine = rasterio.Affine(5, 0, 701_000, 0, -5, 5_099_000)
    write_tif(tmp_path / "tiles" / "lidar.tif", np.ones((100, 100), "f4"), transform=fine)
    (tmp_path / "tiles" / "page.tif").write_text("<html>")
    return tmp_path / "tiles"


@pytest.fixture
def ground(sightline: Any, tiles: Path, tmp_path: Path) -> Any:
    """The command with a data folder that knows the tiles."""

    def run(command: str, *words: Any) -> Any:
        return sightline("ground", command, *words, "--data", tmp_path / "data")

    added = run("add", tiles)
    assert (added.code, added.stderr) == (0, "")
    assert "10 tiles" in " ".join(added.stdout.split())
    assert "Not taken: page.tif holds XML" in added.stdout
    return run


def test_tiles_are_added_once_and_removed(ground: Any, tiles: Path) -> None:
    again = json.loads(ground("add", "--json").stdout)
    assert (again["new"], again["unchanged"], again["tiles"]) == (0, 10, 10)
    removed = json.loads(ground("remove", tiles / "lidar.tif", "--json").stdout)
    assert removed == {"removed": 1, "tiles": 9}
    assert json.loads(ground("add", "--json").stdout)["tiles"] == 9


def test_the_list_is_a_table_a_map_and_geojson(ground: Any, tmp_path: Path) -> None:
    listed = ground("list", "--map", tmp_path / "map.png")
    assert (listed.code, listed.stderr) == (0, "")
    assert "lidar.tif" in listed.stdout
    with Image.open(tmp_path / "map.png") as picture:
        assert picture.width > 800
        assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 100
    coverage = json.loads(ground("list", "--json").stdout)
    assert len(coverage["features"]) == 10


def test_what_an_area_takes_is_told_finest_first(ground: Any) -> None:
    shown = json.loads(
        ground("show", "--area", "701000,5098500,701500,5099000", "--crs", "EPSG:32632", "--json").stdout
    )
    assert shown["layers"][0]["tiles"] == ["lidar.tif"]
    assert shown["layers"][0]["gives_share"] == pytest.approx(1.0, abs=1e-3)
    assert "gives 100 % of the area" in shown["layers"][0]["reason"]
    around = ground("show", "--around", "11.62,46.0,1km")
    assert around.code == 0
    assert "finest first" in around.stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("show",), "Say which ground: --area W,S,E,N"),
        (("show", "--around", "11.62,46.0"), "is not of the form PLACE,RADIUS"),
        (("show", "--around", "11.62,46.0,5mi"), "ends in no radius in metres or kilometres"),
        (("show", "--area", "1,2,3"), "is not of the form W,S,E,N"),
        (("show", "--area", "1,2,3,4", "--around", "1,2,3"), "Give only one of --area, --around and --polygon."),
        (("show", "--around", "3,40,1km"), "the nearest is tile_"),
        (("remove", "nowhere"), "knows no tile at"),
        (("add", "nowhere"), "There is no file or folder"),
    ],
)
def test_what_cannot_be_is_one_sentence_and_exit_code_2(ground: Any, words: tuple[str, ...], sentence: str) -> None:
    ended = ground(*words)
    assert ended.code == 2
    assert sentence in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1


def test_a_folder_of_tiles_is_a_dem_and_an_area_of_it_a_map(sightline: Any, tiles: Path, tmp_path: Path) -> None:
    (tiles / "lidar.tif").unlink()
    words = ("--anchor", "D,702000,5098000,90agl", "--mode", "exact", "--json")
    out, area = tmp_path / "whole", ("--area", "701000,5097600,703000,5098600", "--crs", "EPSG:32632")
    whole = json.loads(sightline("visibility", tiles, *words, "--out", out).stdout)
    assert whole["dem"]["name"] == "mosaic of 9 tiles"
    part = json.loads(sightline("visibility", tiles, *words, *area, "--out", tmp_path / "part").stdout)
    assert part["dem"]["rows"] * 30 == pytest.approx(1000.0, abs=61.0)
    with rasterio.open(out / "visible.tif") as of_whole, rasterio.open(tmp_path / "part" / "visible.tif") as of_part:
        window = rasterio.windows.from_bounds(*of_part.bounds, transform=of_whole.transform)
        expected = of_whole.read(window=window.round_offsets().round_lengths())
        np.testing.assert_array_equal(of_part.read(), expected)


def test_files_of_a_folder_that_cannot_be_tiles_are_told(sightline: Any, tiles: Path) -> None:
    told = json.loads(sightline("info", tiles, "--json").stdout)
    assert any("1 file cannot serve as tiles: page.tif" in warning for warning in told["warnings"]), told["warnings"]


def test_of_one_large_file_only_area_and_margin_are_read(sightline: Any, tmp_path: Path) -> None:
    heights = rough(120, 150)
    path = write_tif(tmp_path / "large.tif", heights, transform=METRES, tiled=True, blockxsize=16, blockysize=16)
    area = ("--area", "701000,5097600,703000,5098600")
    part = json.loads(sightline("info", path, *area, "--json").stdout)
    words = ("--anchor", "D,702000,5098000,90agl", "--mode", "exact", "--json", *area)
    whole = json.loads(sightline("visibility", path, *words).stdout)
    read = json.loads(sightline("visibility", path, *words, "--margin", "300").stdout)
    assert read["count_histogram"] == whole["count_histogram"], "the anchor lies in the area, so nothing else hides"
    assert read["dem"]["sha256"] == whole["dem"]["sha256"] == part["sha256"]
    assert "is for an area of" in " ".join(read["warnings"])
    refused = sightline("visibility", path, *words, "--margin", "300", "--band", "1")
    assert (refused.code, "--band is for a DEM in one file" in refused.stderr) == (2, True)


def test_the_library_is_a_dem_where_an_area_says_which(
    ground: Any, sightline: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIGHTLINE_DATA_FOLDER", str(tmp_path / "data"))
    around = ("--around", "11.62,46.0,800m", "--lonlat")
    told = json.loads(sightline("info", "@ground", *around, "--json").stdout)
    assert (told["driver"], told["cell_east_m"]) == ("mosaic", 30.0)
    seen = sightline("visibility", "@ground", "--anchor", "D,11.62,46.0,60agl", *around, "--margin", "500", "--json")
    assert seen.code == 0, seen.stderr
    missing = sightline("info", "@ground")
    assert missing.code == 2
    assert "@ground needs an area" in missing.stderr
