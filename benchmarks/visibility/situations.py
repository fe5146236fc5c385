"""Fast mode by situation: on windows and whole tiles of real DEMs, anchors inside, on and beyond the border."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table
from benchmarks.terrains import fractal_grid, real_grid
from benchmarks.visibility.deviation import Deviation, deviation
from terrain import ElevationGrid
from visibility import FLAT, Anchor, min_visible_altitude
from visibility.sight.fast_errors import FastErrors, fast_errors
from visibility.sight.minimum_altitude import Mode

__all__ = ["SITUATIONS", "Judged", "fast_mode_by_situation", "judged", "window_of"]

DEMS = (
    "bigtujunga.tif", "N44W072.hgt", "N46E008.tif", "mmgis_gale_missionDEM.tif", "gvi_vancouver_DEM.tif",
    "gvi_vancouver_DSM.tif", "viewscape_test_dsm.tif", "jancaha_dsm.tif", "samp53-utm_dsm1m.tif", "n43.dt0",
    "colorado_srtm3.asc", "landlab_hugo_site_filled.asc",
)  # fmt: skip
SITUATIONS = ("over a post", "between posts", "on the border", "0.3 to 12 posts beyond it")
WINDOWS = (60, 300)
RECEIVERS_M = (0.0, 1.5, 10.0)
LEAST_POSTS = 400  # known ones that a window must have
FURTHEST_BEYOND = 12.0

NOTE = """\
Windows of 60 × 60 and 300 × 300 posts at random places of every DEM, and every DEM whole; anchors at random places, 2
to 300 m above the highest post beside them; flat ground; receivers on the ground, 1.5 and 10 m above it, the worst
of which counts. *Wild posts* as in the table before. *Unknown for nothing*: posts called unknown, beside shadows of
unknown ground, that exact mode knows; they are not among the misclassified. *Said at most* is what the answers
themselves told (`error_statement`), from the edges of their shadows and the bend of their ground: in the mean, and for
the anchor that came nearest to any of the figures the share of it that was used up. p99.9: of the altitude errors over
hidden posts, the worst anchor's."""


@dataclass(frozen=True, eq=False)
class Judged:
    """One anchor on one ground: what fast mode was off by, and what it said."""

    found: Deviation
    said: FastErrors

    @property
    def misclassified(self) -> float:
        """The largest share over the receivers."""
        return max(self.found.worst(receiver_m) for receiver_m in RECEIVERS_M)

    @property
    def used_up(self) -> float:
        """The largest share of what was said: misclassified posts, large altitude error, posts called unknown."""
        shares = [self.misclassified / self.said.misclassified_most]
        if self.large_error_m > 0.0:
            shares.append(self.large_error_m / self.said.large_error_m)
        if self.found.unknown[0] > 0.0:
            shares.append(self.found.unknown[0] / max(self.said.unknown_most, 1e-9))
        return max(shares)

    @property
    def large_error_m(self) -> float:
        """p99.9 of the altitude errors over hidden posts; 0 where there are not a thousand."""
        return self.found.percentile_m(99.9) if self.found.error_m.size >= 1000 else 0.0


@dataclass
class _Pool:
    name: str
    anchors: list[Judged] = field(default_factory=list)

    def row(self) -> Row:
        shares = [100.0 * one.misclassified for one in self.anchors]
        hidden = sum(one.found.error_m.size for one in self.anchors)
        wild = sum(one.found.wild for one in self.anchors)
        said = np.mean([100.0 * one.said.misclassified_most for one in self.anchors])
        used_up = max(one.used_up for one in self.anchors)
        worst_m = max(one.large_error_m for one in self.anchors)
        cells = (
            self.name, f"{len(self.anchors)}", f"{np.mean(shares):.3f} % ({np.max(shares):.3f} %)", f"{said:.2f} %",
            f"{100.0 * max(one.found.unknown[0] for one in self.anchors):.2f} %", f"{100.0 * used_up:.0f} %",
            f"{worst_m:.3g} m", f"{1e6 * wild / max(hidden, 1):.3g}",
        )  # fmt: skip
        return Row(cells, "nothing beyond what was said", bool(used_up <= 1.0))


def fast_mode_by_situation(*, count: int = 8, seed: int = 1, dems: tuple[str, ...] = DEMS) -> Table:
    """One row per ground and size, and one per situation; count: anchors of each on each."""
    random = np.random.default_rng(seed)
    by_ground: list[_Pool] = []
    by_situation = {situation: _Pool(f"all, anchor {situation}") for situation in SITUATIONS}
    for name, grid in _grounds(dems):
        for posts in (*(posts for posts in WINDOWS if posts < min(grid.shape)), None):
            pool = _Pool(f"{name}, " + (f"whole, {grid.rows} × {grid.cols}" if posts is None else f"{posts} × {posts}"))
            for situation in SITUATIONS:
                for _ in range(max(count // 4, 1) if posts is None else count):
                    part = grid if posts is None else window_of(grid, posts, random)
                    if part is not None:
                        one = judged(part, situation, random)
                        pool.anchors.append(one)
                        by_situation[situation].anchors.append(one)
            if pool.anchors:
                by_ground.append(pool)
    return Table(
        "Fast mode by situation",
        ("ground, posts", "anchors", "misclassified: mean (worst anchor)", "said at most, mean",
         "unknown for nothing, worst", "used up at worst",
         "p99.9, worst anchor", "wild per million hidden"),
        [pool.row() for pool in (*by_ground, *by_situation.values()) if pool.anchors],
        NOTE,
    )  # fmt: skip


def window_of(grid: ElevationGrid, posts: int, random: np.random.Generator) -> ElevationGrid | None:
    """A square part at a random place as a grid of its own; None where that is mostly unknown."""
    row, col = (int(random.integers(0, size - posts)) for size in grid.shape)
    heights_m: npt.NDArray[np.float32] = grid.heights_m[row : row + posts, col : col + posts]
    if np.count_nonzero(np.isfinite(heights_m)) < LEAST_POSTS:
        return None
    return ElevationGrid(heights_m, grid.cell_east_m, grid.cell_north_m)


def judged(grid: ElevationGrid, situation: str, random: np.random.Generator) -> Judged:
    """One anchor at random, over the highest of the four posts around it."""
    row, col = _place(grid, situation, random)
    top, left = (int(np.clip(np.floor(at), 0, size - 2)) for at, size in zip((row, col), grid.shape, strict=True))
    beside_m = grid.heights_m[top : top + 2, left : left + 2]
    ground_m = float(np.nanmax(beside_m if np.isfinite(beside_m).any() else grid.heights_m))
    above_m = float(np.exp(random.uniform(np.log(2.0), np.log(300.0))))
    anchor = Anchor("A", *grid.position_of(row, col), ground_m + above_m)
    modes: tuple[Mode, Mode] = ("fast", "exact")
    fast, exact = (min_visible_altitude(grid, [anchor], mode, FLAT) for mode in modes)
    found = deviation(grid, anchor, fast.altitude_m[0], exact.altitude_m[0], RECEIVERS_M)
    return Judged(found, fast_errors(grid.heights_m, fast.altitude_m))


def _place(grid: ElevationGrid, situation: str, random: np.random.Generator) -> tuple[float, float]:
    """A row and a column."""
    last_row, last_col = grid.rows - 1.0, grid.cols - 1.0
    if situation == SITUATIONS[0]:
        known = np.argwhere(np.isfinite(grid.heights_m))
        row, col = known[random.integers(len(known))]
        return float(row), float(col)
    if situation == SITUATIONS[1]:
        return float(random.uniform(0.0, last_row)), float(random.uniform(0.0, last_col))
    beyond = 0.0 if situation == SITUATIONS[2] else float(random.uniform(0.3, FURTHEST_BEYOND))
    along, side = float(random.random()), int(random.integers(4))
    return (
        (-beyond, along * last_col), (last_row + beyond, along * last_col),
        (along * last_row, -beyond), (along * last_row, last_col + beyond),
    )[side]  # fmt: skip


def _grounds(dems: tuple[str, ...]) -> Iterator[tuple[str, ElevationGrid]]:
    yield "rough fractal", fractal_grid(512)
    for name in dems:
        grid = real_grid(name)
        if grid is not None:
            yield name, grid
