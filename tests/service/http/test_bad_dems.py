"""Files that are no DEMs: one clear sentence each, and the service goes on."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from dem_samples import sample_path
from tests.service.running import Server

VRT = """<VRTDataset rasterXSize="2" rasterYSize="2"><VRTRasterBand dataType="Float32" band="1"><SimpleSource>
<SourceFilename relativeToVRT="0">/etc/passwd</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>"""


NORTH_UP = Affine(30.0, 0.0, 400_000.0, 0.0, -30.0, 3_800_000.0)


def geotiff(heights_m: Any, transform: Affine = NORTH_UP, crs: str = "EPSG:32611", **profile: Any) -> bytes:
    heights_m = np.asarray(heights_m, np.float32)
    rows, cols = heights_m.shape
    with rasterio.MemoryFile() as file:
        with file.open(
            driver="GTiff",
            height=rows,
            width=cols,
            count=1,
            dtype="float32",
            crs=crs,
            transform=transform,
            **profile,
        ) as raster:
            raster.write(heights_m, 1)
        return bytes(file.read())


def huge_dimensions_with_tiny_data() -> bytes:
    """A TIFF header that claims 3 000 000 x 3 000 000 cells in a few hundred bytes."""
    side = 3_000_000
    entries = [
        *((256, 4, 1, side), (257, 4, 1, side), (258, 3, 1, 32), (259, 3, 1, 1), (262, 3, 1, 1), (273, 4, 1, 8)),
        *((277, 3, 1, 1), (278, 4, 1, side), (279, 4, 1, 4), (339, 3, 1, 3)),
    ]
    directory = struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", *entry) for entry in entries)
    return b"II*\0" + struct.pack("<I", 12) + b"\0\0\0\0" + directory + b"\0\0\0\0"


def a_bomb() -> bytes:
    """Megabytes of one height, deflated to next to nothing."""
    return geotiff(np.ones((5000, 5000), np.float32), compress="deflate", tiled=True)


BAD: dict[str, tuple[str, Callable[[], bytes], str, str]] = {
    "not a raster": ("notes.tif", lambda: b"these are just words, not heights" * 20, "dem-format", "notes.tif"),
    "an empty file": ("empty.tif", lambda: b"", "request", "empty"),
    "a truncated TIFF": ("cut.tif", lambda: sample_path("jacksboro").read_bytes()[:9000], "dem-format", "cut.tif"),
    "a VRT that names another file": ("trap.vrt", VRT.encode, "dem-format", "trap.vrt"),
    "a VRT under another name": ("trap.tif", VRT.encode, "dem-format", "trap.tif"),
    "a path into GDAL's virtual file systems": (
        "/vsicurl/http://127.0.0.1/x.tif",
        lambda: b"/vsicurl/http://127.0.0.1:9/x.tif",
        "dem-format",
        "x.tif",
    ),
    "huge dimensions with tiny data": ("huge.tif", huge_dimensions_with_tiny_data, "dem-", "cells"),
    "more cells than the limit": ("bomb.tif", a_bomb, "dem-too-large", "25,000,000"),
    "a rotated transform": (
        "rotated.tif",
        lambda: geotiff(np.ones((8, 8)), Affine(30.0, 5.0, 400_000.0, 5.0, -30.0, 3_800_000.0)),
        "dem-unsupported",
        "rotated",
    ),
    "nothing but voids": ("void.tif", lambda: geotiff(np.full((8, 8), -9999.0), nodata=-9999.0), "dem-", "void.tif"),
    "a zip": ("data.zip", lambda: b"PK\x03\x04" + zlib.compress(b"x" * 999), "dem-", "data.zip"),
}


@pytest.mark.parametrize("what", BAD)
def test_is_refused_with_a_sentence_that_names_it(server: Server, what: str) -> None:
    name, content, kind, word = BAD[what]
    answer = server.client.post("/dems", files={"file": (name, content())})
    problem = answer.json()
    assert answer.status_code == 422, problem
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert problem["type"].startswith(f"/problems/{kind}")
    assert word in problem["detail"]
    assert problem["detail"].rstrip().endswith(".")
    assert "/vsi" not in problem["detail"]
    assert str(server.folder) not in answer.text
    assert server.client.get("/health").json()["status"] == "ok"


def test_infinite_heights_are_refused_or_told_never_used(server: Server) -> None:
    heights_m = np.ones((8, 8))
    heights_m[3, 4] = np.inf
    answer = server.client.post("/dems", files={"file": ("inf.tif", geotiff(heights_m))})
    if answer.status_code == 201:
        dem = answer.json()
        assert dem["unknown_posts"] == 1
        assert dem["warnings"]
        assert dem["highest_m"] == 1.0
    else:
        assert answer.status_code == 422
        assert "infinite" in answer.json()["detail"]


def test_a_too_large_dem_is_refused_with_cells_memory_and_seconds(server: Server) -> None:
    problem = server.client.post("/dems", files={"file": ("bomb.tif", a_bomb())}).json()
    assert problem["cells"] == 25_000_000
    assert problem["limit_cells"] == 2_000_000
    assert "GB of memory" in problem["detail"]
    assert " s." in problem["detail"]


def test_a_body_over_the_limit_is_refused_with_413_that_names_it(server: Server) -> None:
    too_much = b"\0" * 7_000_000
    for answer in (
        server.client.post("/dems", files={"file": ("big.tif", too_much)}),
        server.client.post("/dems", params={"filename": "big.tif"}, content=too_much),
        server.client.post("/dems", params={"filename": "big.tif"}, content=iter([too_much])),
    ):
        assert answer.status_code == 413, answer.text
        assert answer.json()["limit"] == 6_000_000
        assert "SIGHTLINE_MAX_UPLOAD_BYTES" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("query", "word"),
    [
        ({"crs": "EPSG:999999"}, "EPSG:999999"),
        ({"crs": "nonsense"}, "nonsense"),
        ({"nodata": "none"}, "nodata"),
        ({"band": "0"}, "band"),
        ({"cell_m": "-3"}, "cell_m"),
        ({"height_unit": "furlong"}, "height_unit"),
    ],
)
def test_unknown_reading_options_are_refused(server: Server, query: dict[str, str], word: str) -> None:
    answer = server.client.post("/dems", params=query, files={"file": ("flat.tif", geotiff(np.ones((4, 4))))})
    assert answer.status_code == 422
    assert word in answer.json()["detail"]


@pytest.mark.parametrize("crs", ["+init=/etc/passwd:root", "+proj=utm +zone=32 +nadgrids=/etc/passwd", "@/etc/passwd"])
def test_a_crs_that_names_a_file_of_the_machine_is_refused(server: Server, crs: str) -> None:
    answer = server.client.post("/dems", params={"crs": crs}, files={"file": ("flat.tif", geotiff(np.ones((4, 4))))})
    assert answer.status_code == 422
    assert "EPSG:32611" in answer.json()["detail"]
    assert "root:" not in answer.text


def test_what_the_warnings_recommend_can_be_asked_over_http(server: Server) -> None:
    heights_m = np.full((4, 4), 100.0)
    heights_m[1, 1] = -9999.0
    file = {"file": ("flat.tif", geotiff(heights_m))}
    assert "give nodata=nan" in server.client.post("/dems", files=file).json()["warnings"][0]
    kept = server.client.post("/dems", params={"nodata": "nan"}, files=file)
    assert kept.status_code == 201, kept.text
    assert (kept.json()["unknown_posts"], kept.json()["lowest_m"]) == (0, -9999.0)
    small = server.client.post("/dems", params={"height_unit": "cm", "band": 1}, files=file)
    assert (small.status_code, small.json()["highest_m"]) == (201, 1.0)


def test_forms_without_a_file_are_refused(server: Server) -> None:
    field = server.client.post("/dems", files={"nodata": (None, b"-9999")})
    assert field.status_code == 422
    assert "nodata" in field.json()["detail"]
    broken = server.client.post("/dems", content=b"--x\r\n", headers={"Content-Type": "multipart/form-data"})
    assert broken.status_code == 422
    assert "boundary" in broken.json()["detail"]
    cut = server.client.post(
        "/dems",
        content=b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.tif"\r\n\r\nhalf of i',
        headers={"Content-Type": "multipart/form-data; boundary=x"},
    )
    assert cut.status_code == 422
    assert "ended before" in cut.json()["detail"]


def test_an_unknown_bundled_dem_is_answered_with_those_there_are(server: Server) -> None:
    answer = server.client.post("/dems", params={"sample": "atlantis"})
    assert answer.status_code == 404
    assert "jacksboro" in answer.json()["detail"]


def test_folders_in_file_names_do_not_lead_anywhere(server: Server, tmp_path: Path) -> None:
    for name in ("../../../escape.tif", "..\\..\\escape.tif", ".hidden.tif", "a\x01b.tif", "x" * 300 + ".tif"):
        answer = server.client.post("/dems", files={"file": (name, geotiff(np.ones((4, 4))))})
        assert answer.status_code in (200, 201), answer.text
        assert "/" not in answer.json()["name"]
        assert "\\" not in answer.json()["name"]
    assert list((server.folder / "incoming").iterdir()) == []
    assert not list(server.folder.parent.rglob("escape.tif"))
