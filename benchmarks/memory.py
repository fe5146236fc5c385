"""Peak memory of one answer, measured in a process of its own."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import psutil

from terrain import ElevationGrid
from visibility import FLAT, min_visible_altitude
from visibility.sight.minimum_altitude import Mode

from .report import Row, Table
from .terrains import CELL_M, fractal_m, spread_anchors

__all__ = ["memory", "peak_bytes"]

ROOT = Path(__file__).parents[1]
NOTE = """\
Highest resident memory of a fresh process during the call, less what it held before it, plus the DEM itself (4 bytes
per cell). Kernels are loaded beforehand by a tiny call."""
CASES: tuple[tuple[Mode, int], ...] = (("fast", 1), ("fast", 32), ("exact", 1))


def memory(posts: int = 4096) -> Table:
    """Bytes per cell of fast and exact answers."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        heights = Path(folder) / "heights.npy"
        np.save(heights, fractal_m(posts))
        for mode, anchors in CASES:
            per_cell = _measured(heights, mode, anchors) / posts**2
            allowed = 16 + 4 * anchors
            cells = (f"{mode}, {anchors} anchor{'s' * (anchors > 1)}, {posts}²", f"{per_cell:.1f} bytes per cell")
            rows.append(Row(cells, f"≤ 16 + 4 × {anchors} = {allowed}", per_cell <= allowed))
    return Table("Memory", ("what", "peak"), rows, NOTE)


def _measured(heights: Path, mode: Mode, anchors: int) -> int:
    command = [sys.executable, "-m", "benchmarks.memory", str(heights), mode, str(anchors)]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return int(answer.stdout)


def _probe(heights: Path, mode: Mode, count: int) -> int:
    """Bytes that the call took at its peak, DEM included."""
    tiny = ElevationGrid(np.arange(1024, dtype=np.float32).reshape(32, 32), CELL_M, CELL_M)
    min_visible_altitude(tiny, [spread_anchors(tiny, 1)[0][0]], mode, FLAT)
    heights_m = np.load(heights)
    heights_m.setflags(write=False)  # so the grid takes it as it is
    grid = ElevationGrid(heights_m, CELL_M, CELL_M)
    anchors = [anchor for anchor, *_ in spread_anchors(grid, count)]
    held = psutil.Process().memory_info().rss
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the peak counts anew from here
    min_visible_altitude(grid, anchors, mode, FLAT)
    return peak_bytes() - int(held) + grid.heights_m.nbytes


def peak_bytes() -> int:
    """Highest resident memory since the count began, bytes (VmHWM; getrusage does not follow clear_refs)."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    raise RuntimeError("This system does not tell a process its peak memory; the memory table needs Linux.")


if __name__ == "__main__":
    chosen: Mode = "exact" if sys.argv[2] == "exact" else "fast"
    print(_probe(Path(sys.argv[1]), chosen, int(sys.argv[3])))
