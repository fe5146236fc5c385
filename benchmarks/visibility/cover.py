"""What stands on the ground: ways through canopy against counted points, what it costs, and a city against rays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely.affinity import rotate

from benchmarks.machine import not_quiet
from benchmarks.report import Row, Table, duration
from benchmarks.timing import best_of_each_s
from terrain import ElevationGrid, fractal, height_at
from tests.reference.canopy import way_through
from tests.reference.roofs import prism
from visibility import FLAT, Anchor, Curvature, anchor_above_ground, lines_of_sight, min_visible_altitude
from visibility.cover import (
    Buildings,
    Canopy,
    Footprint,
    MeshHits,
    canopy_paths,
    grid_surface_mesh,
    lowered_m,
    mesh_blocks,
    standing_footprints,
    with_standing,
)
from visibility.sight.minimum_altitude import Mode
from visibility.signal import RADIOS, Foliage, min_usable_altitude, signals, with_foliage

__all__ = ["canopy_length", "city", "cost_of_canopy"]

Reals = npt.NDArray[np.float64]

EARTH = Curvature(6_371_000.0, 4.0 / 3.0)
CELL_M, RELIEF_M = 5.0, 60.0
CITY_M = 60.0  # the highest house
DEEP_M = 1000.0  # solids reach so far below the lowest ground
HIGHEST_RECEIVER_M = 60.0

LENGTH_NOTE = """\
The oracle (`tests/reference/canopy.py`) imports nothing of the product: it counts 20,000 points along each line. Rough
canopy with gaps and crown bases over rough ground, lines between random places."""

COST_NOTE = """\
A fractal of 5 m posts with patches of trees up to 25 m on it, crowns from a third of that; 868 MHz. Every ratio is of
two calls that took turns in one run. A line of sight with canopy is sight and the way through canopy, each asked by
itself. A map of what is usable seeks the lowest usable altitude over each post with some six signals (ITP); that of
what is visible has it in closed form."""

CITY_NOTE = """\
Turned rectangles in a jittered raster of streets, 3 to 60 m high, over a fractal of 5 m posts; four anchors 90 to 180 m
above the ground. Rays (embree) run from the anchors to receivers 0 to 60 m over random posts, against the triangles of
ground, walls and roofs, k = 4/3, and judge exact mode. A receiver less than twice embree's own tolerance from the
minimum visible altitude cannot be judged by it."""


def canopy_length(*, lines: int = 24, seed: int = 4) -> Table:
    """Ways through canopy against counted points."""
    random = np.random.default_rng(seed)
    shape, cell_m = (9, 11), 10.0
    heights_m = random.uniform(0.0, 12.0, shape).astype(np.float32)
    top_m = np.where(random.random(shape) < 0.3, 0.0, random.uniform(5.0, 25.0, shape)).astype(np.float32)
    base_m = (top_m * random.uniform(0.0, 0.6, shape)).astype(np.float32)
    canopy = Canopy(ElevationGrid(heights_m, cell_m, cell_m), top_m, base_m)
    ends = random.uniform((0.2, 0.2, 0.0), (7.8, 9.8, 40.0), (2, lines, 3))
    starts_m, ends_m = (np.column_stack([cell_m * one[:, 1], -cell_m * one[:, 0], one[:, 2]]) for one in ends)
    found_m = canopy_paths(canopy, starts_m, ends_m, FLAT)
    counted_m = np.array(
        [
            way_through(heights_m, top_m, base_m, cell_m, start, end, points=20_000)  # type: ignore[no-untyped-call] # tests carry no types
            for start, end in zip(*ends, strict=True)
        ]
    )
    inside = counted_m > 1.0
    off = np.abs(found_m[inside] - counted_m[inside]) / counted_m[inside]
    worst, outside_m = float(off.max()), float(np.abs(found_m - counted_m)[~inside].max(initial=0.0))
    cells = (
        f"{lines}", f"{inside.sum()}", f"{counted_m.mean():.1f} m", f"{100.0 * np.median(off):.4f} %",
        f"{100.0 * worst:.4f} %", f"{1e3 * outside_m:.1f} mm",
    )  # fmt: skip
    return Table(
        "Ways through canopy against counted points",
        ("lines", "with over 1 m of trees", "mean way", "median error", "largest error", "largest of the others"),
        [Row(cells, "≤ 1 %", worst <= 0.01)],
        LENGTH_NOTE,
    )


def cost_of_canopy(*, posts: int = 256, lines: int = 20_000, seed: int = 2) -> Table:
    """Lines, signals and maps with canopy over those without."""
    loud = not_quiet()
    random = np.random.default_rng(seed)
    grid = fractal(posts, seed, cell_m=CELL_M, relief_m=RELIEF_M)
    patches_m = fractal(posts, seed + 1, cell_m=CELL_M, relief_m=50.0).heights_m - 25.0
    top_m = np.maximum(patches_m, np.float32(0.0))
    canopy = Canopy(grid, top_m, top_m / np.float32(3.0))
    wooded = with_foliage(grid, Foliage(canopy))
    ends_m = random.uniform(grid.bounds_m[:2], grid.bounds_m[2:], (2, lines, 2))
    starts_m, ends_m = (
        np.column_stack([one, np.asarray(height_at(grid, *one.T)) + random.uniform(1.5, 60.0, lines)]) for one in ends_m
    )
    radio = RADIOS["868MHz"]
    middle_m = grid.position_of(posts / 2.0, posts / 2.0)
    anchor = anchor_above_ground(grid, "A", *middle_m, 40.0, radio=radio)

    def sight_and_way() -> None:
        lines_of_sight(grid, starts_m, ends_m)
        canopy_paths(canopy, starts_m, ends_m)

    taken_s = best_of_each_s(
        {
            "sight": lambda: lines_of_sight(grid, starts_m, ends_m),
            "sight, canopy": sight_and_way,
            "signal": lambda: signals(grid, starts_m, ends_m, radio),
            "signal, canopy": lambda: signals(wooded, starts_m, ends_m, radio),
        },
        rounds=5,
    )
    taken_s |= best_of_each_s(
        {
            "visible": lambda: min_visible_altitude(grid, [anchor]),
            "usable": lambda: min_usable_altitude(grid, [anchor]),
            "usable, canopy": lambda: min_usable_altitude(wooded, [anchor]),
        },
        rounds=3,
    )
    asked = (
        (f"{lines} lines of sight, canopy / none", "sight, canopy", "sight", 1.5),
        (f"{lines} signals, canopy / none", "signal, canopy", "signal", 1.5),
        (f"map of what is usable, {posts}² posts, canopy / none", "usable, canopy", "usable", 3.0),
        ("the same, none / map of what is visible", "usable", "visible", None),
    )
    rows = []
    for what, dearer, cheaper, most in asked:
        ratio = taken_s[dearer] / taken_s[cheaper]
        cells = (what, duration(taken_s[dearer]), duration(taken_s[cheaper]), f"{ratio:.3g} ×")
        rows.append(Row(cells, "" if most is None else f"≤ {most:g} ×", None if most is None else ratio <= most))
    return Table("What canopy costs", ("what", "time", "in place of", "ratio"), rows, COST_NOTE + loud)


def city(*, posts: int = 512, across: int = 100, rays: int = 100_000, seed: int = 6) -> Table:
    """Maps of four anchors over across² footprints, and their exact mode against rays."""
    loud = not_quiet()
    random = np.random.default_rng(seed)
    grid = fractal(posts, seed, cell_m=CELL_M, relief_m=RELIEF_M)
    footprints = _houses(grid, across, random)
    built = with_standing(grid, [standing_footprints(grid, footprints)])
    places_m = random.uniform(grid.bounds_m[:2], grid.bounds_m[2:], (4, 2))
    anchors = [
        anchor_above_ground(built, f"D{number}", east_m, north_m, CITY_M + 30.0 * number)
        for number, (east_m, north_m) in enumerate(places_m.tolist(), 1)
    ]
    modes: tuple[Mode, Mode] = ("fast", "exact")
    taken_s = best_of_each_s(
        {
            "fast": lambda: min_visible_altitude(built, anchors, "fast", EARTH),
            "exact": lambda: min_visible_altitude(built, anchors, "exact", EARTH),
            "placing": lambda: standing_footprints(grid, footprints),
        },
        rounds=2,
    )
    wrong, judged, touching = _against_rays(grid, footprints, anchors, built, rays, random)
    rows = [Row((f"map, {mode}", duration(taken_s[mode]), "", ""), "≤ 3 s", taken_s[mode] <= 3.0) for mode in modes]
    rows += [
        Row(("putting the footprints onto the ground, once", duration(taken_s["placing"]), "", "")),
        Row((f"{judged + touching} rays", "", f"{wrong}", f"{touching}"), "0 misclassified", wrong == 0),
    ]
    title = f"A city of {len(footprints)} footprints, {posts}² posts, 4 anchors"
    return Table(title, ("what", "time", "misclassified", "touching to the rays"), rows, CITY_NOTE + loud)


def _houses(grid: ElevationGrid, across: int, random: np.random.Generator) -> list[Footprint]:
    """across² rectangles, each in a lot of its own."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    lot_m = np.array([(east_m - west_m) / across, (north_m - south_m) / across])
    houses = []
    for lot in np.ndindex(across, across):
        at_m = np.array([west_m, south_m]) + (np.array(lot) + random.uniform(0.4, 0.6, 2)) * lot_m
        half_m = random.uniform(0.12, 0.3, 2) * lot_m
        outline = rotate(shapely.box(*(at_m - half_m), *(at_m + half_m)), random.uniform(0.0, 90.0))
        houses.append(Footprint(outline, float(np.exp(random.uniform(np.log(3.0), np.log(CITY_M))))))
    return houses


def _against_rays(
    grid: ElevationGrid,
    footprints: list[Footprint],
    anchors: list[Anchor],
    built: ElevationGrid,
    rays: int,
    random: np.random.Generator,
) -> tuple[int, int, int]:
    """(misclassified, judged, touching) rays; roofs are raised here once more, from the footprints themselves."""
    middle_m = grid.position_of(grid.rows / 2.0, grid.cols / 2.0)
    outlines = [one.outline for one in footprints]
    centres_m = shapely.bounds(outlines).reshape(-1, 2, 2).mean(axis=1)
    roofs_m = np.asarray(height_at(grid, *centres_m.T)) + [one.height_m for one in footprints]
    solids = [
        prism(shapely.get_coordinates(outline.exterior)[:-1], -DEEP_M, roof_m)  # type: ignore[no-untyped-call] # tests carry no types
        for outline, roof_m in zip(outlines, roofs_m.tolist(), strict=True)
    ]
    corners_m = np.concatenate([np.array(solid) for solid in solids]).reshape(-1, 3)

    def straight(points_m: Reals) -> Reals:
        return np.column_stack([points_m[:, :2], points_m[:, 2] - lowered_m(EARTH, middle_m, points_m)])

    town = Buildings(straight(corners_m), np.arange(len(corners_m)).reshape(-1, 3), "town")
    meshes = (grid_surface_mesh(grid, EARTH, middle_m), town)
    low_m = min_visible_altitude(built, anchors, "exact", EARTH).altitude_m
    number, row, col = (random.integers(0, count, rays) for count in low_m.shape)
    east_m, north_m = grid.position_of(row.astype(np.float64), col.astype(np.float64))
    altitude_m = grid.heights_m[row, col] + random.uniform(0.0, HIGHEST_RECEIVER_M, rays)
    points_m = np.column_stack([east_m, north_m, altitude_m])
    eyes_m = np.array([(one.east_m, one.north_m, one.altitude_m) for one in anchors])[number]
    hits: list[MeshHits] = [mesh_blocks(mesh, straight(points_m), straight(eyes_m), "embree") for mesh in meshes]
    margin_m = altitude_m - low_m[number, row, col]
    told = np.abs(margin_m) > 2.0 * max(hit.tolerance_m for hit in hits)
    wrong = told & ((hits[0].blocked | hits[1].blocked) != (margin_m < 0.0))
    return int(wrong.sum()), int(told.sum()), int((~told).sum())
