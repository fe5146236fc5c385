"""Straight segments over the triangulated ground: what they cross, whether that may be driven, and what it costs.

A field is a ``planning.paths.fields.KernelField``, whose fields are named there. Places are fractional posts (row,
col). Directions are unit vectors (east, north).
"""

import math

from compiled.options import scalar_kernel

__all__ = [
    "CLEAR",
    "EDGE",
    "FORBIDDEN",
    "TOO_STEEP",
    "TOO_TILTED",
    "cost_within",
    "heading_allowed",
    "segment_cost",
    "segment_within",
    "square_allowed",
    "square_gradients",
    "step_cost",
    "tally",
]

# a place this near a line between squares is on it, in cells
EDGE = 1e-9
# what a segment's code says
CLEAR, FORBIDDEN, TOO_STEEP, TOO_TILTED = 0, 1, 2, 3


@scalar_kernel
def square_gradients(heights_m, cells, row, col):
    """(east, north) rise per metre of the triangles west and east of a square's diagonal: four numbers."""
    north_west, north_east = float(heights_m[row, col]), float(heights_m[row, col + 1])
    south_west, south_east = float(heights_m[row + 1, col]), float(heights_m[row + 1, col + 1])
    return (
        (south_east - south_west) / cells.east_m,
        (north_west - south_west) / cells.north_m,
        (north_east - north_west) / cells.east_m,
        (north_east - south_east) / cells.north_m,
    )


@scalar_kernel
def square_allowed(allowed, row, col):
    """Whether a square is inside the grid and may be driven."""
    return 0 <= row < allowed.shape[0] and 0 <= col < allowed.shape[1] and allowed[row, col] == 1


@scalar_kernel
def heading_allowed(field, row, col, east, north):
    """CLEAR, TOO_STEEP or TOO_TILTED: whether both triangles of a square may be driven in a direction."""
    rates = field.rates
    if rates.max_pitch == math.inf and rates.max_roll == math.inf:
        return CLEAR
    west_e, west_n, east_e, east_n = square_gradients(field.heights_m, field.cells, row, col)
    if max(abs(west_e * east + west_n * north), abs(east_e * east + east_n * north)) > rates.max_pitch:
        return TOO_STEEP
    if max(abs(west_n * east - west_e * north), abs(east_n * east - east_e * north)) > rates.max_roll:
        return TOO_TILTED
    return CLEAR


@scalar_kernel
def _may_cross(field, row, col, east, north):
    if not square_allowed(field.allowed, row, col):
        return FORBIDDEN
    return heading_allowed(field, row, col, east, north)


@scalar_kernel
def _squares_around(field, row, col, east, north):
    """Code of the squares that touch a place: two where it lies on a line between squares, four at a post.

    On the border of the grid those inside count alone; outside it a place is FORBIDDEN.
    """
    rows, cols = field.allowed.shape
    if not (-EDGE <= row <= rows + EDGE and -EDGE <= col <= cols + EDGE):
        return FORBIDDEN
    near_row, near_col = math.floor(row + 0.5), math.floor(col + 0.5)
    top, left = math.floor(row), math.floor(col)
    first_row, last_row = (int(near_row) - 1, int(near_row)) if abs(row - near_row) < EDGE else (top, top)
    first_col, last_col = (int(near_col) - 1, int(near_col)) if abs(col - near_col) < EDGE else (left, left)
    for r in range(max(first_row, 0), min(last_row + 1, rows)):
        for c in range(max(first_col, 0), min(last_col + 1, cols)):
            code = _may_cross(field, r, c, east, north)
            if code != CLEAR:
                return code
    return CLEAR


@scalar_kernel
def pace_at(pace, steepest, tangent):
    """Seconds per horizontal metre at a slope along the way."""
    place = (min(max(tangent / steepest, -1.0), 1.0) + 1.0) * 0.5 * (pace.shape[0] - 1)
    below = min(int(place), pace.shape[0] - 2)
    return pace[below] + (place - below) * (pace[below + 1] - pace[below])


@scalar_kernel
def _first_line(start, step):
    """The share at which the first whole number is met after the start, of a coordinate start + share · step."""
    if step == 0.0:
        return math.inf
    line = math.floor(start + EDGE) + 1.0 if step > 0.0 else math.ceil(start - EDGE) - 1.0
    return (line - start) / step


@scalar_kernel
def _middle_code(field, row, col, east, north):
    """(code, row, col) of the square that the middle of a piece lies in; of all it touches where it runs on a line."""
    r, c = int(row), int(col)
    if EDGE < row - r < 1.0 - EDGE and EDGE < col - c < 1.0 - EDGE:
        return _may_cross(field, r, c, east, north), r, c
    rows, cols = field.allowed.shape
    return _squares_around(field, row, col, east, north), min(r, rows - 1), min(c, cols - 1)


@scalar_kernel
def segment_within(field, row0, col0, row1, col1, most):
    """As ``segment_cost``, of a segment that is of no interest once it costs more than ``most``."""
    heights_m, _, added, hidden, cells, rates, pace = field
    down, across = row1 - row0, col1 - col0
    east_m, north_m = across * cells.east_m, -down * cells.north_m
    length_m = math.sqrt(east_m * east_m + north_m * north_m)
    if length_m == 0.0:
        code = _squares_around(field, row0, col0, 0.0, 0.0)
        return code, (0.0 if code == CLEAR else math.inf), 0.0, 0.0, 0.0, 0.0
    east, north = east_m / length_m, north_m / length_m
    cost, seconds, dark, ground_m, climb_m = 0.0, 0.0, 0.0, 0.0, 0.0
    code = _squares_around(field, row0, col0, east, north)
    if code == CLEAR:
        code = _squares_around(field, row1, col1, east, north)
    at_row, at_col, at_diagonal = (
        _first_line(row0, down),
        _first_line(col0, across),
        _first_line(row0 - col0, down - across),
    )
    every_row = math.inf if down == 0.0 else 1.0 / abs(down)
    every_col = math.inf if across == 0.0 else 1.0 / abs(across)
    every_diagonal = math.inf if down == across else 1.0 / abs(down - across)
    hair = EDGE / (abs(down) + abs(across))
    share = 0.0
    while code == CLEAR and share < 1.0 and cost <= most:
        after = min(at_row, at_col, at_diagonal, 1.0)
        middle = 0.5 * (share + after)
        row, col = row0 + middle * down, col0 + middle * across
        code, r, c = _middle_code(field, row, col, east, north)
        if code != CLEAR:
            break
        if row - r >= col - c:
            south = float(heights_m[r + 1, c])
            tangent = (float(heights_m[r + 1, c + 1]) - south) * east / cells.east_m
            tangent += (float(heights_m[r, c]) - south) * north / cells.north_m
        else:
            north_east = float(heights_m[r, c + 1])
            tangent = (north_east - float(heights_m[r, c])) * east / cells.east_m
            tangent += (north_east - float(heights_m[r + 1, c + 1])) * north / cells.north_m
        flat_m = (after - share) * length_m
        piece_m = flat_m * math.sqrt(1.0 + tangent * tangent)
        piece_s = flat_m * pace_at(pace, rates.steepest, tangent)
        ground_m += piece_m
        seconds += piece_s
        climb_m += flat_m * max(tangent, 0.0)
        cost += piece_m * (rates.per_m + float(added[r, c])) + piece_s * rates.per_s
        cost += flat_m * max(tangent, 0.0) * rates.per_climbed_m
        if hidden[r, c]:
            dark += piece_s
            cost += piece_s * rates.per_dark_s
        share = after
        over_row, over_col = at_row <= share + hair, at_col <= share + hair
        if over_row and over_col and share < 1.0:
            code = _squares_around(field, row0 + share * down, col0 + share * across, east, north)
        if over_row:
            at_row += every_row
        if over_col:
            at_col += every_col
        if at_diagonal <= share + hair:
            at_diagonal += every_diagonal
    return code, (cost if code == CLEAR else math.inf), seconds, dark, ground_m, climb_m


@scalar_kernel
def cost_within(field, row0, col0, row1, col1, most):
    """The cost alone of a segment that is of no interest once it costs more than ``most``."""
    _, cost, _, _, _, _ = segment_within(field, row0, col0, row1, col1, most)
    return cost


@scalar_kernel
def segment_cost(field, row0, col0, row1, col1):
    """(code, cost, seconds, seconds out of sight, metres on the ground, metres climbed) of a segment.

    The lines between triangles are three families of parallels: whole rows, whole columns, whole row - col. Exact in
    each triangle; a segment that is not CLEAR costs +inf, and the rest is as far as it got. Where it runs on a line
    between squares, both have to be allowed, and all four around a post that it passes.
    """
    return segment_within(field, row0, col0, row1, col1, math.inf)


@scalar_kernel
def _half_cost(field, row, col, on_east, heading, flat_m):
    """Cost of flat_m within one triangle of a square, east or west of its diagonal, along a heading (east, north)."""
    _, _, added, hidden, cells, rates, pace = field
    west_e, west_n, east_e, east_n = square_gradients(field.heights_m, cells, row, col)
    east, north = heading
    tangent = east_e * east + east_n * north if on_east else west_e * east + west_n * north
    cost = math.sqrt(1.0 + tangent * tangent) * (rates.per_m + float(added[row, col]))
    cost += max(tangent, 0.0) * rates.per_climbed_m
    paid_s = rates.per_s + (rates.per_dark_s if hidden[row, col] else 0.0)
    if paid_s > 0.0:
        cost += pace_at(pace, rates.steepest, tangent) * paid_s
    return cost * flat_m


@scalar_kernel
def step_cost(field, row, col, r, c):
    """What ``segment_cost`` says of the way between the middles of two squares that touch; +inf where not allowed."""
    cells = field.cells
    east_m, north_m = (c - col) * cells.east_m, (row - r) * cells.north_m
    flat_m = math.sqrt(east_m * east_m + north_m * north_m)
    east, north = east_m / flat_m, north_m / flat_m
    for by_row in range(min(row, r), max(row, r) + 1):
        for by_col in range(min(col, c), max(col, c) + 1):
            if _may_cross(field, by_row, by_col, east, north) != CLEAR:
                return math.inf
    # towards north and east the way leaves a square through its east triangle and enters the next by the west one
    leaves_east = c > col or (c == col and r < row) if (c - col) * (r - row) <= 0 else False
    half_m = 0.5 * flat_m
    away = _half_cost(field, row, col, leaves_east, (east, north), half_m)
    return away + _half_cost(field, r, c, not leaves_east, (east, north), half_m)


@scalar_kernel
def tally(field, places, sums):
    """Fill sums, each (n,), with running sums of ``segment_cost`` along places (n, 2), its code the worst so far."""
    worst, cost, seconds, dark_s, ground_m, climb_m = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(places.shape[0]):
        if i > 0:
            found = segment_cost(field, places[i - 1, 0], places[i - 1, 1], places[i, 0], places[i, 1])
            code, piece_cost, piece_s, piece_dark_s, piece_m, piece_climb_m = found
            worst, cost, seconds = max(worst, float(code)), cost + piece_cost, seconds + piece_s
            dark_s, ground_m, climb_m = dark_s + piece_dark_s, ground_m + piece_m, climb_m + piece_climb_m
        sums.code[i], sums.cost[i], sums.time_s[i], sums.dark_s[i] = worst, cost, seconds, dark_s
        sums.ground_m[i], sums.climb_m[i] = ground_m, climb_m
