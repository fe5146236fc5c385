"""Ground for any place: from a folder of tiles to the first map, and places probed as a pointer over a map does."""

from __future__ import annotations

import os
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from unittest import mock

import httpx
import numpy as np
import rasterio

from benchmarks.report import Row, Table, duration
from benchmarks.service.over_http import wait_until_warm
from benchmarks.terrains import fractal_m
from service.cli.own_service import running_service
from service.ground.coverage import LIBRARY
from service.jobs.marker import claimed
from terrain import index_ground
from terrain.tiles.library import edited

__all__ = ["probes", "tiles_to_map"]

SECOND = 1.0 / 3600.0
WEST_DEG, NORTH_DEG, SIDE_POSTS = 9.0, 47.0, 400
TILES_NOTE = """\
400 tiles of 400² posts, 1 arc second, deflated GeoTIFFs in degrees. `sightline ground add` reads their headers; the map
is of 5 km around a place: POST /dems with the area, then POST /visibility-maps with four anchors until `visible.tif` is
there, each place a new one, on a service of its own."""
PROBES_NOTE = """\
POST /probe over the loopback interface: one place, 16 anchors, ground, slope, clearances, dilution and error. One
client asks one question after the other; then four do at once, as often as they can."""


def tiles_to_map(side: int = 20, places: int = 5) -> Table:
    """Seconds to index side² tiles, and from a place to its first map."""
    with (
        mock.patch.dict(os.environ, {"SIGHTLINE_WORKERS": "2"}),
        tempfile.TemporaryDirectory() as folder,
    ):
        tiles = Path(folder) / "tiles"
        _write_tiles(tiles, side)
        began_s = time.perf_counter()
        with edited(claimed(Path(folder) / "data") / LIBRARY) as editing:  # where the service keeps its data
            editing.library, told = index_ground(editing.library, [tiles])
        index_s = time.perf_counter() - began_s
        with running_service(Path(folder)) as client:
            wait_until_warm(client)
            maps_s = [_place_to_map_s(client, side, number) for number in range(places)]
    rows = [
        Row((f"index {told.new} tiles", duration(index_s)), "≤ 5 s", index_s <= 5.0),
        Row(("from a place to its map: first", duration(maps_s[0])), "≤ 3 s", maps_s[0] <= 3.0),
        Row(("the same, median", duration(float(np.median(maps_s)))), "≤ 3 s", float(np.median(maps_s)) <= 3.0),
    ]
    return Table("From tiles to a map", ("what", "time"), rows, TILES_NOTE)


def probes(questions: int = 400) -> Table:
    """Latency of POST /probe, and how many a second are answered."""
    with tempfile.TemporaryDirectory() as folder, running_service(Path(folder)) as client:
        wait_until_warm(client)
        dem = client.post("/dems", params={"sample": "jacksboro"}).json()
        took_s = [_probe_s(client, dem["id"], number) for number in range(questions)]
        began_s = time.perf_counter()
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda number: _probe_s(client, dem["id"], number), range(questions)))
        rate_hz = questions / (time.perf_counter() - began_s)
    median_s, slow_s = float(np.median(took_s[20:])), float(np.percentile(took_s[20:], 95))
    rows = [
        Row(("one place, 16 anchors: median", duration(median_s)), "≤ 30 ms", median_s <= 0.030),
        Row(("the same, 95 of 100 within", duration(slow_s)), "≤ 30 ms", slow_s <= 0.030),
        Row(("answers a second, four clients", f"{rate_hz:.0f}"), "≥ 200", rate_hz >= 200.0),
    ]
    return Table("Probes", ("what", "value"), rows, PROBES_NOTE)


def _write_tiles(folder: Path, side: int) -> None:
    folder.mkdir()
    heights_m = fractal_m(SIDE_POSTS).astype(np.float32)
    for row in range(side):
        for col in range(side):
            corner = rasterio.Affine(
                SECOND, 0.0, WEST_DEG + col * SIDE_POSTS * SECOND, 0.0, -SECOND, NORTH_DEG - row * SIDE_POSTS * SECOND
            )
            with rasterio.open(
                folder / f"tile_{row}_{col}.tif", "w", driver="GTiff", height=SIDE_POSTS, width=SIDE_POSTS, count=1,
                dtype="float32", crs="EPSG:4326", transform=corner, tiled=True, compress="deflate",
            ) as file:  # fmt: skip
                file.write(heights_m, 1)


def _place_to_map_s(client: httpx.Client, side: int, number: int) -> float:
    width_deg = side * SIDE_POSTS * SECOND
    lon_deg, lat_deg = WEST_DEG + width_deg * (0.3 + 0.1 * number % 0.5), NORTH_DEG - width_deg * 0.5
    anchors = [
        {
            "id": str(n),
            "lon_deg": lon_deg + 0.02 * (n % 2),
            "lat_deg": lat_deg + 0.02 * (n // 2),
            "above_ground_m": 90.0,
        }
        for n in range(4)
    ]
    began_s = time.perf_counter()
    dem = client.post("/dems", json={"area": {"lon_deg": lon_deg, "lat_deg": lat_deg, "radius_m": 5000.0}})
    dem.raise_for_status()
    body: dict[str, Any] = {"dem_id": dem.json()["id"], "anchors": anchors}
    made = client.post("/visibility-maps", json=body, headers={"Prefer": "wait=60"})
    made.raise_for_status()
    client.get(f"/visibility-maps/{made.json()['id']}/layers/visible.tif").raise_for_status()
    return time.perf_counter() - began_s


def _probe_s(client: httpx.Client, dem_id: str, number: int) -> float:
    anchors = [
        {"id": f"D{n}", "lon_deg": -84.4 + 0.07 * (n % 4), "lat_deg": 36.18 + 0.06 * (n // 4), "above_ground_m": 80.0}
        for n in range(16)
    ]
    point = {"lon_deg": -84.38 + 0.0007 * (number % 300), "lat_deg": 36.2 + 0.0006 * (number % 300)}
    began_s = time.perf_counter()
    client.post("/probe", json={"dem_id": dem_id, "points": [point], "anchors": anchors}).raise_for_status()
    return time.perf_counter() - began_s
