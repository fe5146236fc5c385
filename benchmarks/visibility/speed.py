"""Time of one visibility answer, against GDAL and against one copy of the DEM, and how it grows with the DEM."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table, duration
from benchmarks.terrains import (
    CELL_M,
    CENTRE_ABOVE_GROUND_M,
    centre_anchor,
    fractal_grid,
    fractal_m,
    real_grid,
    spread_anchors,
)
from benchmarks.timing import best_of_each_s, best_of_s
from benchmarks.visibility import gdal_peer, other_peers
from terrain import ElevationGrid, height_at
from visibility import FLAT, lines_of_sight, min_visible_altitude
from visibility.sight.minimum_altitude import Mode

__all__ = ["against_peers", "growth", "many_anchors", "many_lines"]

PEER_NOTE = """\
Rough fractal, 30 m cells, observer 100 m above the middle, flat. From a DEM in memory to an array of altitudes:
Sightline's time is that of the whole Python call, GDAL's that of its viewshed (its DEM lies in its own memory
already) and of reading the result into an array; what the viewshed alone takes is beside it. Both use all cores.
Best of several, taking turns; of xarray-spatial and GRASS, which take seconds, the best of two and one."""
GROWTH_NOTE = """\
Rough fractal cut out of, or repeated from, one 4096² field, so that the ground is equally rough at every size. A
tenth of tolerance on N·log N; sizes below 1024² are dominated by fixed costs and are not judged."""

GDAL_ANSWER = "GDAL, minimum altitude"

GDAL_MODES = ("GDAL, the same, left unread in its memory", "GDAL, yes or no, left unread")

# GRASS 8.2.1 r.viewshed on the same fractal, measured once: for machines on which it is not installed
GRASS_S = {1024: 2.95, 4096: 56.0}
OTHER_PEERS_MOST = 1024  # posts a side: xarray-spatial takes 2.3 GB and 14 s for twice as many
FAST_TIMES = {1024: 6.0, 4096: 10.0}  # GDAL's time at least over fast mode's
EXACT_SHARE = {1024: 1.5, 4096: 1.5}  # exact mode's time at most over GDAL's


def against_peers(sizes: tuple[int, ...] = (1024, 4096)) -> Table:
    """Both modes against GDAL and a copy of the DEM; exact mode against xarray-spatial and GRASS."""
    rows = []
    for posts in sizes:
        grid = fractal_grid(posts)
        best_s = _with_gdal_s(grid)
        rows += _fast_rows(best_s, posts)
        rows += _exact_rows(grid, best_s, posts)
    return Table("Speed of one anchor", ("what", "time", "against", "its time", "ratio"), rows, PEER_NOTE)


def _with_gdal_s(grid: ElevationGrid) -> dict[str, float]:
    """Shortest time of both modes, of a copy, and of GDAL where it is there, taking turns."""
    row, col = grid.rows // 2, grid.cols // 2
    calls: dict[str, Callable[[], Any]] = {"fast": partial(_answer, grid, "fast"), "copy": grid.heights_m.copy}
    calls["exact"] = partial(_answer, grid, "exact")
    dem = _in_gdal(grid)
    if dem is not None:
        calls[GDAL_ANSWER] = partial(dem.min_visible_altitude, row, col, CENTRE_ABOVE_GROUND_M)
        for name, boolean in zip(GDAL_MODES, (False, True), strict=True):
            calls[name] = partial(dem.run, row, col, CENTRE_ABOVE_GROUND_M, boolean=boolean)
    best_s = best_of_each_s(calls, rounds=9, budget_s=25.0)
    if dem is not None:
        dem.close()
    return best_s


def _fast_rows(best_s: dict[str, float], posts: int) -> list[Row]:
    fast_s, copy_s = best_s["fast"], best_s["copy"]
    what, time_text = f"fast, 1 anchor, {posts}²", duration(fast_s)
    rows = []
    for name in (GDAL_ANSWER, *GDAL_MODES):
        if name not in best_s:
            continue
        wanted = FAST_TIMES.get(posts) if name == GDAL_ANSWER else None
        target = (f"≥ {wanted:g} × faster", best_s[name] >= wanted * fast_s) if wanted else ("", None)
        cells = (what, time_text, name, duration(best_s[name]), f"{best_s[name] / fast_s:.1f} × faster")
        rows.append(Row(cells, *target))
    target = ("≤ 3 × (stretch 2 ×)", fast_s <= 3.0 * copy_s) if posts >= 4096 else ("", None)
    cells = (what, time_text, "one numpy copy of the DEM", duration(copy_s), f"{fast_s / copy_s:.2f} × the copy")
    return [*rows, Row(cells, *target)]


def _exact_rows(grid: ElevationGrid, best_s: dict[str, float], posts: int) -> list[Row]:
    exact_s, gdal_s = best_s["exact"], best_s.get(GDAL_ANSWER)
    what, time_text = f"exact, 1 anchor, {posts}²", duration(exact_s)
    rows = []
    if gdal_s is not None:
        most = EXACT_SHARE.get(posts)
        target = (f"≤ {most:g} × GDAL's time", exact_s <= most * gdal_s) if most else ("", None)
        cells = (what, time_text, GDAL_ANSWER, duration(gdal_s), f"{exact_s / gdal_s:.2f} × its time")
        rows.append(Row(cells, *target))
    place = (grid.rows // 2, grid.cols // 2, CENTRE_ABOVE_GROUND_M)
    if posts <= OTHER_PEERS_MOST:
        peers = [other_peers.xarray_spatial(grid, *place), other_peers.grass(grid, *place)]
    else:
        peers = [other_peers.Timed(other_peers.GRASS, None, "not run at this size")]
    for peer in peers:
        seconds, name = peer.seconds, peer.name
        if seconds is None and name == other_peers.GRASS and posts in GRASS_S:
            seconds, name = GRASS_S[posts], f"{name}, as measured once ({peer.reason})"
        if seconds is None:
            rows.append(Row((what, time_text, name, "–", f"skipped: {peer.reason}")))
        else:
            ratio = f"{seconds / exact_s:.1f} × faster"
            rows.append(Row((what, time_text, name, duration(seconds), ratio), "faster", exact_s < seconds))
    return rows


def _in_gdal(grid: ElevationGrid) -> gdal_peer.GdalDem | None:
    try:
        return gdal_peer.GdalDem(grid.heights_m, grid.cell_east_m, grid.cell_north_m)
    except gdal_peer.PeerMissingError:
        return None


def _answer(grid: ElevationGrid, mode: Mode) -> None:
    min_visible_altitude(grid, [centre_anchor(grid)], mode, FLAT)


def many_anchors(posts: int = 4096, count: int = 32) -> Table:
    """Many anchors at once against as many single questions."""
    grid = fractal_grid(posts)
    anchors = [anchor for anchor, *_ in spread_anchors(grid, count)]
    calls = {
        "single": lambda: min_visible_altitude(grid, anchors[:1], "fast", FLAT),
        "together": lambda: min_visible_altitude(grid, anchors, "fast", FLAT),
    }
    best_s = best_of_each_s(calls, rounds=3, budget_s=40.0)
    share = best_s["together"] / (count * best_s["single"])
    cells = (f"fast, {count} anchors, {posts}²", duration(best_s["together"]), duration(best_s["single"]))
    row = Row((*cells, f"{share:.2f} of {count} × single"), "≤ 0.90", share <= 0.9)
    return Table("Many anchors at once", ("what", "time", "one anchor alone", "ratio"), [row])


def growth(
    fast_sizes: tuple[int, ...] = (256, 512, 1024, 2048, 4096, 8192),
    exact_sizes: tuple[int, ...] = (256, 512, 1024, 2048, 4096),
) -> Table:
    """Cost per cell over sizes, both modes."""
    field_m = fractal_m(min(max(fast_sizes), 4096))
    rows = []
    cheapest_ns, before = math.inf, (0, 0.0)
    for posts in fast_sizes:
        grid = _sized(field_m, posts)
        cost_ns = best_of_s(partial(_answer, grid, "fast"), rounds=7, budget_s=8.0) / posts**2 * 1e9
        cheapest_ns = min(cheapest_ns, cost_ns)
        cells = ("fast", f"{posts}²", duration(cost_ns * posts**2 / 1e9), f"{cost_ns:.2f} ns")
        flat = (f"≤ 2 × the cheapest ({cheapest_ns:.2f} ns)", cost_ns <= 2.0 * cheapest_ns)
        rows.append(Row((*cells, "–"), *(flat if posts >= 1024 else ("", None))))
    for posts in exact_sizes:
        grid = _sized(field_m, posts)
        time_s = best_of_s(partial(_answer, grid, "exact"), rounds=3, budget_s=12.0)
        cost_ns = time_s / posts**2 * 1e9
        allowed = _n_log_n(posts) / _n_log_n(before[0]) * before[1] * 1.1 if before[0] else math.inf
        grew = f"{time_s / before[1]:.2f} ×" if before[0] else "–"
        judged = (f"≤ {allowed / before[1]:.2f} ×", time_s <= allowed) if before[0] >= 512 else ("", None)
        rows.append(Row(("exact", f"{posts}²", duration(time_s), f"{cost_ns:.1f} ns", grew), *judged))
        before = (posts, time_s)
    return Table("Growth with the DEM", ("mode", "size", "time", "per cell", "grew by"), rows, GROWTH_NOTE)


def _n_log_n(posts: int) -> float:
    return posts**2 * math.log(posts**2)


def _sized(field_m: npt.NDArray[np.float32], posts: int) -> ElevationGrid:
    repeats = -(-posts // len(field_m))
    return ElevationGrid(np.tile(field_m, (repeats, repeats))[:posts, :posts], CELL_M, CELL_M)


def many_lines(count: int = 100_000) -> Table:
    """Point-to-point lines of sight across real mountains."""
    grid = real_grid("bigtujunga.tif")
    name = "bigtujunga"
    if grid is None:
        grid, name = fractal_grid(1024), "rough fractal 1024²"
    random = np.random.default_rng(11)
    west_m, south_m, east_m, north_m = grid.bounds_m
    ends = []
    for above_m in (50.0, 1.5):
        place_m = random.uniform((west_m, south_m), (east_m, north_m), (count, 2))
        altitude_m = height_at(grid, place_m[:, 0], place_m[:, 1]) + above_m
        ends.append(np.column_stack([place_m, altitude_m]))
    time_s = best_of_s(lambda: lines_of_sight(grid, *ends), rounds=5, budget_s=20.0)
    cells = (f"{count} lines of sight, exact, {name}", duration(time_s), f"{time_s / count * 1e6:.2f} µs")
    return Table("Lines of sight between points", ("what", "time", "per line"), [Row(cells, "≤ 0.5 s", time_s <= 0.5)])
