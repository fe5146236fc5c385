"""What a map in a browser needs of a DEM: where it lies, and its heights as bare numbers at any resolution."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest

from dem_samples import load_sample
from service.ground.levels import write_level
from tests.service.running import Server


def heights(server: Server, level: dict[str, Any]) -> np.ndarray:
    answer = server.client.get(level["href"])
    assert answer.status_code == 200, answer.text
    assert len(answer.content) == level["bytes"]
    return np.frombuffer(answer.content, "<f4").reshape(level["rows"], level["cols"])


def test_level_0_holds_the_posts_and_each_next_the_means_of_what_is_known(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    grid = load_sample("jacksboro")
    levels = server.client.get(jacksboro["links"]["levels"]).json()["levels"]
    assert [level["level"] for level in levels] == list(range(len(levels)))
    np.testing.assert_array_equal(heights(server, levels[0]), grid.heights_m)
    assert max(levels[-1]["rows"], levels[-1]["cols"]) <= 256
    first = heights(server, levels[1])
    for row, col in ((0, 0), (40, 60), (100, 10), (levels[1]["rows"] - 1, levels[1]["cols"] - 1)):
        square = grid.heights_m[2 * row : 2 * row + 2, 2 * col : 2 * col + 2]
        expected = np.nanmean(square) if not np.isnan(square).all() else np.nan
        assert first[row, col] == pytest.approx(expected, abs=1e-3, nan_ok=True)
    assert np.isnan(first).any()
    assert levels[1]["origin_east_m"] == pytest.approx(grid.origin_east_m + grid.cell_east_m / 2)
    assert levels[1]["origin_north_m"] == pytest.approx(grid.origin_north_m - grid.cell_north_m / 2)
    assert levels[1]["cell_east_m"] == 2 * grid.cell_east_m


def test_heights_are_cached_by_what_they_hold_and_come_in_parts(server: Server, jacksboro: dict[str, Any]) -> None:
    path = f"/dems/{jacksboro['id']}/heights?level=1"
    whole = server.client.get(path)
    assert server.client.get(path, headers={"If-None-Match": whole.headers["ETag"]}).status_code == 304
    part = server.client.get(path, headers={"Range": "bytes=400-799"})
    assert (part.status_code, part.content) == (206, whole.content[400:800])
    other = server.client.get(f"/dems/{jacksboro['id']}/heights")
    assert other.headers["ETag"] != whole.headers["ETag"]


@pytest.mark.parametrize(("level", "status"), [("99", 404), ("-1", 422), ("x", 422)])
def test_a_level_that_is_not_there_is_refused(
    server: Server, jacksboro: dict[str, Any], level: str, status: int
) -> None:
    answer = server.client.get(f"/dems/{jacksboro['id']}/heights", params={"level": level})
    assert answer.status_code == status
    assert answer.json()["detail"]


def test_a_level_is_the_same_however_many_rows_are_taken_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    grid = load_sample("jacksboro")
    write_level(grid, 2, tmp_path / "whole")
    monkeypatch.setattr("service.ground.levels.POSTS_AT_ONCE", 5000)
    write_level(grid, 2, tmp_path / "parts")
    assert (tmp_path / "parts").read_bytes() == (tmp_path / "whole").read_bytes()


def test_a_dem_tells_where_it_lies_in_words_that_other_programs_read(server: Server, jacksboro: dict[str, Any]) -> None:
    dem = server.client.get(f"/dems/{jacksboro['id']}").json()
    for text in (dem["crs_wkt"], dem["crs_proj"]):
        assert pyproj.CRS.from_user_input(text).to_epsg() == 32616
    a, b, c, d, e, f = dem["transform"]
    bounds = dem["bounds_of_posts_m"]
    assert (a * 0.5 + b * 0.5 + c, d * 0.5 + e * 0.5 + f) == pytest.approx((bounds["west"], bounds["north"]))
    degrees = dem["bounds_deg"]
    to_metres = pyproj.Transformer.from_crs(4326, 32616, always_xy=True)
    for lon in (degrees["west"], degrees["east"]):
        assert -84.5 < lon < -84.0
    west, _ = to_metres.transform(degrees["west"], (degrees["south"] + degrees["north"]) / 2)
    assert west <= bounds["west"] + 100.0


def test_the_moon_and_local_frames_have_what_they_have(server: Server) -> None:
    moon = server.sample("crater")
    assert moon["bounds_deg"]["south"] < -84.9
    assert "1737400" in moon["crs_proj"]
