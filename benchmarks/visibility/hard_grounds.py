"""Fast mode where it has it hardest: anchors just above the ground, and very rough ground from a drone high up."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table
from benchmarks.terrains import fractal_grid, real_grid
from terrain import ElevationGrid
from visibility import FLAT, Anchor, anchor_above_ground, lines_of_sight, min_visible_altitude

__all__ = ["low_anchors", "very_rough"]

Altitudes = npt.NDArray[np.float32]

# p99.9 of the errors at their obstacles when the targets were set, of the same anchors and posts
BEFORE_M = {"bigtujunga": 1.892, "rough fractal, 512 × 512": 7.647}
POSTS = 20_000  # hidden ones, drawn of each anchor's
RECEIVERS_M = (0.0, 1.5, 2.0)
PLACES = ((256, 256), (100, 400), (300, 150))
UP_M = 900.0

LOW_NOTE = """\
Anchors at random over posts, 1 to 3 m above them; flat ground. The altitude over a hidden post follows from the slope
over its obstacle, often a near one: its error, carried back along the line to the obstacle, is *at its obstacle*.
*Before*: of the same anchors and posts when the target was set."""
ROUGH_NOTE = """\
Rough fractal, 512 × 512, 30 m cells, slopes of 28 % in the median; an anchor 900 m above the ground at three places;
receivers 0, 1.5 and 2 m above it, the worst of which counts."""


def low_anchors(count: int = 60, seed: int = 5) -> Table:
    """Errors of fast mode behind the first obstacle of anchors 1 to 3 m up; half of them on each ground."""
    random = np.random.default_rng(seed)
    rows = []
    for name, grid in (("bigtujunga", real_grid("bigtujunga.tif")), ("rough fractal, 512 × 512", fractal_grid(512))):
        if grid is None:
            continue
        found = [_errors_m(grid, _low(grid, random)) for _ in range(count // 2)]
        at_obstacle_m, altitude_m = (np.concatenate(part) for part in zip(*found, strict=True))
        p999_m, before_m = float(np.percentile(at_obstacle_m, 99.9)), BEFORE_M[name]
        cells = (
            name, f"{len(found)}", f"{before_m:.3g} m", f"{p999_m:.3g} m", f"{at_obstacle_m.max():.3g} m",
            f"{np.percentile(altitude_m, 99.9):.3g} m", f"{altitude_m.max():.3g} m",
        )  # fmt: skip
        whole = count == 60
        rows.append(Row(cells, "half of before" if whole else "", p999_m <= 0.5 * before_m if whole else None))
    columns = (
        "ground", "anchors", "p99.9 at its obstacle, before", "p99.9 at its obstacle", "largest", "altitude, p99.9",
        "altitude, largest",
    )  # fmt: skip
    return Table("Fast mode, anchors 1 to 3 m up", columns, rows, LOW_NOTE)


def very_rough() -> Table:
    """Posts that fast and exact mode call differently from a drone high over very rough ground."""
    grid = fractal_grid(512)
    rows = []
    for row, col in PLACES:
        anchor = anchor_above_ground(grid, "A", *grid.position_of(row, col), UP_M)
        fast_m, exact_m = _both(grid, anchor)
        shares = [float(np.mean(_seen(grid, fast_m, up) != _seen(grid, exact_m, up))) for up in RECEIVERS_M]
        cells = (f"row {row}, column {col}", *(f"{100.0 * share:.3f} %" for share in shares))
        rows.append(Row(cells, "≤ 0.3 %", max(shares) <= 0.003))
    columns = ("anchor over", *(f"misclassified, receiver {up:g} m" for up in RECEIVERS_M))
    return Table("Fast mode over very rough ground", columns, rows, ROUGH_NOTE)


def _low(grid: ElevationGrid, random: np.random.Generator) -> Anchor:
    row, col = random.integers(1, grid.rows - 1), random.integers(1, grid.cols - 1)
    return anchor_above_ground(grid, "A", *grid.position_of(int(row), int(col)), float(random.uniform(1.0, 3.0)))


def _both(grid: ElevationGrid, anchor: Anchor) -> tuple[Altitudes, Altitudes]:
    fast, exact = (min_visible_altitude(grid, [anchor], mode, FLAT) for mode in ("fast", "exact"))
    return fast.altitude_m[0], exact.altitude_m[0]


def _seen(grid: ElevationGrid, altitude_m: Altitudes, above_ground_m: float) -> npt.NDArray[np.bool_]:
    return np.asarray(altitude_m <= grid.heights_m + np.float32(above_ground_m))


def _errors_m(grid: ElevationGrid, anchor: Anchor) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Errors of some hidden posts, at their obstacles and in altitude."""
    fast_m, exact_m = _both(grid, anchor)
    hidden = np.isfinite(grid.heights_m) & np.isfinite(exact_m) & np.isfinite(fast_m) & (exact_m > grid.heights_m)
    rows, cols = np.nonzero(hidden)
    drawn = np.random.default_rng(0).choice(len(rows), min(len(rows), POSTS), replace=False)
    rows, cols = rows[drawn], cols[drawn]
    east_m = grid.origin_east_m + cols * grid.cell_east_m
    north_m = grid.origin_north_m - rows * grid.cell_north_m
    touching_m = np.column_stack([east_m, north_m, exact_m[rows, cols].astype(np.float64)])
    eyes_m = np.broadcast_to([anchor.east_m, anchor.north_m, anchor.altitude_m], touching_m.shape)
    lines = lines_of_sight(grid, eyes_m, touching_m, curvature=FLAT)
    share = lines.blocking_distance_m / np.hypot(east_m - anchor.east_m, north_m - anchor.north_m)
    error_m = np.abs(fast_m[rows, cols] - exact_m[rows, cols]).astype(np.float64)
    known = np.isfinite(share)
    return (error_m * share)[known], error_m[known]
