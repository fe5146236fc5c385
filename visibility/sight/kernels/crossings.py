"""The straight line over the triangulation: which edges it crosses, and the ground where it does.

A line is ``start`` + t·``step`` with t in 0..1, both GridPoints; cells_m are (east, north). Edges come in three
families of parallel grid lines (rows, columns, diagonals); a line meets the lines of a family at equal steps of t, so
crossing k needs no search.

Curvature: lowering every post by c·d² and triangulating lowers the ground at distance d by c·(d² - bulge), where
bulge = f(1-f)·edge² is what interpolating a parabola adds. Against the line, whose far end is lowered alike, the ground
then stands c·(t(1-t)·D² - bulge) higher than on a flat body, and that reads the same from both ends.
"""

import math
from typing import Any, NamedTuple

from compiled.options import scalar_kernel

__all__ = [
    "GRAZING_TOLERANCE_M",
    "NEGLIGIBLE",
    "Family",
    "GridPoint",
    "between",
    "clip_to_grid",
    "crossing",
    "crossing_place",
    "end_ground",
    "families",
    "grid_point",
    "is_inside",
    "step_between",
]

# A share of an edge this small is a rounding of "not at all": a post so little involved need not be known.
NEGLIGIBLE = 1e-9

# A line that touches the ground is clear; rounding in metres of altitude must not turn the touch into a hit.
GRAZING_TOLERANCE_M = 1e-5


class GridPoint(NamedTuple):
    """A place over the grid, or a step from one to another: fractional row and column, altitude in metres."""

    row: Any
    col: Any
    altitude_m: Any


class Family(NamedTuple):
    """How a line crosses one family of grid lines: ``crossings`` of them, at equal steps of t.

    first_line: the grid line that is crossed first; direction: 1 or -1, to the next. stride: between the posts of a
    grid line in the flat heights; between: from a grid line to the next; last_edge: of a grid line. skew: of a grid
    line's first edge, per line; skew_last: its last edge less that; to_far_end: from one end of an edge to the other.
    t_0, dt: t of the first crossing, and from one to the next; position_0, d_position: the place along the grid line
    there, in edges; edge2_m2: length of an edge squared.
    """

    crossings: Any
    first_line: Any
    direction: Any
    stride: Any
    between: Any
    last_edge: Any
    skew: Any
    skew_last: Any
    to_far_end: Any
    t_0: Any
    dt: Any
    position_0: Any
    d_position: Any
    edge2_m2: Any


@scalar_kernel
def grid_point(points, i):
    """Row i of points (n, 3): row, col, altitude."""
    return GridPoint(points[i, 0], points[i, 1], points[i, 2])


@scalar_kernel
def step_between(start, end):
    """The step from one GridPoint to another."""
    return GridPoint(end.row - start.row, end.col - start.col, end.altitude_m - start.altitude_m)


@scalar_kernel
def is_inside(shape, row, col):
    """Whether a fractional post position is on the grid; a single row or column of posts is a line."""
    rows, cols = shape
    return -NEGLIGIBLE <= row <= rows - 1 + NEGLIGIBLE and -NEGLIGIBLE <= col <= cols - 1 + NEGLIGIBLE


@scalar_kernel
def _clip_axis(last, start, step, near, far):
    """The part of near..far in which start + t·step stays within 0..last; empty (near > far) where it never does."""
    low, high = -NEGLIGIBLE - start, last + NEGLIGIBLE - start
    if step == 0.0:
        return (near, far) if low <= 0.0 <= high else (1.0, 0.0)
    first, second = low / step, high / step
    return max(near, min(first, second)), min(far, max(first, second))


@scalar_kernel
def clip_to_grid(shape, start, step):
    """The part (near, far) of t in which a line is over the grid; near > far where it misses the grid."""
    rows, cols = shape
    near, far = _clip_axis(rows - 1.0, start.row, step.row, 0.0, 1.0)
    return _clip_axis(cols - 1.0, start.col, step.col, near, far)


@scalar_kernel
def _whole_numbers(value, step, within, low, high):
    """Whole numbers low..high that value + t·step takes for t within (near, far): (how many, first, direction)."""
    near, far = within
    # a line that drifts less than this runs along one line of the family; the other families hold its profile
    if near > far or not abs(step) > NEGLIGIBLE:
        return 0, 0, 1
    at_near, at_far = value + near * step, value + far * step
    if step > 0.0:
        first, last = max(math.ceil(at_near), low), min(math.floor(at_far), high)
        return max(last - first + 1, 0), first, 1
    first, last = min(math.floor(at_near), high), max(math.ceil(at_far), low)
    return max(first - last + 1, 0), first, -1


@scalar_kernel
def families(shape, cells_m, start, step, within):
    """The Families of rows, columns and diagonals that a line crosses for t within (near, far)."""
    rows, cols = shape
    cell_east_m, cell_north_m = cells_m
    row, col, d_row, d_col = start.row, start.col, step.row, step.col
    east2 = cell_east_m * cell_east_m if cols > 1 else 0.0
    north2 = cell_north_m * cell_north_m if rows > 1 else 0.0
    last_col, last_row = max(cols - 2, 0), max(rows - 2, 0)
    square = rows > 1 and cols > 1

    n, line, way = _whole_numbers(row, d_row, within, 0, rows - 1)
    t, dt = ((line - row) / d_row, way / d_row) if n > 0 else (0.0, 0.0)
    to_far_end = 1 if cols > 1 else 0
    across, d_across = col + t * d_col, dt * d_col
    by_row = Family(n, line, way, 1, cols, last_col, 0, last_col, to_far_end, t, dt, across, d_across, east2)

    n, line, way = _whole_numbers(col, d_col, within, 0, cols - 1)
    t, dt = ((line - col) / d_col, way / d_col) if n > 0 else (0.0, 0.0)
    to_far_end = cols if rows > 1 else 0
    down, d_down = row + t * d_row, dt * d_row
    by_col = Family(n, line, way, cols, 1, last_row, 0, last_row, to_far_end, t, dt, down, d_down, north2)

    # a diagonal is numbered by row - col; the two that are corner posts only are met by rows and columns
    n, line, way = _whole_numbers(row - col, d_row - d_col, within, 2 - cols, rows - 2 if square else 1 - cols)
    t, dt = ((line - (row - col)) / (d_row - d_col), way / (d_row - d_col)) if n > 0 else (0.0, 0.0)
    down, d_down, edge2 = row + t * d_row, dt * d_row, east2 + north2
    diagonal = Family(n, line, way, cols + 1, -1, last_row, 1, last_col, cols + 1, t, dt, down, d_down, edge2)
    return by_row, by_col, diagonal


@scalar_kernel
def crossing_place(family, k):
    """Where crossing k of a Family is on its edge: (first post, second post, share from the first to the second).

    Posts are numbered as in flat heights (rows·cols,). Held on the line's edges: rounding never reads beside the grid.
    """
    line = family.first_line + k * family.direction
    position = family.position_0 + k * family.d_position
    skew = family.skew * line
    edge = min(max(int(position), skew, 0), skew + family.skew_last, family.last_edge)
    index = edge * family.stride + line * family.between
    return index, index + family.to_far_end, position - edge


@scalar_kernel
def between(flat_m, place):
    """The value at a place that ``crossing_place`` gave; NaN between unknown posts."""
    first, second, fraction = place
    here, there = float(flat_m[first]), float(flat_m[second])
    value_m = here + fraction * (there - here)
    if math.isnan(value_m):
        if fraction <= NEGLIGIBLE:
            value_m = here
        elif fraction >= 1.0 - NEGLIGIBLE:
            value_m = there
    return value_m


@scalar_kernel
def crossing(flat_m, family, k):
    """Crossing k of a Family: (t, ground height, bulge in m²); the height is NaN on unknown ground."""
    first, second, fraction = crossing_place(family, k)
    ground_m = between(flat_m, (first, second, fraction))
    return family.t_0 + k * family.dt, ground_m, family.edge2_m2 * fraction * (1.0 - fraction)


@scalar_kernel
def end_ground(heights_m, cells_m, row, col):
    """(ground height, bulge in m²) under an end that is inside the grid; the height is NaN on unknown ground."""
    rows, cols = heights_m.shape
    top = min(max(int(row), 0), max(rows - 2, 0))
    left = min(max(int(col), 0), max(cols - 2, 0))
    bottom, right = min(top + 1, rows - 1), min(left + 1, cols - 1)
    down = min(max(row - top, 0.0), 1.0) if rows > 1 else 0.0
    across = min(max(col - left, 0.0), 1.0) if cols > 1 else 0.0
    corner, far = float(heights_m[top, left]), float(heights_m[bottom, right])
    side = float(heights_m[bottom, left]) if down > across else float(heights_m[top, right])
    ground_m = 0.0
    for weight, height_m in (
        (1.0 - max(down, across), corner),
        (abs(down - across), side),
        (min(down, across), far),
    ):
        if weight > NEGLIGIBLE or not math.isnan(height_m):
            ground_m += weight * height_m
    east_m, north_m = cells_m
    return ground_m, down * (1.0 - down) * north_m * north_m + across * (1.0 - across) * east_m * east_m
