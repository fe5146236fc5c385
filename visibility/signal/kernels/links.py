"""Links over the triangulated ground, many at once: what diffraction costs them, on ground and over roofs."""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.sight.kernels.crossings import (
    GRAZING_TOLERANCE_M,
    clip_to_grid,
    crossing,
    end_ground,
    families,
    grid_point,
    is_inside,
    step_between,
)
from visibility.sight.kernels.roofs import edge_crossing, highest_roof, square_of
from visibility.signal.kernels.diffraction import SUMS, clear_sums, diffraction_loss, put_ground, put_obstacle

__all__ = ["BITS", "LEAVES_GRID", "LOSS", "OVER_UNKNOWN", "diffraction_losses"]

# what else happened to a link, as bits
OVER_UNKNOWN, LEAVES_GRID = 1, 2
BLOCK = 64  # links that one thread takes at a time
FROM, TO = 0, 1  # ends of a link
ROW, COL, ALTITUDE = 0, 1, 2
LOSS, BITS = 0, 1  # columns of what is found


@scalar_kernel
def _put_family(sums, flat_m, family, line, whole):
    """Add the ground at the crossings of one Family; returns whether some is unknown.

    line: (altitude at its start, rise to its end, four times the body's bulge in its middle, drop per m²). whole: these
    crossings are the profile whose integrals count.
    """
    from_m, rise_m, sag_m, drop_per_m2 = line
    unknown = False
    for k in range(family.crossings):
        t, ground_m, bulge_m2 = crossing(flat_m, family, k)
        if math.isnan(ground_m):
            unknown = True
            continue
        bulge_m = sag_m * t * (1.0 - t) - drop_per_m2 * bulge_m2
        above_m = ground_m + bulge_m - from_m - t * rise_m
        if whole:
            put_ground(sums, t, ground_m, above_m, bulge_m)
        else:
            put_obstacle(sums, t, above_m, bulge_m)
    return unknown


@scalar_kernel
def _put_roofs(sums, edges, buckets, start, step, sag_m):
    """Add the edges of roofs that a line from start to start + step, (3,) row, col, altitude, crosses."""
    low, size = buckets.low_row, buckets.size
    row_from, row_to = min(start[ROW], start[ROW] + step[ROW]), max(start[ROW], start[ROW] + step[ROW])
    if row_to < low or row_from > low + size * buckets.high:
        return
    for i in range(square_of(row_from, low, size, buckets.high), square_of(row_to, low, size, buckets.high) + 1):
        near, far = 0.0, 1.0
        if step[ROW] != 0.0:
            one, other = (low + i * size - start[ROW]) / step[ROW], (low + (i + 1) * size - start[ROW]) / step[ROW]
            near, far = max(min(one, other), 0.0), min(max(one, other), 1.0)
        left, right = start[COL] + near * step[COL], start[COL] + far * step[COL]
        left, right = min(left, right) - 1e-6, max(left, right) + 1e-6
        if right < buckets.low_col or left > buckets.low_col + size * buckets.wide:
            continue
        for j in range(
            square_of(left, buckets.low_col, size, buckets.wide),
            square_of(right, buckets.low_col, size, buckets.wide) + 1,
        ):
            square = i * buckets.wide + j
            for at in range(buckets.starts[square], buckets.starts[square + 1]):
                t, roof_m = edge_crossing(edges[buckets.numbers[at]], start, step)
                if not math.isnan(t):
                    bulge_m = sag_m * t * (1.0 - t)
                    put_obstacle(sums, t, roof_m + bulge_m - start[ALTITUDE] - t * step[ALTITUDE], bulge_m)


@scalar_kernel
def _put_end(sums, heights_m, cells_m, point, t):
    """(whether an end is below the ground, bits): adds the ground under it."""
    if not is_inside(heights_m.shape, point[ROW], point[COL]):
        return False, LEAVES_GRID
    ground_m, _ = end_ground(heights_m, cells_m, point[ROW], point[COL])
    if math.isnan(ground_m):
        return False, OVER_UNKNOWN
    put_ground(sums, t, ground_m, ground_m - point[ALTITUDE], 0.0)
    return ground_m > point[ALTITUDE] + GRAZING_TOLERANCE_M, 0


@scalar_kernel
def _profile(heights_m, cells_m, drop_per_m2, link, sums):
    """(whether an end is below the ground, bits, horizontal distance) of a link (2, 3); fills sums with its ground."""
    start, end = grid_point(link, 0), grid_point(link, 1)
    step = step_between(start, end)
    cell_east_m, cell_north_m = cells_m
    reach_m = math.hypot(step.col * cell_east_m, step.row * cell_north_m)
    line = (start.altitude_m, step.altitude_m, drop_per_m2 * reach_m * reach_m, drop_per_m2)
    flat_m = heights_m.ravel()
    clear_sums(sums)
    below, bits = _put_end(sums, heights_m, cells_m, link[FROM], 0.0)
    within = clip_to_grid(heights_m.shape, start, step)
    by_row, by_col, diagonal = families(heights_m.shape, cells_m, start, step, within)
    most = max(by_row.crossings, by_col.crossings, diagonal.crossings)
    rows_most = by_row.crossings == most
    cols_most = by_col.crossings == most and not rows_most
    unknown = _put_family(sums, flat_m, by_row, line, rows_most)
    unknown |= _put_family(sums, flat_m, by_col, line, cols_most)
    unknown |= _put_family(sums, flat_m, diagonal, line, not (rows_most or cols_most))
    end_below, end_bits = _put_end(sums, heights_m, cells_m, link[TO], 1.0)
    bits |= end_bits | (OVER_UNKNOWN if unknown else 0)
    return below or end_below, bits, reach_m


@parallel_kernel
def diffraction_losses(heights_m, wave, edges, edge_buckets, triangles, roof_buckets, links, found):
    """Fill found (n, 2), LOSS in dB and BITS, of links (n, 2, 3): row, col, altitude of both ends.

    wave: (cell east, cell north, curvature drop per m², wavelength in m, whether polarised vertically). edges,
    triangles: of roofs, and where to look for them; empty without buildings. An end below the ground or a roof loses
    everything: +inf.
    """
    cell_east_m, cell_north_m, drop_per_m2, wavelength_m, vertical = wave
    radius_m = 1.0 / (2.0 * drop_per_m2) if drop_per_m2 > 0.0 else math.inf
    n = links.shape[0]
    for block in prange((n + BLOCK - 1) // BLOCK):
        sums = np.zeros(SUMS)
        for i in range(block * BLOCK, min((block + 1) * BLOCK, n)):
            link = links[i]
            below, bits, reach_m = _profile(heights_m, (cell_east_m, cell_north_m), drop_per_m2, link, sums)
            if triangles.shape[0] > 0:
                for end in range(2):
                    roof_m = highest_roof(triangles, roof_buckets, link[end, ROW], link[end, COL])
                    below = below or roof_m > link[end, ALTITUDE] + GRAZING_TOLERANCE_M
                sag_m = drop_per_m2 * reach_m * reach_m
                _put_roofs(sums, edges, edge_buckets, link[FROM], link[TO] - link[FROM], sag_m)
            ends_m = (link[FROM, ALTITUDE], link[TO, ALTITUDE])
            loss_db = diffraction_loss(sums, reach_m, ends_m, radius_m, wavelength_m, vertical)
            found[i, LOSS], found[i, BITS] = math.inf if below else loss_db, bits
