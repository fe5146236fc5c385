"""A file that is no DEM, or a dangerous one, is refused with one sentence that says what to do."""

from __future__ import annotations

import gzip
import io
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio.enums import ColorInterp

from terrain import (
    DemFormatError,
    DemReadError,
    DemTooLargeError,
    DemUnsupportedError,
    FrameError,
    TerrainError,
    read_dem,
)
from tests.terrain.files import hill, write_asc, write_tif

VRT = """<VRTDataset rasterXSize="10" rasterYSize="10"><VRTRasterBand dataType="Byte" band="1"><SimpleSource>
<SourceFilename>/etc/passwd</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>"""


def refused(path: Any, kind: type[TerrainError], words: str, **options: Any) -> None:
    with pytest.raises(kind, match=words) as caught:
        read_dem(path, **options)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert sentence.endswith((".", "!"))


@pytest.mark.parametrize(
    "name",
    [
        "http://example.org/dem.tif", "/vsicurl/http://example.org/dem.tif", "/vsizip/a.zip/dem.tif", "s3://bucket/dem.tif",
        "/VSIMEM/x.tif", "ftp://example.org/x.hgt", "a\0b.tif",
    ],
)  # fmt: skip
def test_urls_and_virtual_paths_are_not_files_on_this_machine(name: str) -> None:
    refused(name, DemFormatError, "is not a file on this machine")


def test_a_gdal_prefix_is_only_a_file_name() -> None:
    refused("GTIFF_DIR:1:/etc/hostname", DemReadError, "There is no DEM file")


def test_missing_files_folders_and_pipes_are_named(tmp_path: Path) -> None:
    refused(tmp_path / "none.tif", DemReadError, "There is no DEM file")
    refused(tmp_path, DemReadError, "is a folder")
    os.mkfifo(tmp_path / "pipe.tif")
    refused(tmp_path / "pipe.tif", DemReadError, "There is no DEM file")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.tif", b"", "is empty"),
        ("dem.vrt", VRT.encode(), "holds XML"),
        ("dem.tif", VRT.encode(), "holds XML"),
        ("bom.tif", b"\xef\xbb\xbf  <?xml version='1.0'?><x/>", "holds XML"),
        ("notes.tif", b"these are notes, not heights", "not a DEM in a known format"),
        ("picture.png", b"\x89PNG\r\n\x1a\n" + bytes(50), "not a DEM in a known format"),
        ("data.h5", b"\x89HDF\r\n\x1a\n" + bytes(50), "not a DEM in a known format"),
        ("list.txt", b"http://example.org/dem.tif\n", "not a DEM in a known format"),
        ("dem.tif.gz", gzip.compress(b"II*\0" + bytes(99), mtime=0), "gzip data; unpack it"),
        ("dem.7z", b"7z\xbc\xaf\x27\x1c" + bytes(50), "7-Zip data; unpack it"),
        ("dem.npz", b"PK\x03\x04" + bytes(60), "damaged zip"),
        ("N44W072.hgt", bytes(1000), "no SRTM tile"),
        ("somewhere.hgt", bytes(1201 * 1201 * 2), "tells its place by its name"),
    ],
)
def test_other_content_is_refused_whatever_its_name(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, DemFormatError, words)


def test_a_zip_with_a_dem_in_it_must_be_unpacked(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "dem.zip", "w") as archive:
        archive.write(write_tif(tmp_path / "dem.tif", hill()), "dem.tif")
    refused(tmp_path / "dem.zip", DemFormatError, "zip archive without heights_m.npy; unpack it")


@pytest.mark.parametrize("kept", [8, 200, 0.5, 0.9])
def test_a_truncated_tiff_is_damaged(tmp_path: Path, kept: float) -> None:
    rough = np.random.default_rng(1).uniform(0, 99, (200, 200)).astype("f4")
    path = write_tif(tmp_path / "dem.tif", rough, compress="deflate")
    content = path.read_bytes()
    path.write_bytes(content[: int(kept if kept > 1 else kept * len(content))])
    refused(path, DemFormatError, "damaged or cut short")


def test_a_truncated_ascii_grid_is_damaged(tmp_path: Path) -> None:
    path = write_asc(tmp_path / "dem.asc", hill(40, 40))
    text = path.read_text()
    path.write_text(text[: len(text) // 2])
    refused(path, DemFormatError, "damaged or cut short")
    path.write_text("ncols 40\nnrows 40\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2 3\n")
    refused(path, DemFormatError, "cut short: 40 × 40 heights do not fit")


def test_a_truncated_dted_is_damaged(tmp_path: Path) -> None:
    (tmp_path / "n43.dt0").write_bytes(b"UHL1" + bytes(300))
    refused(tmp_path / "n43.dt0", DemFormatError, "damaged or cut short")


def test_too_many_cells_are_refused_before_a_pixel_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(100, 200))
    monkeypatch.setattr(rasterio.io.DatasetReader, "read", lambda *_, **__: pytest.fail("pixels were read"))
    monkeypatch.setattr(rasterio.io.DatasetReader, "read_masks", lambda *_, **__: pytest.fail("pixels were read"))
    words = r"20,000 cells \(100 × 200\), more than the limit of 19,999.* GB of memory"
    with pytest.raises(DemTooLargeError, match=words) as caught:
        read_dem(path, max_cells=19_999)
    assert (caught.value.cells, caught.value.limit_cells) == (20_000, 19_999)


def sparse_tif(path: Path, side: int) -> Path:
    with rasterio.open(
        path, "w", driver="GTiff", height=side, width=side, count=1, dtype="float32", crs="EPSG:32632", sparse_ok=True,
        tiled=True, compress="deflate", bigtiff="yes", transform=rasterio.Affine(1, 0, 5e5, 0, -1, 5e6),
    ):  # fmt: skip
        pass
    return path


def test_huge_dimensions_with_tiny_data_are_refused(tmp_path: Path) -> None:
    refused(sparse_tif(tmp_path / "huge.tif", 100_000), DemTooLargeError, "10,000,000,000 cells")
    refused(sparse_tif(tmp_path / "bomb.tif", 16_000), DemFormatError, "declares 256,000,000 cells .* bytes long")


def test_a_warp_that_would_grow_past_the_limit_is_refused(tmp_path: Path) -> None:
    path = write_tif(
        tmp_path / "dem.tif", hill(60, 60), crs="EPSG:4326", transform=rasterio.Affine(0.001, 0, 11.9, 0, -0.001, 47.0)
    )
    refused(path, DemTooLargeError, "UTM zone", max_cells=3_650)


def test_an_npz_bomb_is_refused_by_its_header(tmp_path: Path) -> None:
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (16_000, 16_000)})
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("heights_m.npy", header.getvalue() + bytes(1000))
    refused(tmp_path / "bomb.npz", DemFormatError, "declares 256,000,000 cells")
    refused(tmp_path / "bomb.npz", DemTooLargeError, "more than the limit of 1,000,000", max_cells=1_000_000)
    (tmp_path / "bomb.npy").write_bytes(header.getvalue() + bytes(1000))
    refused(tmp_path / "bomb.npy", DemFormatError, "declares 256,000,000 cells", cell_m=1.0)


def test_pickles_are_not_opened(tmp_path: Path) -> None:
    np.savez(tmp_path / "dem.npz", heights_m=np.array([[{"a": 1}]], dtype=object), cell_east_m=1.0, cell_north_m=1.0)
    refused(tmp_path / "dem.npz", DemUnsupportedError, "array of real heights")
    np.savez(tmp_path / "side.npz", heights_m=hill(), cell_east_m=np.array({"a": 1}, dtype=object), cell_north_m=1.0)
    refused(tmp_path / "side.npz", DemFormatError, "damaged .npz file, or holds something other than numbers")


def test_rotated_sheared_and_mirrored_grids_are_refused(tmp_path: Path) -> None:
    rotated = rasterio.Affine(9.8, 1.7, 5e5, 1.7, -9.8, 5e6)
    refused(write_tif(tmp_path / "a.tif", hill(), transform=rotated), DemUnsupportedError, "rotated or sheared")
    sheared = rasterio.Affine(10, 2, 5e5, 0, -10, 5e6)
    refused(write_tif(tmp_path / "b.tif", hill(), transform=sheared), DemUnsupportedError, "rotated or sheared")
    mirrored = rasterio.Affine(-10, 0, 5e5, 0, -10, 5e6)
    refused(write_tif(tmp_path / "c.tif", hill(), transform=mirrored), DemUnsupportedError, "mirrored")


def test_pictures_palettes_and_complex_numbers_are_no_heights(tmp_path: Path) -> None:
    colours = np.zeros((3, 9, 9), "u1")
    refused(write_tif(tmp_path / "a.tif", colours, photometric="rgb"), DemUnsupportedError, "is a picture")
    palette = write_tif(tmp_path / "b.tif", colours[0], photometric="palette", colorinterp=[ColorInterp.palette])
    refused(palette, DemUnsupportedError, "is a picture")
    refused(write_tif(tmp_path / "c.tif", hill().astype("c8")), DemUnsupportedError, "complex numbers")


def test_a_dem_without_any_known_height_is_refused(tmp_path: Path) -> None:
    void = np.full((5, 6), -9999.0, "f4")
    refused(write_tif(tmp_path / "a.tif", void, nodata=-9999), DemUnsupportedError, "all 30 posts are void")
    refused(write_tif(tmp_path / "b.tif", void * np.nan), DemUnsupportedError, "all 30 posts are void")


def test_infinite_heights_are_refused_unless_they_are_declared_fill(tmp_path: Path) -> None:
    heights = hill()
    heights[2, 3] = np.inf
    path = write_tif(tmp_path / "dem.tif", heights)
    refused(path, DemUnsupportedError, "1 infinite heights")
    assert read_dem(path, nodata=np.inf).unknown_posts == 1


def test_a_raster_without_georeference_needs_its_cell_size(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(), crs=None, transform=None)
    refused(path, DemUnsupportedError, "no georeference.*give cell_m=")
    assert read_dem(path, cell_m=(5.0, 7.0)).cell_north_m == 7.0
    np.save(tmp_path / "dem.npy", hill())
    refused(tmp_path / "dem.npy", DemUnsupportedError, "give cell_m=")


@pytest.mark.parametrize(
    ("options", "kind", "words"),
    [
        ({"crs": "EPSG:999999"}, FrameError, "is not known; give an EPSG code"),
        ({"crs": "here"}, FrameError, "is not known; give an EPSG code"),
        ({"target_crs": "EPSG:4326"}, DemUnsupportedError, "target_crs must be a projected CRS in metres"),
        ({"target_crs": "EPSG:2253"}, DemUnsupportedError, "target_crs must be a projected CRS in metres"),
        ({"crs": "local", "target_crs": "EPSG:32632"}, DemUnsupportedError, "give crs= as well"),
        ({"crs": "EPSG:4978"}, DemUnsupportedError, "neither projected nor geographic"),
        ({"height_unit": "fathom"}, DemReadError, "height_unit must be one of m, ft, us-ft"),
        ({"cell_m": -1.0}, DemReadError, "cell_m must be a positive number"),
        ({"crs": "EPSG:2053"}, DemUnsupportedError, "run west and south"),
    ],
)  # fmt: skip
def test_options_that_cannot_be_met_are_refused(
    tmp_path: Path, options: dict[str, Any], kind: type[TerrainError], words: str
) -> None:
    refused(write_tif(tmp_path / "dem.tif", hill()), kind, words, **options)


def test_a_position_outside_its_crs_is_refused(tmp_path: Path) -> None:
    nowhere = rasterio.Affine(10, 0, 9e9, 0, -10, 9e9)
    refused(
        write_tif(tmp_path / "dem.tif", hill(), transform=nowhere), DemUnsupportedError, "does not lie where its CRS"
    )
    whole_planet = rasterio.Affine(1, 0, -180, 0, -1, 90)
    path = write_tif(tmp_path / "world.tif", hill(180, 360), crs="EPSG:4326", transform=whole_planet)
    refused(path, DemUnsupportedError, "too much of the planet")


def test_files_beside_the_dem_are_not_looked_at(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(), crs=None, transform=None)
    (tmp_path / "dem.tfw").write_text("10\n0\n0\n-10\n500000\n5000000\n")
    (tmp_path / "dem.tif.aux.xml").write_text(
        "<PAMDataset><GeoTransform>5e5,10,0,5e6,0,-10</GeoTransform><SRS>EPSG:32632</SRS></PAMDataset>"
    )
    (tmp_path / "dem.tif.ovr").write_bytes(b"II*\0")
    refused(path, DemUnsupportedError, "no georeference")
    before = sorted(tmp_path.iterdir())
    read_dem(path, cell_m=1.0)
    assert sorted(tmp_path.iterdir()) == before, "and nothing is written there"


@pytest.mark.parametrize("detail", ["cell_east_m", "crs_wkt", "provenance"])
@pytest.mark.parametrize("says", [(50_000_000,), (10**13,)], ids=["and is", "and lies"])
def test_an_npz_whose_numbers_or_texts_unpack_to_a_mass_is_not_unpacked(
    tmp_path: Path, detail: str, says: tuple[int, ...]
) -> None:
    np.savez(tmp_path / "dem.npz", heights_m=hill(), cell_north_m=10.0)
    with (
        zipfile.ZipFile(tmp_path / "dem.npz", "a", zipfile.ZIP_DEFLATED) as archive,
        archive.open(f"{detail}.npy", "w") as member,
    ):
        np.lib.format.write_array_header_1_0(member, {"descr": "|u1", "fortran_order": False, "shape": says})
        member.write(bytes(min(says[0], 50_000_000)) if says[0] < 10**9 else b"0")
    refused(tmp_path / "dem.npz", DemFormatError, f"far too much as '{detail}.npy', where one number or text belongs")


@pytest.mark.parametrize(
    ("scale", "offset"), [(float("nan"), 0.0), (float("inf"), 0.0), (0.0, 5.0), (1.0, float("nan"))]
)
def test_a_scale_that_makes_no_heights_is_named(tmp_path: Path, scale: float, offset: float) -> None:
    path = write_tif(tmp_path / "scaled.tif", hill(), scales=(scale,), offsets=(offset,))
    refused(path, DemUnsupportedError, "which makes no heights of them")


@pytest.mark.parametrize("cell", [1e-300, 5e-324, 1e-9])
def test_cells_too_small_to_be_told_apart_are_refused(tmp_path: Path, cell: float) -> None:
    path = write_tif(tmp_path / "tiny.tif", hill(), transform=rasterio.Affine(cell, 0, 500_000, 0, -cell, 5_000_000))
    refused(path, DemReadError, "cell_east_m must lie between 1e-06 and 1e.08 m")


@pytest.mark.parametrize(
    ("path", "words"),
    [("x" * 5000, "file name too long"), ("", "The path of the DEM is empty"), ("\udcff.tif", "it is not UTF-8")],
)
def test_names_that_no_file_can_have_are_told_in_a_sentence(path: str, words: str) -> None:
    refused(path, DemReadError, words)
