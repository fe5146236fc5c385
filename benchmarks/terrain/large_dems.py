"""Maps over a DEM of 40,000² posts by windows, each in a process of its own: time, memory, the answer on a sample."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
import rasterio.shutil
from rasterio import Affine
from rasterio.windows import Window

from benchmarks.memory import peak_bytes
from benchmarks.report import Row, Table, duration
from benchmarks.terrains import fractal_m
from service.products import Work
from service.products.visibility.calculate import calculate_visibility_map
from service.products.visibility.files import LAYERS
from service.products.visibility.request import VisibilityMapParameters
from service.products.windows.calculate import make_large_map
from service.products.windows.files import COUNT, LOWEST
from terrain import open_dem

__all__ = ["by_windows", "write_sparse_cog"]

ROOT = Path(__file__).parents[2]
POSTS, CELL_M, WEST_M, NORTH_M = 40_000, 1.0, 400_000.0, 4_000_000.0
TILE = 4096
TIMES_IN_MEMORY, MOST_BYTES = 1.3, 2 << 30
WINDOW_S, WINDOW_BYTES = 2.0, 600e6
NOTE = """\
A COG of 40,000² float32 posts, 1 m apart: one fractal of 4,096² over and over, where anchors reach; blocks elsewhere
are not in the file. Anchors 30 m above ground, receivers 1.5 m, fast mode, both files written as COGs. "In memory" is
what `sightline visibility` does, reading, sight lines, count.tif and min_visible_altitude.tif, for one anchor over the
square of its reach, per post; its file is a window cut out of the same COG. Memory is the process's highest, on the
cluster without its workers'."""


def by_windows(posts: int = POSTS, range_m: float = 4000.0, anchors: int = 12) -> Table:
    """A window of a quarter of the side with 4 anchors, the whole with more, and one anchor in memory."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        asked = {"all": _spread(posts, anchors, range_m), "few": _spread(posts // 4, 4, range_m / 2.0)}
        cog = write_sparse_cog(folder / "large.tif", posts, [one for some in asked.values() for one in some])
        few, whole = (_measured(cog, asked[which]) for which in ("few", "all"))
        memory = _measured_in_memory(cog, asked["all"][0], folder)
        cluster = _run("cluster", str(cog), json.dumps(asked["all"]))
        per_post_s = memory["seconds"] / memory["posts"]
        allowed_s = TIMES_IN_MEMORY * whole["posts"] * per_post_s
        side_km = posts / 4 * CELL_M / 1000.0
    rows = [
        Row(
            (f"{side_km:g} km of it, 4 anchors of {range_m / 2000.0:g} km", *_cells(few)),
            f"≤ {WINDOW_S:g} s, ≤ {WINDOW_BYTES / 1e6:.0f} MB",
            few["seconds"] <= WINDOW_S and few["bytes"] <= WINDOW_BYTES,
        ),
        Row((f"one anchor of {range_m / 1000.0:g} km, in memory", *_cells(memory))),
        Row(
            (f"all of it, {anchors} anchors of {range_m / 1000.0:g} km", *_cells(whole)),
            f"≤ {duration(allowed_s)} ({TIMES_IN_MEMORY:g} × in memory), ≤ 2 GiB",
            whole["seconds"] <= allowed_s and whole["bytes"] <= MOST_BYTES,
        ),
        Row(
            ("the same answer as in memory, first anchor", "", "", f"{memory['differ']:,} posts differ"),
            "0",
            memory["differ"] == 0,
        ),
        Row(
            ("all of it by two workers of a Dask cluster, one killed midway", *_cells(cluster)),
            "the same bytes as by windows",
            cluster["digests"] == whole["digests"],
        ),
    ]
    return Table("Maps larger than memory", ("what", "posts in reach", "time", "memory"), rows, NOTE)


def write_sparse_cog(path: Path, posts: int, anchors: list[dict[str, Any]]) -> Path:
    """A COG of the fractal in the squares that anchors reach; nothing elsewhere."""
    tile_m = fractal_m(TILE).astype(np.float32)
    profile = {
        "driver": "GTiff", "height": posts, "width": posts, "count": 1, "dtype": "float32", "nodata": -9999.0,
        "crs": "EPSG:32611", "transform": Affine(CELL_M, 0.0, WEST_M, 0.0, -CELL_M, NORTH_M),
        "tiled": True, "blockxsize": 512, "blockysize": 512, "sparse_ok": True, "bigtiff": "YES",
        "compress": "ZSTD", "zstd_level": 1, "num_threads": "ALL_CPUS",
    }  # fmt: skip
    tiles = set()
    for one in anchors:
        row, col, reach = NORTH_M - one["north_m"], one["east_m"] - WEST_M, one["max_range_m"] + 4.0
        tiles |= {
            (r, c)
            for r in range(int(max(row - reach, 0) // TILE), int(min(row + reach, posts - 1) // TILE) + 1)
            for c in range(int(max(col - reach, 0) // TILE), int(min(col + reach, posts - 1) // TILE) + 1)
        }
    plain = path.with_suffix(".plain.tif")
    with rasterio.Env(GDAL_CACHEMAX=128):
        with rasterio.open(plain, "w", **profile) as file:
            for r, c in sorted(tiles):
                rows, cols = min(TILE, posts - r * TILE), min(TILE, posts - c * TILE)
                file.write(tile_m[:rows, :cols], 1, window=Window(c * TILE, r * TILE, cols, rows))
        options = {"compress": "ZSTD", "level": "1", "sparse_ok": "YES", "num_threads": "ALL_CPUS", "bigtiff": "YES"}
        rasterio.shutil.copy(plain, path, driver="COG", overview_resampling="NEAREST", **options)
    plain.unlink()
    return path


def _spread(side: int, count: int, range_m: float) -> list[dict[str, Any]]:
    """Anchors in rows and columns over a square of posts, as requests have them."""
    rows = max(1, round(count**0.5))
    cols = -(-count // rows)
    places = [((i // cols + 0.5) / rows, (i % cols + 0.5) / cols) for i in range(count)]
    return [
        {
            "id": f"D{number}",
            "east_m": WEST_M + round(x * side) * CELL_M + 0.5,
            "north_m": NORTH_M - round(y * side) * CELL_M - 0.5,
            "above_ground_m": 30.0,
            "max_range_m": range_m,
        }
        for number, (y, x) in enumerate(places, 1)
    ]


def _cells(measured: dict[str, Any]) -> tuple[str, ...]:
    return (
        f"{measured['posts'] / 1e6:,.0f} million",
        duration(measured["seconds"]),
        f"{measured['bytes'] / 1e6:,.0f} MB",
    )


def _measured(cog: Path, anchors: list[dict[str, Any]]) -> dict[str, Any]:
    return _run("windows", str(cog), json.dumps(anchors))


def _measured_in_memory(cog: Path, anchor: dict[str, Any], folder: Path) -> dict[str, Any]:
    """One anchor over the square of its reach, cut out of the COG; and how many of its posts windows say otherwise."""
    from terrain.files.large_dem import LargeDem
    from visibility import Anchor, AntennaLimits
    from visibility.sight.in_reach import reach_of

    dem: LargeDem = open_dem(cog)
    at = Anchor("A", anchor["east_m"], anchor["north_m"], 0.0, limits=AntennaLimits(max_range_m=anchor["max_range_m"]))
    reach = reach_of(dem, at)
    assert reach is not None, "anchors are spread over the DEM"
    part = Window(reach.first_col, reach.first_row, reach.shape[1], reach.shape[0])
    cut = folder / "cut.tif"
    with rasterio.open(cog) as source:
        profile = source.profile | {
            "driver": "COG", "height": part.height, "width": part.width, "transform": source.window_transform(part),
        }  # fmt: skip
        heights_m = source.read(1, window=part)
    for unwanted in ("tiled", "blockxsize", "blockysize", "interleave", "sparse_ok", "zstd_level"):
        profile.pop(unwanted, None)
    with rasterio.open(cut, "w", **profile) as target:
        target.write(heights_m, 1)
    return _run("memory", str(cut), json.dumps([anchor]))


def _run(*words: str) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.terrain.large_dems", *words]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    measured: dict[str, Any] = json.loads(answer.stdout)
    return measured


def _parameters(anchors: str) -> VisibilityMapParameters:
    return VisibilityMapParameters.model_validate({"anchors": json.loads(anchors), "receiver_above_ground_m": 1.5})


def _windows(path: str, anchors: str, out: Path) -> dict[str, Any]:
    begin_s = time.perf_counter()
    answer = make_large_map(open_dem(path), _parameters(anchors), out)
    seconds = time.perf_counter() - begin_s
    return {"seconds": seconds, "posts": answer.posts_in_reach, "bytes": peak_bytes(), "digests": _digests(out)}


def _in_memory(path: str, anchors: str, out: Path) -> dict[str, Any]:
    from terrain import read_dem

    begin_s = time.perf_counter()
    finished = calculate_visibility_map(read_dem(path), _parameters(anchors))
    for layer in LAYERS:
        if layer.name in (COUNT, LOWEST):
            layer.save(finished, out / f"memory-{layer.name}")
    seconds, peak = time.perf_counter() - begin_s, peak_bytes()
    answer = make_large_map(open_dem(path), _parameters(anchors), out)
    with rasterio.open(out / COUNT) as file:
        visible = file.read(1)
    within = visible != 255
    assert visible.shape == finished.count.shape, "the cut is the square of the reach"
    differ = int(np.count_nonzero(visible[within] != finished.count[within]))
    return {"seconds": seconds, "posts": answer.posts_in_reach, "bytes": peak, "differ": differ}


def _on_a_cluster(path: str, anchors: str, out: Path) -> dict[str, Any]:
    """The same by two workers, one of which is killed when the first anchor is done."""
    from distributed import Client, LocalCluster

    killed: list[int] = []
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster, set_as_default=False) as client,
    ):

        def kill_one(share: float) -> None:
            if not killed:
                killed.append(next(iter(client.run(os.getpid).values())))
                os.kill(killed[0], signal.SIGKILL)

        work = Work(progress=kill_one, scheduler=cluster.scheduler_address)
        begin_s = time.perf_counter()
        answer = make_large_map(open_dem(path), _parameters(anchors), out, work)
        seconds = time.perf_counter() - begin_s
    assert len(killed) == 1, "the first anchor was heard of"
    return {"seconds": seconds, "posts": answer.posts_in_reach, "bytes": peak_bytes(), "digests": _digests(out)}


def _digests(out: Path) -> list[str]:
    """SHA-256 of both files."""
    digests = []
    for name in (COUNT, LOWEST):
        with (out / name).open("rb") as file:
            digests.append(hashlib.file_digest(file, "sha256").hexdigest())
    return digests


def _warm() -> None:
    """Kernels into memory, by a tiny map."""
    from terrain import ElevationGrid

    grid = ElevationGrid(np.add.outer(np.arange(64.0), np.arange(64.0)).astype(np.float32), 1.0, 1.0)
    small = {"id": "A", "east_m": 30.0, "north_m": -30.0, "above_ground_m": 3.0, "max_range_m": 20.0}
    calculate_visibility_map(grid, _parameters(json.dumps([small])))


if __name__ == "__main__":
    _warm()
    with tempfile.TemporaryDirectory() as place:
        call = {"windows": _windows, "memory": _in_memory, "cluster": _on_a_cluster}[sys.argv[1]]
        print(json.dumps(call(sys.argv[2], sys.argv[3], Path(place))))
