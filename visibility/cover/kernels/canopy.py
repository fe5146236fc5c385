"""How far lines run through canopy: it is triangulated as the ground is, so between crossings all is straight."""

import math
from typing import NamedTuple

from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.sight.kernels.crossings import (
    NEGLIGIBLE,
    clip_to_grid,
    crossing_place,
    end_ground,
    families,
    grid_point,
    is_inside,
    step_between,
)

__all__ = ["SQUARE", "canopy_shares", "fill_spans"]

# columns of the table of posts
SOIL, TOP, BASE, DENSITY = 0, 1, 2, 3
LOWEST, HIGHEST = 0, 1  # of the spans of squares
SLACK_M = 1e-3  # what curvature does within one edge
SQUARE = 8  # posts along one side of the squares whose spans of crowns are known
BLOCK = 64  # lines that one thread takes at a time


class Place(NamedTuple):
    """Where a line meets an edge, or ends: t, its height over the ground, top, base and density of the canopy there."""

    t: float
    over_m: float
    top_m: float
    base_m: float
    density: float


@parallel_kernel
def fill_spans(layers, spans_m):
    """Fill spans_m with the altitudes of the LOWEST crown base and the HIGHEST crown top in each square of SQUARE by
    SQUARE posts and one beyond.

    Nothing, +inf to -inf, where there are no crowns; everything, -inf to +inf, where something is unknown.
    """
    rows, cols, _ = layers.shape
    for i in prange(spans_m.shape[0]):
        for j in range(spans_m.shape[1]):
            least, most, wooded = math.inf, -math.inf, False
            for row in range(i * SQUARE, min((i + 1) * SQUARE + 1, rows)):
                for col in range(j * SQUARE, min((j + 1) * SQUARE + 1, cols)):
                    top_m = layers[row, col, TOP]
                    crown_m, base_m = layers[row, col, SOIL] + top_m, layers[row, col, SOIL] + layers[row, col, BASE]
                    wooded = wooded or top_m != 0.0
                    # a bare post counts beside trees: on a slope their canopy rises or falls towards it
                    if not (math.isnan(crown_m) or math.isnan(base_m)):
                        least, most = min(least, base_m), max(most, crown_m)
                    elif top_m != 0.0:
                        least, most = -math.inf, math.inf
            spans_m[i, j, LOWEST] = least if wooded else math.inf
            spans_m[i, j, HIGHEST] = most if wooded else -math.inf


@scalar_kernel
def _below(here, there, near, far):
    """The part (near, far) of 0..1 in which what goes evenly from here to there is <= 0; empty where near > far."""
    if here <= 0.0 and there <= 0.0:
        return near, far
    if here > 0.0 and there > 0.0:
        return 1.0, 0.0
    zero = here / (here - there)
    return (near, min(far, zero)) if here <= 0.0 else (max(near, zero), far)


@scalar_kernel
def _piece(last, here):
    """The share of the way between two Places that runs through canopy, times its density; NaN beside unknown posts."""
    t_0, over_0, top_0, base_0, density_0 = last
    t_1, over_1, top_1, base_1, density_1 = here
    step = t_1 - t_0
    if step <= 0.0 or (top_0 == 0.0 and top_1 == 0.0):
        return 0.0
    if (over_0 > top_0 and over_1 > top_1) or (over_0 < base_0 and over_1 < base_1):
        return 0.0  # above all crowns of the piece, or below them
    near, far = _below(over_0 - top_0, over_1 - top_1, 0.0, 1.0)
    near, far = _below(base_0 - over_0, base_1 - over_1, near, far)
    if math.isnan(over_0 + over_1 + top_0 + top_1 + base_0 + base_1):
        return math.nan
    if far > near:
        return step * (far - near) * (density_0 + (density_1 - density_0) * (near + far) / 2.0)
    return 0.0


@scalar_kernel
def _first_from(family, t):
    """Number of the first crossing of a Family that is not before t."""
    if family.crossings == 0:
        return 0
    return min(max(math.ceil((t - family.t_0) / family.dt - 1e-9), 0), family.crossings)


@scalar_kernel
def _t_of(family, k):
    return family.t_0 + k * family.dt if k < family.crossings else math.inf


@scalar_kernel
def _at(posts, family, k, line):
    """The Place of crossing k."""
    from_m, rise_m, sag_m, drop_per_m2 = line
    here, there, fraction = crossing_place(family, k)
    if fraction <= NEGLIGIBLE:
        there = here
    elif fraction >= 1.0 - NEGLIGIBLE:
        here = there
    other = 1.0 - fraction
    t = family.t_0 + k * family.dt
    bulge_m = sag_m * t * (1.0 - t) - drop_per_m2 * family.edge2_m2 * fraction * other
    soil_m = other * posts[here, SOIL] + fraction * posts[there, SOIL]
    top_m = other * posts[here, TOP] + fraction * posts[there, TOP]
    base_m = other * posts[here, BASE] + fraction * posts[there, BASE]
    density = 1.0
    if posts.shape[1] > DENSITY:
        density = other * posts[here, DENSITY] + fraction * posts[there, DENSITY]
    return Place(t, from_m + t * rise_m - soil_m - bulge_m, top_m, base_m, density)


@scalar_kernel
def _end(posts, shape, cells_m, point, t, drop_per_m2):
    """The Place under an end of a line; t NaN where that is outside the grid."""
    if not is_inside(shape, point.row, point.col):
        return Place(math.nan, 0.0, 0.0, 0.0, 0.0)
    rows, cols = shape
    layers = posts.reshape(rows, cols, posts.shape[1])
    ground_m, bulge_m2 = end_ground(layers[:, :, SOIL], cells_m, point.row, point.col)
    top_m, _ = end_ground(layers[:, :, TOP], cells_m, point.row, point.col)
    base_m, _ = end_ground(layers[:, :, BASE], cells_m, point.row, point.col)
    density = 1.0
    if posts.shape[1] > DENSITY:
        density, _ = end_ground(layers[:, :, DENSITY], cells_m, point.row, point.col)
    return Place(t, point.altitude_m - ground_m + drop_per_m2 * bulge_m2, top_m, base_m, density)


@scalar_kernel
def _share_of_run(posts, crossed, line, ends, run, done):
    """(share of the way through canopy times its density, how far it is counted) of a run (from, to) of a line, after
    what is done.

    Pieces reach from the last crossing before the run to the first after it.
    """
    by_row, by_col, diagonal = crossed
    run_from, run_to = run
    last, end = ends
    i, j, k = _first_from(by_row, run_from), _first_from(by_col, run_from), _first_from(diagonal, run_from)
    for family, number in ((by_row, i), (by_col, j), (diagonal, k)):
        if number > 0 and not _t_of(family, number - 1) <= last.t:
            last = _at(posts, family, number - 1, line)
    total = 0.0
    at_row, at_col, at_diagonal = _t_of(by_row, i), _t_of(by_col, j), _t_of(diagonal, k)
    while last.t < run_to or math.isnan(last.t):
        if at_row <= at_col and at_row <= at_diagonal and at_row < math.inf:
            here = _at(posts, by_row, i, line)
            i += 1
            at_row = _t_of(by_row, i)
        elif at_col <= at_diagonal and at_col < math.inf:
            here = _at(posts, by_col, j, line)
            j += 1
            at_col = _t_of(by_col, j)
        elif at_diagonal < math.inf:
            here = _at(posts, diagonal, k, line)
            k += 1
            at_diagonal = _t_of(diagonal, k)
        elif not math.isnan(end.t) and last.t < 1.0:
            here = end
        else:
            break
        if here.t > done and not math.isnan(last.t):
            total += _piece(last, here)
        done = max(done, here.t)
        last = here
    return total, done


@scalar_kernel
def _share(posts, shape, spans_m, earth, start, end):
    """The share of a line at which it is above the bases and below the tops, times the density there; NaN beside
    unknown posts."""
    cell_east_m, cell_north_m, drop_per_m2 = earth
    cells_m = (cell_east_m, cell_north_m)
    step = step_between(start, end)
    reach_m2 = (step.col * cell_east_m) ** 2 + (step.row * cell_north_m) ** 2
    within = clip_to_grid(shape, start, step)
    near, far = within
    if near > far:
        return 0.0
    crossed = families(shape, cells_m, start, step, within)
    sag_m = drop_per_m2 * reach_m2
    line = (start.altitude_m, step.altitude_m, sag_m, drop_per_m2)
    ends = (_end(posts, shape, cells_m, start, 0.0, drop_per_m2), _end(posts, shape, cells_m, end, 1.0, drop_per_m2))
    high, wide, _ = spans_m.shape
    row, col = start.row + near * step.row, start.col + near * step.col
    square_row = min(max(int(row // SQUARE), 0), high - 1)
    square_col = min(max(int(col // SQUARE), 0), wide - 1)
    total, done, begun = 0.0, -1.0, math.nan
    while True:
        # where the line leaves this square
        out_row, out_col = math.inf, math.inf
        if step.row != 0.0:
            out_row = ((square_row + (step.row > 0.0)) * SQUARE - start.row) / step.row
        if step.col != 0.0:
            out_col = ((square_col + (step.col > 0.0)) * SQUARE - start.col) / step.col
        leaves = min(out_row, out_col, far)
        at_near, at_far = near * (1.0 - near), leaves * (1.0 - leaves)
        most = 0.25 if near <= 0.5 <= leaves else max(at_near, at_far)
        lowest_m = start.altitude_m + min(near * step.altitude_m, leaves * step.altitude_m) - sag_m * most
        topmost_m = start.altitude_m + max(near * step.altitude_m, leaves * step.altitude_m)
        topmost_m -= sag_m * min(at_near, at_far)
        span_m = spans_m[square_row, square_col]
        if lowest_m - SLACK_M <= span_m[HIGHEST] and topmost_m + SLACK_M >= span_m[LOWEST]:
            begun = near if math.isnan(begun) else begun
        elif not math.isnan(begun):
            found, done = _share_of_run(posts, crossed, line, ends, (begun, near), done)
            total, begun = total + found, math.nan
        near = max(leaves, near)
        if out_row <= out_col:
            square_row += 1 if step.row > 0.0 else -1
        else:
            square_col += 1 if step.col > 0.0 else -1
        if leaves >= far or not (0 <= square_row < high and 0 <= square_col < wide):
            break
    if not math.isnan(begun):
        found, done = _share_of_run(posts, crossed, line, ends, (begun, far), done)
        total += found
    return total


@parallel_kernel
def canopy_shares(layers, spans_m, earth, lines, shares):
    """Fill shares (n,) with how much of each line (n, 2, 3), row, col, altitude of both ends, runs through canopy.

    layers: (rows, cols, 3) float32, altitude of the ground, and over it tops and bases of the canopy, metres; a fourth
    is a density, by which each part of the way then counts.
    spans_m: ``fill_spans``: where a line is above or below them nothing is looked at. earth: (cell east, cell north,
    curvature drop per m²).
    """
    rows, cols, columns = layers.shape
    posts = layers.reshape(rows * cols, columns)
    n = lines.shape[0]
    for block in prange((n + BLOCK - 1) // BLOCK):
        for i in range(block * BLOCK, min((block + 1) * BLOCK, n)):
            start, end = grid_point(lines[i], 0), grid_point(lines[i], 1)
            shares[i] = _share(posts, (rows, cols), spans_m, earth, start, end)
