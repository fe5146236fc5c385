"""Whatever happens to a file's bytes, reading it ends in a grid or in one sentence, never in a crash."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import rasterio
import rasterio.shutil
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from terrain import DemFormatError, DemUnsupportedError, ElevationGrid, TerrainError, read_dem, write_npz
from tests.terrain.files import hill, write_asc, write_tif


def make_npz(path: Path) -> Path:
    write_npz(ElevationGrid(hill(), 10.0, 10.0, 5e5, 5e6, "EPSG:32632"), path)
    return path


def make_plain_npz(path: Path) -> Path:
    np.savez(path, heights_m=hill(), cell_east_m=1.0, cell_north_m=1.0, origin_east_m=5e5, crs_wkt="EPSG:32632")
    return path


def make_npy(path: Path) -> Path:
    np.save(path, hill())
    return path


def make_degrees(path: Path) -> Path:
    transform = rasterio.Affine(0.001, 0, 11.9, 0, -0.001, 47)
    return write_tif(path, hill().astype("i2"), nodata=5, crs="EPSG:4326", transform=transform)


MAKERS: dict[str, Callable[[Path], Path]] = {
    "packed.tif": lambda path: write_tif(path, np.tile(hill(), (3, 3)), compress="deflate"),
    "degrees.tif": make_degrees,
    "feet.tif": lambda path: write_tif(path, hill(), crs="EPSG:2253"),
    "text.asc": lambda path: write_asc(path, hill()),
    "own.npz": make_npz,
    "plain.npz": make_plain_npz,
    "bare.npy": make_npy,
}


# rasterio cannot decode GDAL's log lines that quote damaged bytes; it says so and goes on
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", MAKERS)
@settings(deadline=None, max_examples=40, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_ends_in_a_grid_or_in_a_sentence(name: str, tmp_path: Path, data: st.DataObject) -> None:
    whole, path = tmp_path / f"whole-{name}", tmp_path / name
    if not whole.exists():
        MAKERS[name](whole)
    content = bytearray(whole.read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        at = data.draw(st.integers(0, min(len(content), data.draw(st.sampled_from([64, 400, 10**6]))) - 1))
        what = data.draw(st.sampled_from(["change", "change", "insert", "remove", "cut"]))
        some = data.draw(st.binary(min_size=1, max_size=8))
        if what == "change":
            content[at] = some[0]
        elif what == "insert":
            content[at:at] = some
        elif what == "remove":
            del content[at : at + some[0]]
        else:
            del content[at:]
        content = content or bytearray(b"x")
    path.write_bytes(content)
    cell_m = 1.0 if name == "bare.npy" else None
    try:
        grid = read_dem(path, cell_m=cell_m, max_cells=1_000_000)
    except TerrainError as error:
        sentence = str(error)
    else:
        sentence = "A grid."
        assert np.isfinite(grid.heights_m).any()
    assert "\n" not in sentence
    assert sentence.endswith(".")
    assert read_dem(whole, cell_m=cell_m).shape in (hill().shape, (36, 45)), "the next file does not suffer"


def test_a_dted_whose_checksums_do_not_hold_is_damaged(tmp_path: Path) -> None:
    tile = write_tif(
        tmp_path / "tile.tif", np.tile(hill(11, 11), (11, 11)).astype("i2"), crs="EPSG:4326",
        transform=rasterio.Affine(1 / 120, 0, 7 - 1 / 240, 0, -1 / 120, 47 + 1 / 240),
    )  # fmt: skip
    path = tmp_path / "n46.dt0"
    rasterio.shutil.copy(tile, path, driver="DTED")
    assert read_dem(path).provenance.driver == "DTED"
    content = bytearray(path.read_bytes())
    content[3428 + 12 + 7] ^= 0x10  # a height of the first profile, behind the headers of MIL-PRF-89020B
    path.write_bytes(content)
    with pytest.raises(DemFormatError, match="damaged or cut short"):
        read_dem(path)


def test_a_text_that_is_not_utf8_is_shown(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(), units=("Klafter XX N.N.",))
    path.write_bytes(path.read_bytes().replace(b"XX", b"\xfcb"))
    with pytest.raises(DemUnsupportedError, match=r"The height unit 'Klafter üb N.N.' is not known; give height_unit="):
        read_dem(path)
    assert read_dem(path, height_unit="m").shape == hill().shape
    two = write_tif(tmp_path / "two.tif", np.stack([hill(), hill()]), units=("Meter XX N.N.", "m"))
    two.write_bytes(two.read_bytes().replace(b"XX", b"\xfcb"))
    with pytest.raises(DemFormatError, match=r"its text 'Meter üb N.N.' is not UTF-8; write it anew"):
        read_dem(two)
    hall = write_tif(tmp_path / "crs.tif", hill(), crs='LOCAL_CS["XX hall",UNIT["metre",1]]')
    hall.write_bytes(hall.read_bytes().replace(b"XX", b"\xfcb"))
    with pytest.raises(DemFormatError, match=r"üb hall.* is not UTF-8"):
        read_dem(hall)
