"""Roofs in the way: what they hide behind them on a grid, and how far below lines they stay.

A roof's edge (n, 2, 3) and a roof's triangle (m, 3, 3) are corners of (row, col, altitude). Of a vertical section
through a solid that reaches the ground, the highest place above any line lies over an edge, or under the line's end.
Curvature bends roofs as it bends the ground; what it does within one edge is below a tenth of a millimetre.
"""

import math
from typing import Any, NamedTuple

from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = [
    "Buckets",
    "cast_shadows",
    "cover_posts",
    "cover_squares",
    "edge_crossing",
    "fill_buckets",
    "highest_roof",
    "scan_roofs",
    "square_of",
]

BAND = 16  # rows of posts that one thread fills at a time
BLOCK = 64  # lines that one thread takes at a time
SEAM = 1e-9  # of an edge: no line slips between two edges that meet
ROW, COL, ALTITUDE = 0, 1, 2
FROM, TO, THIRD = 0, 1, 2  # corners of an edge, or of a triangle; the ends of a line
TOP, BOTTOM, LEFT, RIGHT = 0, 1, 2, 3  # sides of a box, posts
CLEARANCE, SHARE, GROUND, ZONE = 0, 1, 2, 3  # columns of what is found for a line


class Buckets(NamedTuple):
    """Numbers of shapes by square of the map: of square (i, j) those from starts[i·wide + j] to the next.

    tops: of each square, the highest altitude of its shapes. low: row and col of the first square's corner; size: of a
    square, posts.
    """

    starts: Any
    numbers: Any
    tops: Any
    low_row: Any
    low_col: Any
    size: Any
    high: Any
    wide: Any


@scalar_kernel
def _in_columns(alpha, beta, low, high):
    """The part of columns low..high where alpha·col >= beta; empty (low > high) where that is nowhere."""
    if alpha > 0.0:
        return max(low, beta / alpha), high
    if alpha < 0.0:
        return low, min(high, beta / alpha)
    return (low, high) if beta <= 0.0 else (1.0, 0.0)


@scalar_kernel
def _shadow(edge, eye, drops, rows, out):
    """Raise out (rows, cols) behind one edge, on rows first..last."""
    first, last = rows
    drop_per_row2_m, drop_per_col2_m = drops
    a_row, a_col, a_m = edge[FROM, ROW] - eye[ROW], edge[FROM, COL] - eye[COL], edge[FROM, ALTITUDE]
    b_row, b_col, b_m = edge[TO, ROW] - eye[ROW], edge[TO, COL] - eye[COL], edge[TO, ALTITUDE]
    if a_row * b_col - a_col * b_row < 0.0:
        a_row, a_col, a_m, b_row, b_col, b_m = b_row, b_col, b_m, a_row, a_col, a_m
    area = a_row * b_col - a_col * b_row
    d_row, d_col = b_row - a_row, b_col - a_col
    if not area > SEAM * (abs(d_row) + abs(d_col)):
        return  # seen from its end, where its neighbours are as high
    lowest, highest = min(a_row, b_row), max(a_row, b_row)
    if lowest >= 0.0:
        first = max(first, math.ceil(lowest + eye[ROW]))
    if highest <= 0.0:
        last = min(last, math.floor(highest + eye[ROW]))
    wide = out.shape[1] - 1.0
    for row in range(first, last + 1):
        p_row = row - eye[ROW]
        low, high = _in_columns(a_row, a_col * p_row, -eye[COL], wide - eye[COL])
        low, high = _in_columns(-b_row, -b_col * p_row, low, high)
        low, high = _in_columns(-d_row, area - d_col * p_row, low, high)
        for col in range(max(math.ceil(low + eye[COL] - 1e-6), 0), min(math.floor(high + eye[COL] + 1e-6), wide) + 1):
            p_col = col - eye[COL]
            beyond = p_row * d_col - p_col * d_row  # over area: how many times as far as the edge
            if beyond < area * (1.0 - 1e-12):
                continue
            along = (a_row * p_col - a_col * p_row) / beyond
            if not -SEAM <= along <= 1.0 + SEAM:
                continue
            roof_m = a_m + min(max(along, 0.0), 1.0) * (b_m - a_m)
            drop_m = drop_per_row2_m * p_row * p_row + drop_per_col2_m * p_col * p_col
            clear_m = eye[ALTITUDE] + (roof_m - eye[ALTITUDE]) * (beyond / area) + drop_m * (1.0 - area / beyond)
            if clear_m > out[row, col]:
                out[row, col] = clear_m


@parallel_kernel
def cast_shadows(edges, eyes, drops, out):
    """Raise out (k, rows, cols), NaN apart, to the altitude that clears every edge on the way to each eye.

    eyes: (k, 3) row, col, altitude. drops: curvature drop per squared row and column step.
    """
    bands = (out.shape[1] + BAND - 1) // BAND
    for task in prange(out.shape[0] * bands):
        k, band = task // bands, task % bands
        rows = (band * BAND, min((band + 1) * BAND, out.shape[1]) - 1)
        for number in range(edges.shape[0]):
            _shadow(edges[number], eyes[k], drops, rows, out[k])


@scalar_kernel
def _roof_over(triangle, row, col):
    """Altitude of a triangle at a place, borders included; -inf where it is not over it."""
    a_row, a_col = triangle[FROM, ROW], triangle[FROM, COL]
    b_row, b_col = triangle[TO, ROW] - a_row, triangle[TO, COL] - a_col
    c_row, c_col = triangle[THIRD, ROW] - a_row, triangle[THIRD, COL] - a_col
    area = b_row * c_col - b_col * c_row
    if area == 0.0:
        return -math.inf
    v = ((row - a_row) * c_col - (col - a_col) * c_row) / area
    w = (b_row * (col - a_col) - b_col * (row - a_row)) / area
    if v < -SEAM or w < -SEAM or v + w > 1.0 + SEAM:
        return -math.inf
    base_m = triangle[FROM, ALTITUDE]
    return base_m + v * (triangle[TO, ALTITUDE] - base_m) + w * (triangle[THIRD, ALTITUDE] - base_m)


@scalar_kernel
def cover_posts(triangles, out):
    """Raise out (rows, cols) to the highest roof over each post."""
    rows, cols = out.shape
    for number in range(triangles.shape[0]):
        triangle = triangles[number]
        top, bottom = triangle[:, ROW].min(), triangle[:, ROW].max()
        left, right = triangle[:, COL].min(), triangle[:, COL].max()
        for row in range(max(math.ceil(top - 1e-6), 0), min(math.floor(bottom + 1e-6), rows - 1) + 1):
            for col in range(max(math.ceil(left - 1e-6), 0), min(math.floor(right + 1e-6), cols - 1) + 1):
                out[row, col] = max(out[row, col], _roof_over(triangle, float(row), float(col)))


@scalar_kernel
def cover_squares(triangles, out):
    """Raise the four posts of every square of out (rows, cols) that a triangle may touch to its highest corner."""
    rows, cols = out.shape
    for number in range(triangles.shape[0]):
        triangle = triangles[number]
        top_m = triangle[:, ALTITUDE].max()
        for row in range(
            max(math.floor(triangle[:, ROW].min()), 0), min(math.ceil(triangle[:, ROW].max()), rows - 1) + 1
        ):
            for col in range(
                max(math.floor(triangle[:, COL].min()), 0), min(math.ceil(triangle[:, COL].max()), cols - 1) + 1
            ):
                out[row, col] = max(out[row, col], top_m)


@scalar_kernel
def square_of(value, low, size, count):
    """Number of the square along one axis in which a row or column is; the nearest for one beyond them."""
    return min(max(int((value - low) / size), 0), count - 1)


@scalar_kernel
def fill_buckets(boxes, tops, buckets, counted):
    """Put the number of every shape into the squares that its box (n, 4: TOP, BOTTOM, LEFT, RIGHT) touches.

    tops: (n,) the highest altitude of each.

    counted: whether starts are ready; otherwise it fills starts[square + 1] with counts, and numbers is not written.
    """
    for number in range(boxes.shape[0]):
        for i in range(
            square_of(boxes[number, TOP], buckets.low_row, buckets.size, buckets.high),
            square_of(boxes[number, BOTTOM], buckets.low_row, buckets.size, buckets.high) + 1,
        ):
            for j in range(
                square_of(boxes[number, LEFT], buckets.low_col, buckets.size, buckets.wide),
                square_of(boxes[number, RIGHT], buckets.low_col, buckets.size, buckets.wide) + 1,
            ):
                square = i * buckets.wide + j
                if counted:
                    buckets.numbers[buckets.starts[square]] = number
                    buckets.starts[square] += 1
                    buckets.tops[square] = max(buckets.tops[square], tops[number])
                else:
                    buckets.starts[square + 1] += 1


@scalar_kernel
def highest_roof(triangles, buckets, row, col):
    """The highest roof over a place; -inf without one."""
    i, j = math.floor((row - buckets.low_row) / buckets.size), math.floor((col - buckets.low_col) / buckets.size)
    highest = -math.inf
    if 0 <= i < buckets.high and 0 <= j < buckets.wide:
        square = i * buckets.wide + j
        for at in range(buckets.starts[square], buckets.starts[square + 1]):
            highest = max(highest, _roof_over(triangles[buckets.numbers[at]], row, col))
    return highest


@scalar_kernel
def edge_crossing(edge, start, step):
    """(share of the way, altitude of the edge) where a line crosses an edge in plan; share NaN where it does not."""
    d_row, d_col = edge[TO, ROW] - edge[FROM, ROW], edge[TO, COL] - edge[FROM, COL]
    area = step[ROW] * d_col - step[COL] * d_row
    if area == 0.0:
        return math.nan, 0.0
    f_row, f_col = edge[FROM, ROW] - start[ROW], edge[FROM, COL] - start[COL]
    share = (f_row * d_col - f_col * d_row) / area
    along = (f_row * step[COL] - f_col * step[ROW]) / area
    if not (0.0 <= share <= 1.0 and -SEAM <= along <= 1.0 + SEAM):
        return math.nan, 0.0
    return share, edge[FROM, ALTITUDE] + min(max(along, 0.0), 1.0) * (edge[TO, ALTITUDE] - edge[FROM, ALTITUDE])


@scalar_kernel
def _least(edges, buckets, start, step, sag_m, found):
    """Lower what is found (4,) by the edges that a line crosses."""
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
        line_m = start[ALTITUDE] + min(near * step[ALTITUDE], far * step[ALTITUDE]) - 0.25 * sag_m
        for j in range(
            square_of(left, buckets.low_col, size, buckets.wide),
            square_of(right, buckets.low_col, size, buckets.wide) + 1,
        ):
            square = i * buckets.wide + j
            over_m = line_m - buckets.tops[square]  # nothing in the square comes nearer, and its zone is no narrower
            if over_m > 0.0 and over_m >= found[CLEARANCE] and 2.0 * over_m >= found[ZONE]:
                continue
            for at in range(buckets.starts[square], buckets.starts[square + 1]):
                share, roof_m = edge_crossing(edges[buckets.numbers[at]], start, step)
                if not math.isnan(share):
                    free = share * (1.0 - share)
                    clear_m = start[ALTITUDE] + share * step[ALTITUDE] - roof_m - sag_m * free
                    if clear_m < found[CLEARANCE]:
                        found[CLEARANCE], found[SHARE], found[GROUND] = clear_m, share, roof_m
                    if free > 0.0:
                        found[ZONE] = min(found[ZONE], clear_m / math.sqrt(free))


@parallel_kernel
def scan_roofs(edges, edge_buckets, triangles, roof_buckets, lines, sags_m, found):
    """Fill found (n, 4): least CLEARANCE of each line over roofs, its SHARE of the way, the roof there, and ZONE.

    lines: (n, 2, 3) start and end as row, col, altitude. sags_m: (n,) how far curvature bends each, c·distance².
    ZONE: least of clearance / sqrt(share·(1 - share)). Where no roof is met: +inf, NaN, NaN, +inf.
    """
    n = lines.shape[0]
    for block in prange((n + BLOCK - 1) // BLOCK):
        for i in range(block * BLOCK, min((block + 1) * BLOCK, n)):
            start, step = lines[i, FROM], lines[i, TO] - lines[i, FROM]
            found[i, CLEARANCE], found[i, ZONE] = math.inf, math.inf
            found[i, SHARE], found[i, GROUND] = math.nan, math.nan
            for end in range(2):
                roof_m = highest_roof(triangles, roof_buckets, lines[i, end, ROW], lines[i, end, COL])
                clear_m = lines[i, end, ALTITUDE] - roof_m
                if clear_m < found[i, CLEARANCE]:
                    found[i, CLEARANCE], found[i, SHARE], found[i, GROUND] = clear_m, float(end), roof_m
                    if clear_m < 0.0:
                        found[i, ZONE] = -math.inf
            _least(edges, edge_buckets, start, step, sags_m[i], found[i])
