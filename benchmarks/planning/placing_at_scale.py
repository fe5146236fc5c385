"""A placement over a DEM in its file, by two workers of a Dask cluster on this machine: time, memory, what it found."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import rasterio
from rasterio import Affine
from rasterio.windows import Window

from benchmarks.planning.placing import lattice_of
from benchmarks.report import Row, Table, duration
from benchmarks.terrains import CELL_M, fractal_m
from planning.placement import Goal, PlacementRules, WindowQuestion, candidate_grid, place_by_windows
from terrain import open_dem

__all__ = ["at_scale"]

ROOT = Path(__file__).parents[2]
TILE, WEST_M, NORTH_M, ABOVE_M = 4096, 400_000.0, 4_000_000.0, 80.0
MOST_S, MOST_BYTES = 1800.0, 8 << 30
LOOK_S = 0.5
NOTE = """\
A tiled GeoTIFF of {posts:,}² posts, 30 m apart: one fractal of 4,096² over and over. Candidates on a lattice, 80 m up;
fast mode; {count} anchors, each post should see one. All of it: heights of the candidates, sight by two workers
with one thread each that read their windows, search, bound and the exact value. Time: the lesser of the clock's and of
all processes' processor time. Memory: the highest sum of what the three processes have resident, mapped files
included."""


def at_scale(posts: int = 10_000, candidates: int = 100_000, range_m: float = 5_000.0, count: int = 20) -> Table:
    """10⁵ candidates × 10⁸ posts."""
    with tempfile.TemporaryDirectory() as name:
        dem = _written(Path(name) / "dem.tif", posts)
        command = [sys.executable, "-m", __name__, str(dem), str(candidates), str(range_m), str(count)]
        environment = {**os.environ, "NUMBA_NUM_THREADS": "1"}
        answer = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    told = json.loads(answer.stdout.splitlines()[-1])
    taken_s = min(told["clock_s"], told["processor_s"])
    cells = (
        f"{told['candidates']:,} candidates × {told['targets']:,} posts, range {range_m / 1000.0:g} km",
        duration(told["clock_s"]), duration(told["processor_s"]), duration(told["sight_s"]),
        duration(told["search_s"]), f"{told['bytes'] / 1e9:.2f} GB", f"{told['value']:.2%}", f"{told['bound']:.2%}",
    )  # fmt: skip
    met = taken_s <= MOST_S and told["bytes"] <= MOST_BYTES
    columns = ("what", "clock", "processor", "of the clock sight", "search", "memory", "placed", "bound")
    rows = [Row(cells, "≤ 30 min, ≤ 8 GiB", met)]
    return Table("Placing by windows", columns, rows, NOTE.format(posts=posts, count=count))


def _written(path: Path, posts: int) -> Path:
    tile_m = fractal_m(TILE).astype(np.float32)
    profile = {
        "driver": "GTiff", "height": posts, "width": posts, "count": 1, "dtype": "float32", "crs": "EPSG:32611",
        "transform": Affine(CELL_M, 0.0, WEST_M, 0.0, -CELL_M, NORTH_M),
        "tiled": True, "blockxsize": 512, "blockysize": 512, "compress": "ZSTD", "zstd_level": 1,
    }  # fmt: skip
    with rasterio.open(path, "w", **profile) as file:
        for row in range(0, posts, TILE):
            for col in range(0, posts, TILE):
                rows, cols = min(TILE, posts - row), min(TILE, posts - col)
                file.write(tile_m[:rows, :cols], 1, window=Window(col, row, cols, rows))
    return path


class _Memory(threading.Thread):
    """Looks again and again at what this process and its children have resident."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.most_bytes = 0

    def run(self) -> None:
        while True:
            self.most_bytes = max(self.most_bytes, sum(_of_all(lambda one: one.memory_info().rss)))
            time.sleep(LOOK_S)


def _of_all(ask: Any) -> list[Any]:
    me = psutil.Process()
    found = []
    for one in (me, *me.children(recursive=True)):
        try:
            found.append(ask(one))
        except psutil.NoSuchProcess:  # it ended meanwhile, as helpers of the cluster do
            continue
    return found


def _probe(dem_file: str, candidates: int, range_m: float, count: int) -> dict[str, Any]:
    """One placement, as numbers."""
    from distributed import LocalCluster

    memory = _Memory()
    memory.start()
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1",
    ) as cluster:  # fmt: skip
        before_s = sum(_of_all(lambda one: sum(one.cpu_times()[:2])))
        begin_s = time.perf_counter()
        dem = open_dem(dem_file)
        places = candidate_grid(dem, lattice_of(dem, candidates), above_ground_m=[ABOVE_M])
        question = WindowQuestion(Goal("coverage", min_anchors=1), PlacementRules(max_range_m=range_m))
        found = place_by_windows(dem, places, count, question, cluster=cluster.scheduler_address)
        clock_s = time.perf_counter() - begin_s
        processor_s = sum(_of_all(lambda one: sum(one.cpu_times()[:2]))) - before_s
    return {
        "candidates": len(places), "targets": found.targets, "clock_s": clock_s, "processor_s": processor_s,
        "bytes": memory.most_bytes, "value": found.value, "bound": found.bound, **found.timing_s,
    }  # fmt: skip


if __name__ == "__main__":
    print(json.dumps(_probe(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4]))))
