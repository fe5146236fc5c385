"""What the first answer of a fresh process waits for: kernels out of the cache, or the compiler."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

from benchmarks.report import Row, Table, duration

__all__ = ["first_request"]

ROOT = Path(__file__).parents[2]
NOTE = """\
A fresh Python process after `sightline warm-up`: its first answer of each kind on a 64² DEM, with how many kernels
numba found in its cache and how many it had to compile. The service's workers load them before they take a job, so a
request waits for neither."""


def first_request() -> Table:
    """One row per kind of answer; a fresh process for each."""
    subprocess.run([sys.executable, "-m", "service.cli", "warm-up"], cwd=ROOT, check=True, capture_output=True)
    rows = []
    for kind in ("fast", "exact", "lines"):
        command = [sys.executable, "-m", "benchmarks.service.first_request", kind]
        seen = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)
        times = (duration(seen["import_s"]), duration(seen["first_s"]), duration(seen["second_s"]))
        counts = (str(seen["from_cache"]), str(seen["compiled"]))
        rows.append(Row((kind, *times, *counts), "0 compiled", seen["compiled"] == 0))
    columns = ("answer", "import", "first answer", "second answer", "kernels from cache", "compiled")
    return Table("First answer after set-up", columns, rows, NOTE)


def _probe(kind: str) -> dict[str, Any]:
    started_s = time.perf_counter()
    import terrain
    import visibility

    imported_s = time.perf_counter()
    heights_m = np.random.default_rng(5).uniform(0.0, 50.0, (64, 64)).astype(np.float32)
    grid = terrain.ElevationGrid(heights_m, 30.0, 30.0)
    anchor = visibility.Anchor("A", 900.0, -800.0, 120.0)

    def answer() -> object:
        if kind == "lines":
            return visibility.lines_of_sight(grid, [(900.0, -800.0, 120.0)], [(100.0, -1500.0, 60.0)])
        return visibility.min_visible_altitude(grid, [anchor], "fast" if kind == "fast" else "exact")

    first_s = _time_s(answer)
    second_s = _time_s(answer)
    kernels = _kernels()
    return {
        "import_s": imported_s - started_s,
        "first_s": first_s,
        "second_s": second_s,
        "from_cache": sum(sum(kernel.stats.cache_hits.values()) for kernel in kernels),
        "compiled": sum(_compiled(kernel) for kernel in kernels),
    }


def _compiled(kernel: Any) -> int:
    """How often this kernel was compiled here; one without a cache is compiled in every process."""
    if kernel.stats.cache_path is None:
        return len(kernel.signatures)
    return sum(kernel.stats.cache_misses.values())


def _time_s(call: Any) -> float:
    begin_s = time.perf_counter()
    call()
    return time.perf_counter() - begin_s


def _kernels() -> list[Any]:
    """Every compiled function of ours that this process has loaded, each once."""
    ours = ("terrain.", "visibility.")
    modules = [module for name, module in list(sys.modules.items()) if name.startswith(ours)]
    found = {id(value): value for module in modules for value in vars(module).values() if isinstance(value, Dispatcher)}
    return list(found.values())


if __name__ == "__main__":
    print(json.dumps(_probe(sys.argv[1])))
