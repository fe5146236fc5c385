"""Fast mode, and GDAL beside it, against exact mode: posts called wrongly, and how far altitudes are off."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table
from benchmarks.terrains import CENTRE_ABOVE_GROUND_M, centre_anchor, fractal_grid, real_grid, spread_anchors
from benchmarks.visibility import gdal_peer
from benchmarks.visibility.deviation import Deviation, deviation, pooled
from terrain import ElevationGrid
from visibility import FLAT, Anchor, min_visible_altitude
from visibility.sight.minimum_altitude import Mode

__all__ = ["accuracy"]

RECEIVERS_M = (0.0, 1.5)
ANCHORS = 12
Placed = list[tuple[Anchor, int, int, float]]

NOTE = """\
Flat ground, so that GDAL answers the same question. Anchors over posts drawn at random with a fixed seed, 10 to 300
m above ground; on the rough fractal one anchor, 100 m above the middle. p50 to largest: absolute altitude error,
metres, over the posts that exact mode calls hidden from the ground. The altitude over a far post follows from the
slope over one obstacle, often a near one, so a difference of a few metres at the obstacle grows with the distance
behind it: *at its obstacle* is the largest error carried back to the obstacle that decides it, where rays a fraction
of a cell apart meet ground of different height. *Wild posts* are those that this does not explain: their error at
the obstacle exceeds the relief of the 3 × 3 posts there."""


def accuracy(*, fractal_posts: int = 1024) -> Table:
    """One row per ground and engine."""
    rows = []
    for name, grid, placed, allowed in _grounds(fractal_posts):
        exact_m = [_ours(grid, anchor, "exact") for anchor, *_ in placed]
        ours = _compare(grid, placed, exact_m, lambda anchor, *_, grid=grid: _ours(grid, anchor, "fast"))
        peer = _gdal(grid, placed, exact_m)
        worst = max(ours.worst(receiver_m) for receiver_m in RECEIVERS_M)
        better = peer is None or all(ours.mean(receiver_m) < peer.mean(receiver_m) for receiver_m in RECEIVERS_M)
        target = "below GDAL, none wild" + (f", worst anchor ≤ {100 * allowed:.1f} %" if allowed else "")
        met = better and ours.wild == 0 and (not allowed or worst <= allowed)
        rows.append(Row((name, f"{len(placed)}", "fast", *_cells(ours)), target, met))
        if peer is not None:
            rows.append(Row((name, f"{len(placed)}", f"GDAL {gdal_peer.version()}", *_cells(peer))))
    receivers = [f"misclassified, receiver {receiver_m:g} m: mean (worst anchor)" for receiver_m in RECEIVERS_M]
    return Table(
        "Fast mode and GDAL against exact mode",
        (
            "ground",
            "anchors",
            "engine",
            *receivers,
            "p50",
            "p95",
            "p99",
            "p99.9",
            "largest",
            "at its obstacle",
            "wild posts",
        ),
        rows,
        NOTE,
    )


def _grounds(fractal_posts: int) -> Iterator[tuple[str, ElevationGrid, Placed, float]]:
    """Name, ground, anchors with row, column and height, and the share that may be misclassified (0: no figure set)."""
    for name, file, allowed in (
        ("bigtujunga (643 × 1197, 30 m)", "bigtujunga.tif", 0.002),
        ("Gale crater, Mars (337 × 348, 1 m)", "mmgis_gale_missionDEM.tif", 0.0),
    ):
        grid = real_grid(file)
        if grid is not None:
            yield name, grid, spread_anchors(grid, ANCHORS), allowed
    grid = fractal_grid(fractal_posts)
    middle = (centre_anchor(grid), grid.rows // 2, grid.cols // 2, CENTRE_ABOVE_GROUND_M)
    yield f"rough fractal ({fractal_posts}², 30 m, seed 1)", grid, [middle], 0.003


def _ours(grid: ElevationGrid, anchor: Anchor, mode: Mode) -> npt.NDArray[np.float32]:
    answer: npt.NDArray[np.float32] = min_visible_altitude(grid, [anchor], mode, FLAT).altitude_m[0]
    return answer


def _compare(
    grid: ElevationGrid,
    placed: Placed,
    exact_m: list[npt.NDArray[np.float32]],
    answer: Callable[..., npt.NDArray[np.floating]],
) -> Deviation:
    parts = []
    for (anchor, row, col, above_m), reference_m in zip(placed, exact_m, strict=True):
        altitude_m = answer(anchor, row, col, above_m)
        parts.append(deviation(grid, anchor, altitude_m, reference_m, RECEIVERS_M))
    return pooled(parts)


def _gdal(grid: ElevationGrid, placed: Placed, exact_m: list[npt.NDArray[np.float32]]) -> Deviation | None:
    """GDAL's deviation; None where it has no answer to this question, since it takes unknown ground for a height."""
    if grid.unknown_posts:
        return None
    lift_m = max(0.0, -float(grid.heights_m.min()))
    dem = gdal_peer.GdalDem(grid.heights_m + np.float32(lift_m), grid.cell_east_m, grid.cell_north_m)

    def answer(_: Anchor, row: int, col: int, above_m: float) -> npt.NDArray[np.float64]:
        # a receiver cannot stand below the ground, where GDAL's lines may pass
        return np.maximum(dem.min_visible_altitude(row, col, above_m) - lift_m, grid.heights_m)

    try:
        return _compare(grid, placed, exact_m, answer)
    finally:
        dem.close()


def _cells(found: Deviation) -> tuple[str, ...]:
    shares = [f"{100 * found.mean(r):.3f} % ({100 * found.worst(r):.3f} %)" for r in RECEIVERS_M]
    errors = [f"{found.percentile_m(percent):.3g}" for percent in (50, 95, 99, 99.9)]
    return (*shares, *errors, f"{found.largest_m:.4g}", f"{found.at_obstacle_m:.3g}", f"{found.wild}")
