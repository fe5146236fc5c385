"""All places at once: time against one sweep for each place, and their rank against what exact sight counts."""

from __future__ import annotations

import time

import numpy as np
from scipy.stats import spearmanr

from benchmarks.report import Row, Table, duration
from benchmarks.terrains import fractal_grid, real_grid
from benchmarks.timing import best_of_each_s
from dem_samples import load_sample
from terrain import ElevationGrid
from visibility import VISIBLE, Anchor, anchor_above_ground, min_visible_altitude
from visibility.sites import site_map

__all__ = ["all_places"]

SITE_M, RECEIVER_M = 20.0, 1.5
WHOLE_S, LEAST_RANK, TIMED_DIRECTIONS = 60.0, 0.98, 180
NOTE = f"""\
Sites {SITE_M:g} m above ground, receivers {RECEIVER_M:g} m, no limit of range, every post a site and a target. One
sweep each: what fast mode would take for as many single sites. Rank: Spearman's correlation of what the map tells
with the posts that exact mode counts, over sites drawn at random; map over exact: median and the middle nine tenths
of their ratio."""


def all_places(posts: int = 1024, sampled: int = 500) -> Table:
    """Maps of sites over a rough and over real ground."""
    grids: list[tuple[str, ElevationGrid, tuple[int, ...]]] = [
        (f"rough fractal, {posts}²", fractal_grid(posts), (180, 360))
    ]
    real = real_grid("bigtujunga.tif")
    grids.append(("Jacksboro", load_sample("jacksboro"), (180, 360)) if real is None else ("bigtujunga", real, (180,)))
    rows = []
    for name, grid, choices in grids:
        sweep_s = _sweep_s(grid)
        generator = np.random.default_rng(23)
        at = np.column_stack([generator.integers(0, size, sampled) for size in grid.shape])
        at = at[~np.isnan(grid.heights_m[at[:, 0], at[:, 1]])]
        counted = np.array([_counted(grid, row, col) for row, col in at.tolist()])
        for directions in choices:
            begin_s = time.perf_counter()
            found = site_map(grid, SITE_M, RECEIVER_M, directions=directions)
            taken_s = time.perf_counter() - begin_s
            told = found.seen_m2[at[:, 0], at[:, 1]] / (grid.cell_east_m * grid.cell_north_m)
            rank = float(spearmanr(told, counted).statistic)
            low, middle_ratio, high = np.quantile(told / counted, (0.05, 0.5, 0.95))
            cells = (
                name, str(directions), duration(taken_s), f"{grid.heights_m.size * sweep_s / taken_s:,.0f} ×",
                f"{rank:.4f}", f"{middle_ratio:.2f} ({low:.2f}–{high:.2f})",
            )  # fmt: skip
            # the target of time is for the fewer directions
            timely = directions > TIMED_DIRECTIONS or taken_s <= WHOLE_S
            target = f"≥ {LEAST_RANK:g}" + (f", ≤ {WHOLE_S:g} s" if directions == TIMED_DIRECTIONS else "")
            rows.append(Row(cells, target, timely and rank >= LEAST_RANK))
    columns = ("ground", "directions", "time", "one sweep each", f"rank, {sampled} sites", "map over exact")
    return Table("All places at once", columns, rows, NOTE)


def _sweep_s(grid: ElevationGrid) -> float:
    """Seconds of one fast sweep from the middle."""
    middle = [_site(grid, grid.rows // 2, grid.cols // 2)]
    return best_of_each_s({"sweep": lambda: min_visible_altitude(grid, middle)}, rounds=3)["sweep"]


def _site(grid: ElevationGrid, row: int, col: int) -> Anchor:
    east_m, north_m = grid.position_of(row, col)
    return anchor_above_ground(grid, "S", float(east_m), float(north_m), above_ground_m=SITE_M)


def _counted(grid: ElevationGrid, row: int, col: int) -> int:
    """Posts in sight of one site, by exact mode."""
    found = min_visible_altitude(grid, [_site(grid, row, col)], "exact")
    return int(np.count_nonzero(found.visible(above_ground_m=RECEIVER_M) == VISIBLE))
