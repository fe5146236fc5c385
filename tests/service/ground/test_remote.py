"""Ground from a server: only the parts that an area needs, kept for later, and no trust in what the server says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from pydantic import ValidationError

from service.errors import RequestError
from service.ground.remote import ranged
from service.ground.remote.blocks import BLOCK_BYTES, BlockStore
from service.ground.remote.ranged import client_of
from service.ground.remote.windows import fetch_area, source_named
from service.settings import GroundSource, Settings
from terrain import Box, Circle, ElevationGrid, GroundSourceError, NoGroundError, read_dem, read_mosaic
from tests.service.ground.range_server import RangeServer, serving
from tests.terrain.tiles.cutting import rough

STEP = 1.0 / 1200.0
NAME = "Copernicus_DSM_COG_30_{NS}{lat:02d}_00_{EW}{lon:03d}_00_DEM"
UTM = rasterio.Affine(90, 0, 680_000, 0, -90, 4_100_000)
AREA = Circle(-84.3, 36.4, 3000.0)


def write_cell(folder: Path, west: int, south: int, **profile: Any) -> Path:
    """A cell of GLO-90 as it is published: 1200² posts in degrees, tiled and deflated, under its real name."""
    name = NAME.format(NS="N", lat=south, EW="W" if west < 0 else "E", lon=abs(west))
    path = folder / name / f"{name}.tif"
    path.parent.mkdir(parents=True)
    settings = {
        "driver": "GTiff", "height": 1200, "width": 1200, "count": 1, "dtype": "float32", "crs": "EPSG:4326",
        "tiled": True, "compress": "deflate",
        "transform": rasterio.Affine(STEP, 0, west - STEP / 2, 0, -STEP, south + 1 + STEP / 2),
    } | profile  # fmt: skip
    with rasterio.open(path, "w", **settings) as file:
        file.write(rough(1200, 1200, seed=abs(west + south))[: file.height, : file.width], 1)
        file.update_tags(AREA_OR_POINT="Point")
    return path


@pytest.fixture
def server(tmp_path: Path) -> Iterator[RangeServer]:
    write_cell(tmp_path / "www", -85, 36)
    with serving(tmp_path / "www") as server:
        yield server


@pytest.fixture(autouse=True)
def _no_long_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ranged, "PAUSE_S", 0.01)


class Fetching:
    """A source and its store; ``read`` gives the ground of an area."""

    def __init__(self, server: RangeServer, folder: Path, max_bytes: int = 1 << 30) -> None:
        self.source = GroundSource(base=server.url, scheme="copernicus-glo-90")
        self.store = BlockStore(folder / "store", max_bytes)
        self.folder, self.parts = folder, 0

    def read(self, area: Any = AREA, margin_m: float = 0.0) -> ElevationGrid:
        self.parts += 1
        parts = self.folder / f"parts{self.parts}"
        tiles = fetch_area(self.source, area, margin_m, self.store, parts, max_cells=10**7, progress=lambda share: None)
        return read_mosaic(tiles, area, margin_m=margin_m)


@pytest.fixture
def fetching(server: RangeServer, tmp_path: Path) -> Fetching:
    return Fetching(server, tmp_path)


def whole_of(server: RangeServer) -> Path:
    (path,) = server.folder.rglob("*.tif")
    return path


def test_an_area_is_read_by_parts_and_equals_the_file(server: RangeServer, fetching: Fetching) -> None:
    grid = fetching.read()
    np.testing.assert_array_equal(grid.heights_m, read_mosaic([whole_of(server)], AREA).heights_m)
    assert grid.unknown_posts == 0
    assert server.served < 0.5 * whole_of(server).stat().st_size
    assert {path for path, _ in server.asked} == {f"/{whole_of(server).parent.name}/{whole_of(server).name}"}
    assert grid.vertical_datum == "EGM2008 height"


def test_what_was_read_serves_offline_and_a_larger_area_asks_only_for_more(
    server: RangeServer, fetching: Fetching
) -> None:
    first, asked = fetching.read(), len(server.asked)
    server.how = "error"
    again = fetching.read()
    assert len(server.asked) == asked
    assert again.digest == first.digest
    server.how = "well"
    before = set(server.asked)
    fetching.read(Circle(-84.3, 36.4, 20_000.0))
    assert not before & set(server.asked[asked:]), "no block is asked for twice"


def test_over_a_border_two_files_are_one_ground(server: RangeServer, fetching: Fetching) -> None:
    write_cell(server.folder, -86, 36)
    grid = fetching.read(Box(-85.02, 36.4, -84.98, 36.43))
    assert grid.unknown_posts == 0
    assert len({path for path, _ in server.asked}) == 2


def test_where_nothing_is_there_it_says_so(fetching: Fetching) -> None:
    with pytest.raises(NoGroundError, match="has no ground in the area"):
        fetching.read(Circle(10.5, 36.4, 500.0))


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("html", "answers with a web page instead of ground"),
        ("redirect", r"redirects elsewhere \(http://example.com/elsewhere.tif\), which is not followed"),
        ("no_ranges", "gives no parts of files"),
        ("short", "after 4 tries .*bytes came where .* were promised"),
        ("error", "after 4 tries .the server answers 503"),
        ("elsewhere", "gives another part of the file than it was asked for"),
    ],
)
@pytest.mark.parametrize("good", [0, 1], ids=["at once", "midway"])
def test_a_server_that_misbehaves_is_told_in_one_sentence(
    server: RangeServer, fetching: Fetching, how: str, sentence: str, good: int
) -> None:
    server.how, server.fails_after = how, good
    with pytest.raises(GroundSourceError, match=sentence):
        fetching.read()


def test_after_a_failure_midway_it_goes_on_where_it_ended(server: RangeServer, fetching: Fetching) -> None:
    server.how, server.fails_after = "error", 2
    with pytest.raises(GroundSourceError, match="asking again goes on from there"):
        fetching.read()
    kept = set(server.asked[:2])
    server.how, server.asked = "well", []
    assert fetching.read().unknown_posts == 0
    assert not kept & set(server.asked)


def test_a_slow_server_is_given_up(server: RangeServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.ground.remote.windows.client_of", lambda: client_of(read_s=0.05))
    monkeypatch.setattr(ranged, "TRIES", 2)
    server.how = "slow"
    with pytest.raises(GroundSourceError, match=r"after 2 tries \(timed out\)"):
        Fetching(server, tmp_path).read()


def test_half_a_file_is_refused(server: RangeServer, fetching: Fetching) -> None:
    path = whole_of(server)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    with pytest.raises(GroundSourceError, match="is damaged, cut short or no GTiff raster"):
        fetching.read()


@pytest.mark.parametrize(
    ("profile", "sentence"),
    [
        ({"crs": "EPSG:32616", "transform": UTM}, "has the CRS 'WGS 84 / UTM"),
        ({"transform": rasterio.Affine(STEP, 0, 10.0, 0, -STEP, 47.0)}, "elsewhere than its name says"),
        ({"crs": None}, "has the CRS .unnamed., where its name says degrees"),
    ],
)  # fmt: skip
def test_a_file_that_is_not_where_its_name_says_is_refused(
    server: RangeServer, fetching: Fetching, profile: dict[str, Any], sentence: str
) -> None:
    whole_of(server).unlink()
    next(server.folder.iterdir()).rmdir()
    write_cell(server.folder, -85, 36, **profile)
    with pytest.raises(GroundSourceError, match=sentence):
        fetching.read()


def test_the_store_is_bounded_and_says_when_it_is_too_small(server: RangeServer, tmp_path: Path) -> None:
    with pytest.raises(GroundSourceError, match="store of remote ground is full"):
        Fetching(server, tmp_path / "tiny", max_bytes=1000).read()
    bounded = Fetching(server, tmp_path / "small", max_bytes=3 * BLOCK_BYTES)
    bounded.read(Circle(-84.5, 36.5, 30_000.0))
    kept = sum(path.stat().st_size for path in (tmp_path / "small" / "store").rglob("*.block"))
    assert 0 < kept <= 3 * BLOCK_BYTES


def test_a_damaged_block_is_asked_for_again(server: RangeServer, fetching: Fetching, tmp_path: Path) -> None:
    first = fetching.read()
    block = sorted((tmp_path / "store").rglob("*.block"))[-1]
    content = block.read_bytes()
    block.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    asked = len(server.asked)
    assert fetching.read().digest == first.digest
    assert len(server.asked) == asked + 1


def test_srtm_cells_are_read_under_their_names(tmp_path: Path) -> None:
    heights = np.round(rough(1201, 1201)).astype(">i2")
    (tmp_path / "www").mkdir()
    (tmp_path / "www" / "N36W085.hgt").write_bytes(heights.tobytes())
    with serving(tmp_path / "www") as server:
        fetching = Fetching(server, tmp_path)
        fetching.source = GroundSource(base=server.url + "/", scheme="srtm")
        grid = fetching.read()
    np.testing.assert_array_equal(grid.heights_m, read_mosaic([tmp_path / "www" / "N36W085.hgt"], AREA).heights_m)
    assert read_dem(tmp_path / "www" / "N36W085.hgt").rows > grid.rows


@pytest.mark.parametrize(
    "fields",
    [
        {"base": "file:///etc", "scheme": "srtm"},
        {"base": "http://example.com"},
        {"base": "http://example.com", "template": "http://other.example/{lat}"},
        {"base": "http://example.com", "template": "{base}/{base.__class__}"},
        {"base": "http://example.com", "scheme": "srtm", "template": "{base}/x"},
    ],
)
def test_a_source_that_makes_no_sense_is_refused_at_the_start(fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        GroundSource.model_validate(fields)


def test_only_listed_sources_can_be_named() -> None:
    settings = Settings(ground_sources={"glo-30": GroundSource(base="https://example.com", scheme="copernicus-glo-30")})
    assert (
        source_named("glo-30", settings)
        .url_of(-85, 36)
        .endswith("/Copernicus_DSM_COG_10_N36_00_W085_00_DEM/Copernicus_DSM_COG_10_N36_00_W085_00_DEM.tif")
    )
    assert source_named("glo-30", settings).url_of(151, -34).endswith("_S34_00_E151_00_DEM.tif")
    with pytest.raises(RequestError, match=r"There is no source of ground .*; the operator lists: glo-30"):
        source_named("https://evil.example", settings)
