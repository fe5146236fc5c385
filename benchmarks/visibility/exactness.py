"""Exact mode against engines that share no code with it: brute force over every edge, and rays against the mesh."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table
from benchmarks.terrains import fractal_m, real_grid
from terrain import ElevationGrid
from tests.reference.minimum_altitude import minimum_altitude
from visibility import FLAT, Anchor, Curvature, lines_of_sight, min_visible_altitude
from visibility.cover import Engine, MeshHits, grid_surface_mesh, lowered_m, mesh_blocks

__all__ = ["against_rays", "exactness"]

ALLOWED_ERROR_M = 1e-3
EARTH = Curvature(6_371_000.0, 4.0 / 3.0)
RAY_RECEIVERS_M = (0.5, 1.5, 30.0)
# a post that clears or touches by less than this may fall on either side in two correct float computations
TOUCH_M = 1e-3

NOTE = """\
The oracle (`tests/reference/`) shares no code with the product. Anchors stand on posts, between posts and outside
all four sides and corners. Receivers stand on the ground; a post is misclassified when the two answers call it
differently by more than a millimetre of touching."""

RAY_NOTE = """\
Rays from each anchor to receivers 0.5, 1.5 and 30 m above the posts, against the triangles of the same surface, k =
4/3. Möller–Trumbore tries every triangle in float64; Embree works in float32. A line that passes the surface by less
than twice the engine's own tolerance (0.01 mm, and 9 mm on this DEM) is touching to it and cannot be judged by
it."""


def exactness() -> Table:
    """Misclassified posts and altitude error over small grounds, anchors inside, outside, on and off posts."""
    rows = []
    for name, grid in _grounds():
        anchors = _anchors_around(grid)
        for curvature in (FLAT, EARTH):
            wrong, error_m, posts = 0, 0.0, 0
            for anchor, answer_m in zip(anchors, _exact(grid, anchors, curvature), strict=True):
                expected_m = _brute_force(grid, anchor, curvature)
                wrong += _misclassified(grid.heights_m, answer_m, expected_m)
                error_m = max(error_m, float(np.nanmax(np.abs(answer_m - expected_m))))
                posts += answer_m.size
            shape = f"{grid.rows} × {grid.cols}, cells {grid.cell_east_m:g} × {grid.cell_north_m:g} m"
            bent = "flat" if curvature is FLAT else "k = 4/3"
            cells = (name, shape, bent, f"{len(anchors)}", f"{posts}", f"{wrong}", f"{error_m:.1e} m")
            rows.append(Row(cells, "0 posts, ≤ 1e-3 m", wrong == 0 and error_m <= ALLOWED_ERROR_M))
    return Table(
        "Exact mode against brute force over every edge",
        ("ground", "size", "curvature", "anchors", "posts judged", "misclassified", "largest altitude error"),
        rows,
        NOTE,
    )


def against_rays(sampled_posts: int = 20_000) -> Table:
    """The same, against rays and triangles: every post of small grounds, a sample of the large real one."""
    rows = []
    everything = 10**9
    for name, grid in _grounds():
        rows.append(_ray_row(name, grid, "moller_trumbore", everything))
    mountains = real_grid("bigtujunga.tif")
    if mountains is not None:
        rows.append(_ray_row("bigtujunga, whole", mountains, "embree", sampled_posts))
    columns = ("ground", "engine", "anchors", "lines judged", "misclassified", "touching to the rays")
    return Table("Exact mode against rays and triangles", columns, rows, RAY_NOTE)


def _ray_row(name: str, grid: ElevationGrid, engine: Engine, posts: int) -> Row:
    anchors = _anchors_around(grid)
    rows, cols = np.unravel_index(np.random.default_rng(5).permutation(grid.heights_m.size)[:posts], grid.shape)
    ground_m = np.column_stack(
        [
            grid.origin_east_m + cols * grid.cell_east_m,
            grid.origin_north_m - rows * grid.cell_north_m,
            grid.heights_m[rows, cols],
        ]
    )
    receivers_m = np.concatenate([ground_m + np.array([0.0, 0.0, above_m]) for above_m in RAY_RECEIVERS_M])
    eyes_m = np.repeat([(a.east_m, a.north_m, a.altitude_m) for a in anchors], len(receivers_m), axis=0)
    ends_m = np.tile(receivers_m, (len(anchors), 1))
    exact_m = np.tile(_exact(grid, anchors, EARTH)[:, rows, cols], (1, len(RAY_RECEIVERS_M))).ravel()
    hits = _rays(grid, eyes_m, ends_m, engine)
    differs = np.flatnonzero((ends_m[:, 2] >= exact_m) == hits.blocked)
    clearance_m = lines_of_sight(grid, eyes_m[differs], ends_m[differs], curvature=EARTH).clearance_m
    wrong = int(np.count_nonzero(np.abs(clearance_m) > 2.0 * hits.tolerance_m))
    counts = (f"{len(anchors)}", f"{len(ends_m)}", f"{wrong}", f"{len(differs) - wrong}")
    return Row((name, engine.replace("_", "–"), *counts), "0 lines", wrong == 0)


def _rays(
    grid: ElevationGrid, eyes_m: npt.NDArray[np.float64], ends_m: npt.NDArray[np.float64], engine: Engine
) -> MeshHits:
    """Rays through the surface in a frame where curvature is taken out of ground and points alike."""
    origin_m = grid.position_of(grid.rows / 2.0, grid.cols / 2.0)
    up = np.array([0.0, 0.0, 1.0])
    straight_eyes_m = eyes_m - lowered_m(EARTH, origin_m, eyes_m)[:, None] * up
    straight_ends_m = ends_m - lowered_m(EARTH, origin_m, ends_m)[:, None] * up
    return mesh_blocks(grid_surface_mesh(grid, EARTH, origin_m), straight_eyes_m, straight_ends_m, engine)


def _grounds() -> Iterator[tuple[str, ElevationGrid]]:
    random = np.random.default_rng(3)
    yield "random", ElevationGrid(random.uniform(0.0, 60.0, (21, 26)).astype(np.float32), 30.0, 30.0)
    yield "random, oblong cells", ElevationGrid(random.uniform(0.0, 60.0, (19, 23)).astype(np.float32), 12.0, 31.0)
    yield "fractal", ElevationGrid(fractal_m(64)[:28, :31], 30.0, 30.0)
    mountains = real_grid("bigtujunga.tif")
    if mountains is not None:
        yield "bigtujunga, cut out", ElevationGrid(mountains.heights_m[300:330, 500:526], 30.0, 30.0)


def _anchors_around(grid: ElevationGrid) -> list[Anchor]:
    rows, cols = grid.shape
    places = {
        "on a post": (rows // 3, cols // 2),
        "between posts": (rows * 0.613, cols * 0.377),
        "on an edge of the mesh": (rows // 2 + 0.5, cols // 2 + 0.5),
        "north": (-4.2, cols * 0.4),
        "south": (rows + 3.3, cols * 0.7),
        "west": (rows * 0.35, -5.0),
        "east": (rows * 0.5, cols + 2.6),
        "north-west corner": (-3.0, -3.0),
        "south-east corner": (rows + 1.5, cols + 4.5),
    }
    top_m = float(grid.heights_m.max())
    return [
        Anchor(name, *grid.position_of(row, col), altitude_m=top_m + 15.0 + 7.0 * number)
        for number, (name, (row, col)) in enumerate(places.items())
    ]


def _exact(grid: ElevationGrid, anchors: list[Anchor], curvature: Curvature) -> npt.NDArray[np.float64]:
    return min_visible_altitude(grid, anchors, "exact", curvature).altitude_m.astype(np.float64)


def _brute_force(grid: ElevationGrid, anchor: Anchor, curvature: Curvature) -> npt.NDArray[np.float64]:
    row, col = grid.post_at(anchor.east_m, anchor.north_m)
    cells_m = (grid.cell_north_m, grid.cell_east_m)
    expected_m, _ = minimum_altitude(  # type: ignore[no-untyped-call] # tests carry no types
        grid.heights_m, (row, col, anchor.altitude_m), cells_m, curvature.drop_per_m2
    )
    return np.asarray(expected_m, np.float64)


def _misclassified(
    ground_m: npt.NDArray[np.float32], answer_m: npt.NDArray[np.float64], expected_m: npt.NDArray[np.float64]
) -> int:
    differs = (ground_m >= answer_m) != (ground_m >= expected_m)
    return int(np.count_nonzero(differs & (np.abs(expected_m - ground_m) > TOUCH_M)))
