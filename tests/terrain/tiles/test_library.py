"""The index of tiles: made of headers, renewed where files changed, told apart by who edits it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import DemReadError, read_mosaic
from terrain.tiles import library as libraries
from terrain.tiles.library import GroundLibrary, edited, index_ground, read_library, without
from tests.terrain.files import hill, write_asc, write_tif
from tests.terrain.tiles.cutting import cut_tif, write_hgt

METRES = rasterio.Affine(10, 0, 500_000, 0, -10, 5_000_000)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Nine tiles, an SRTM tile, one that has no CRS, one that is no DEM, and a text that nobody looks at."""
    (tmp_path / "tiles").mkdir()
    cut_tif(tmp_path / "tiles" / "cut", hill(30, 30), METRES, shared=False)
    write_hgt(tmp_path / "tiles" / "srtm", np.ones((1201, 1201), np.int16), 9, 45)
    write_asc(tmp_path / "tiles" / "local.asc", hill())
    (tmp_path / "tiles" / "page.tif").write_text("<html>")
    (tmp_path / "tiles" / "README.txt").write_text("about these tiles")
    return tmp_path / "tiles"


def test_a_folder_is_indexed_with_all_that_can_be_read_and_told_why_the_rest_cannot(folder: Path) -> None:
    library, told = index_ground(GroundLibrary(), [folder])
    assert (told.new, told.changed, told.unchanged, told.gone) == (10, 0, 0, 0)
    assert [Path(one.path).name for one in told.skipped] == ["local.asc", "page.tif"]
    assert "has no CRS, so nothing tells where it lies" in told.skipped[0].why
    assert "holds XML" in told.skipped[1].why
    assert {tile.driver for tile in library.tiles} == {"GTiff", "SRTMHGT"}


def test_only_headers_of_new_and_changed_files_are_read_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library, _ = index_ground(GroundLibrary(), [folder])
    read = list[str]()

    def counted(path: str) -> object:
        read.append(Path(path).name)
        return original(path)

    original = libraries.read_tile
    monkeypatch.setattr(libraries, "read_tile", counted)
    again, told = index_ground(library)
    assert (again, read) == (library, [])
    assert told.unchanged == 10
    write_tif(folder / "cut" / "tile_0_0.tif", hill(11, 11) + 1.0, transform=METRES)
    write_tif(folder / "new.tif", hill())
    sorted((folder / "cut").iterdir())[-1].unlink()
    changed, told = index_ground(library)
    assert sorted(read) == ["new.tif", "tile_0_0.tif"]
    assert (told.new, told.changed, told.unchanged, told.gone) == (1, 1, 8, 1)
    assert len(changed.tiles) == 10


def test_a_library_is_kept_and_read_back(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "ground.json"
    assert read_library(path) == GroundLibrary()
    with edited(path) as editing:
        editing.library, _ = index_ground(editing.library, [folder])
        kept = editing.library
    assert read_library(path) == kept
    grid = read_mosaic([tile for tile in read_library(path).tiles if tile.driver == "GTiff"])
    np.testing.assert_array_equal(grid.heights_m, hill(30, 30))


def test_an_edit_that_fails_leaves_the_library_as_it_was(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "ground.json"
    with pytest.raises(DemReadError, match="There is no file or folder"), edited(path) as editing:
        editing.library, _ = index_ground(editing.library, [folder, tmp_path / "nowhere"])
    assert not path.exists()


def test_what_is_removed_does_not_come_back_until_it_is_added(folder: Path) -> None:
    library, _ = index_ground(GroundLibrary(), [folder])
    fewer, removed = without(library, [folder / "cut"])
    assert removed == 9
    again, told = index_ground(fewer)
    assert len(again.tiles) == 1
    assert told.new == 0
    back, told = index_ground(again, [folder / "cut"])
    assert told.new == 9
    empty, removed = without(back, [folder])
    assert (removed, empty.tiles, empty.sources) == (10, (), ())
    with pytest.raises(DemReadError, match="knows no tile at"):
        without(empty, [folder])


def test_a_damaged_library_says_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "ground.json"
    for text in ("{", "[]", '{"layout": 1}'):
        path.write_text(text)
        with pytest.raises(DemReadError, match=r"ground\.json is damaged; delete it"):
            read_library(path)
    path.write_text('{"layout": 99}')
    with pytest.raises(DemReadError, match="by another release"):
        read_library(path)


def test_links_are_followed_to_the_file_once(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(folder)
    library, told = index_ground(GroundLibrary(), [folder, tmp_path / "link"])
    assert told.new == 10
    assert len({os.path.realpath(tile.path) for tile in library.tiles}) == 10
