"""The control volume and the morphing map: the paper's whole case, growth, memory, and one anchor that moves."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import psutil

from benchmarks.memory import peak_bytes
from benchmarks.report import Row, Table, duration
from benchmarks.terrains import RELIEF_M, fractal_grid
from benchmarks.timing import best_of_each_s, best_of_s
from benchmarks.visibility import dilution
from benchmarks.visibility.paper_case import (
    ALMANAC_FILE,
    CEILING_M,
    COLS,
    DEM_FILE,
    GOOD,
    LAYER_M,
    LIMIT,
    ROWS,
    mountain_almanac,
    paper_window,
    read_mountains,
)
from terrain import ElevationGrid
from visibility import (
    FLAT,
    Anchor,
    DistantAnchor,
    FlightLimit,
    MinimumVisibleAltitude,
    altitude_layers,
    control_volume,
    min_visible_altitude,
    morphing_map,
    satellites,
)
from visibility.air import ControlVolume, volume_blocks
from visibility.sight import SurfaceCache

__all__ = ["morphing_speed", "one_moves", "paper_case_speed", "volume_growth", "volume_memory"]

ROOT = Path(__file__).parents[2]
DRONE_LIMIT = FlightLimit(2.5)
FLAT_TOP_M = RELIEF_M + 1000.0
STEADY = 1.5  # how many times the cheapest a voxel may cost

PAPER_NOTE = """\
De Vivo et al., IV-A, which gives 500 points/s with its surfaces: 12 satellites, a DEM of 10 × 13 km at 30 m, layers
of 12 m from the lowest ground to 2500 m, PDOP of every voxel, and the morphing map for PDOP < 2.5. Ground: {ground}."""
GROWTH_NOTE = "16 drones over the rough fractal, two-way ranges, PDOP of every voxel, in blocks."
MEMORY_NOTE = """\
Highest resident memory of a fresh process while it goes through a volume in blocks, less what it held before with its
surfaces ready. A block has 4 million voxels of 20 bytes; one is being filled while the one before it is still read."""
MOVED_NOTE = (
    "16 drones, fast mode, rough fractal; the cache recomputes the one that moved and puts 16 surfaces together."
)


def paper_case_speed() -> Table:
    """The paper's whole case, warm."""
    grid, sky, ground = _paper_ground()
    surfaces = min_visible_altitude(grid, sky)
    volume = _paper_volume(surfaces)
    steps: dict[str, Callable[[], object]] = {
        "minimum visible altitudes": lambda: min_visible_altitude(grid, sky),
        f"PDOP everywhere, {volume.voxels / 1e6:.1f} million voxels": partial(flyable_voxels, volume),
        "morphing map": partial(morphing_map, surfaces, LIMIT, ceiling_m=CEILING_M),
        "the whole case": partial(_whole_case, grid, sky),
    }
    best_s = best_of_each_s(steps, rounds=5, budget_s=20.0)
    rows = [Row((name, duration(time_s))) for name, time_s in best_s.items()]
    whole_s = best_s["the whole case"]
    rows[-1] = Row(rows[-1].cells, "≤ 2 s", whole_s <= 2.0)
    return Table("The paper's case", ("what", "time"), rows, PAPER_NOTE.format(ground=ground))


def flyable_voxels(volume: ControlVolume) -> int:
    """Voxels below the limit of the case, block by block."""
    return sum(int(np.count_nonzero(block.dop < LIMIT.dop_limit)) for block in volume_blocks(volume))


def _whole_case(grid: ElevationGrid, sky: Sequence[DistantAnchor]) -> None:
    surfaces = min_visible_altitude(grid, sky)
    flyable_voxels(_paper_volume(surfaces))
    morphing_map(surfaces, LIMIT, ceiling_m=CEILING_M)


def _paper_volume(surfaces: MinimumVisibleAltitude) -> ControlVolume:
    layers = altitude_layers(float(np.nanmin(surfaces.grid.heights_m)), CEILING_M, LAYER_M)
    return control_volume(surfaces, layers, kind=LIMIT.kind)


def _paper_ground() -> tuple[ElevationGrid, Sequence[DistantAnchor], str]:
    if DEM_FILE.is_file() and ALMANAC_FILE.is_file():
        grid = paper_window(read_mountains())
        eyes = satellites.satellite_eyes(grid, mountain_almanac(), GOOD)
        return grid, eyes.distant_anchors(), "Big Tujunga canyon, 2007-12-01 22:20 UTC (docs/paper-case.md)"
    rough = fractal_grid(max(ROWS, COLS))
    grid = replace(rough, heights_m=rough.heights_m[:ROWS, :COLS])
    return grid, dilution.satellites(), "rough fractal and made-up satellites, as the real files are not at hand"


def morphing_speed(posts: int = 1024, count: int = 32) -> Table:
    """The morphing map of many drones, surfaces at hand; pseudoranges, which bend more, on a quarter of the width."""
    rows = []
    for name, limit, across in (
        ("two-way ranges", DRONE_LIMIT, posts),
        ("pseudoranges", replace(DRONE_LIMIT, kind="pseudorange"), posts // 4),
    ):
        grid = fractal_grid(across)
        surfaces = min_visible_altitude(grid, dilution.drones(grid, count), "fast", FLAT)
        time_s = best_of_s(partial(morphing_map, surfaces, limit, ceiling_m=FLAT_TOP_M), rounds=5, budget_s=15.0)
        cells = (f"{count} drones, {across}², {name}", duration(time_s), f"{time_s / across**2 * 1e6:.2f} µs")
        rows.append(Row(cells, *(("≤ 2 s", time_s <= 2.0) if limit.kind == "ranging" else ("", None))))
    return Table("Morphing map, surfaces at hand", ("what", "time", "per post"), rows)


def one_moves(posts: int = 1024, count: int = 16) -> Table:
    """One of many anchors moves: the surfaces that are recomputed, against all."""
    grid = fractal_grid(posts)
    anchors: list[Anchor] = dilution.drones(grid, count)
    cache = SurfaceCache(grid, "fast", FLAT)
    cache.surfaces(tuple(anchors))
    moved = 0

    def move_one() -> None:
        nonlocal moved
        moved += 1
        anchors[0] = replace(anchors[0], altitude_m=anchors[0].altitude_m + 1.0)
        cache.surfaces(tuple(anchors))

    calls = {"all": lambda: min_visible_altitude(grid, anchors, "fast", FLAT), "one": move_one}
    best_s = best_of_each_s(calls, rounds=9)
    again = (cache.computed - count) / moved
    cells = (f"{count}, {posts}²", duration(best_s["all"]), duration(best_s["one"]), f"{again:g}")
    row = Row((*cells, f"{best_s['all'] / best_s['one']:.1f} ×"), "1 recomputed", again == 1.0)
    columns = ("drones", "all anew", "one has moved", "surfaces recomputed", "ratio")
    return Table("One anchor moves", columns, [row], MOVED_NOTE)


def volume_growth(
    sizes: tuple[int, ...] = (128, 256, 512, 1024), layer_counts: tuple[int, ...] = (25, 50, 100, 200)
) -> Table:
    """Cost of a voxel over four sizes of the ground, and over four numbers of layers."""
    cases = [(posts, layer_counts[1]) for posts in sizes] + [(sizes[2], layers) for layers in layer_counts]
    rows, cheapest_ns = [], float("inf")
    for number, (posts, layers) in enumerate(cases):
        if number == len(sizes):
            cheapest_ns = float("inf")  # of the layers, from here
        volume = _volume(posts, layers)
        time_s = best_of_s(partial(flyable_voxels, volume), rounds=3, budget_s=10.0)
        cost_ns = time_s / volume.voxels * 1e9
        cheapest_ns = min(cheapest_ns, cost_ns)
        cells = (f"{posts}²", str(layers), f"{volume.voxels / 1e6:.2f} million", duration(time_s), f"{cost_ns:.1f} ns")
        target = f"≤ {STEADY:g} × the cheapest so far ({cheapest_ns:.1f} ns)"
        rows.append(Row(cells, target, cost_ns <= STEADY * cheapest_ns))
    return Table("Growth of the volume", ("posts", "layers", "voxels", "time", "per voxel"), rows, GROWTH_NOTE)


def _volume(posts: int, layers: int) -> ControlVolume:
    grid = fractal_grid(posts)
    surfaces = min_visible_altitude(grid, dilution.drones(grid, 16), "fast", FLAT)
    return control_volume(surfaces, altitude_layers(0.0, FLAT_TOP_M, FLAT_TOP_M / (layers - 1)))


def volume_memory(cases: tuple[tuple[int, int], ...] = ((512, 50), (512, 200), (1024, 200))) -> Table:
    """Peak memory of going through volumes of very different sizes."""
    rows = []
    for posts, layers in cases:
        command = [sys.executable, "-m", "benchmarks.visibility.volumes", str(posts), str(layers)]
        answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        megabytes = int(answer.stdout) / 1e6
        cells = (f"{posts}² × {layers} layers", f"{posts**2 * layers / 1e6:.0f} million", f"{megabytes:.0f} MB")
        rows.append(Row(cells, "≤ 250 MB", megabytes <= 250.0))
    return Table("Memory of the volume, in blocks", ("volume", "voxels", "peak"), rows, MEMORY_NOTE)


def _probe(posts: int, layers: int) -> int:
    """Bytes that going through a volume took at its peak."""
    flyable_voxels(_volume(16, 4))  # loads the kernels
    volume = _volume(posts, layers)
    held = psutil.Process().memory_info().rss
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    flyable_voxels(volume)
    return peak_bytes() - int(held)


if __name__ == "__main__":
    print(_probe(int(sys.argv[1]), int(sys.argv[2])))
