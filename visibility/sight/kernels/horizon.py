"""The horizon seen from an eye, as an upper envelope of straight pieces in perspective coordinates.

Along one sector, w is the distance from the eye along the sector axis and u across it, both in posts. A point of height
h appears at t = u / w (bearing) and s = (h - eye altitude) / w (slope). Perspective keeps lines straight, so every edge
of the triangulated surface appears as one straight piece s = p + q t between two bearings, and the horizon over any set
of edges is the upper envelope of their pieces. A horizon of n pieces is three arrays: start (n + 1 bearings, the last
one closes it), p and q (n); p = -inf where nothing has been met.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import uint64

from compiled.options import inner_loop, scalar_kernel

__all__ = ["Horizon", "Pieces", "merge", "new_horizon", "start_over"]


class Horizon(NamedTuple):
    """Where each piece starts, and the last one ends: (n + 1,) bearings; p and q (n,) of the pieces."""

    start: Any
    p: Any
    q: Any


class Pieces(NamedTuple):
    """Pieces to be merged into a horizon: from bearing to bearing, p and q, (n,) each."""

    start: Any
    stop: Any
    p: Any
    q: Any


@scalar_kernel
def new_horizon(room):
    """A horizon with room for so many pieces, none of which is there yet."""
    return Horizon(np.zeros(room), np.zeros(room), np.zeros(room))


@scalar_kernel
def start_over(horizon, lowest, highest):
    """Make a horizon one piece between two bearings at which nothing has been met; returns its size."""
    horizon.p[0], horizon.q[0] = -math.inf, 0.0
    horizon.start[:2] = lowest, highest
    return 1


@scalar_kernel
def _emit(start, p, q, n, bearing, new_p, new_q):
    """Append a piece that starts at a bearing; pieces that carry on are not repeated, empty ones are dropped."""
    while n > 0 and start[n - 1] >= bearing:
        n -= 1
    if n > 0 and p[n - 1] == new_p and q[n - 1] == new_q:
        return n
    start[n] = bearing
    p[n] = new_p
    q[n] = new_q
    return n + 1


@inner_loop
def _copied(horizon, first, stop, out, size):
    """Append pieces [first, stop) of a horizon to another of some size; returns its new one."""
    start, p, q = horizon
    out_start, out_p, out_q = out
    for k in range(stop - first):
        here, there = uint64(first + k), uint64(size + k)
        out_start[there], out_p[there], out_q[there] = start[here], p[here], q[here]
    return size + max(stop - first, 0)


@scalar_kernel
def merge(horizon, n, pieces, count, out):
    """Upper envelope of a horizon and of pieces sorted by bearing that do not overlap; returns its size.

    horizon, out: Horizons, out with room for 2 n + 4 count + 8. pieces: Pieces of which the first count are used.
    """
    start, hp, hq = horizon
    piece_from, piece_to, piece_p, piece_q = pieces
    out_start, out_p, out_q = out
    end = start[n]
    size = 0
    k = 0
    x = start[0]
    for i in range(count):
        low, high = piece_from[i], min(piece_to[i], end)
        p, q = piece_p[i], piece_q[i]
        if k < n - 1 and start[k + 1] <= low:
            size = _emit(out_start, out_p, out_q, size, max(x, start[k]), hp[k], hq[k])
            k += 1
            # between pieces the horizon stays as it is
            stays = k
            while k < n - 1 and start[k + 1] <= low:
                k += 1
            size = _copied(horizon, stays, k, out, size)
        if x < low:
            size = _emit(out_start, out_p, out_q, size, max(x, start[k]), hp[k], hq[k])
            x = low
        while x < high:
            edge = min(start[k + 1], high)
            over = (p + q * x) - (hp[k] + hq[k] * x)
            over_end = (p + q * edge) - (hp[k] + hq[k] * edge)
            if over <= 0.0 and over_end <= 0.0:
                size = _emit(out_start, out_p, out_q, size, x, hp[k], hq[k])
            elif over >= 0.0 and over_end >= 0.0:
                size = _emit(out_start, out_p, out_q, size, x, p, q)
            else:
                crossing = min(max(x + (edge - x) * (over / (over - over_end)), x), edge)
                if over > 0.0:
                    size = _emit(out_start, out_p, out_q, size, x, p, q)
                    size = _emit(out_start, out_p, out_q, size, crossing, hp[k], hq[k])
                else:
                    size = _emit(out_start, out_p, out_q, size, x, hp[k], hq[k])
                    size = _emit(out_start, out_p, out_q, size, crossing, p, q)
            x = edge
            if k < n - 1 and start[k + 1] <= x:
                k += 1
            elif edge >= end:
                break
    if k < n and max(x, start[k]) < end:
        size = _emit(out_start, out_p, out_q, size, max(x, start[k]), hp[k], hq[k])
    size = _copied(horizon, k + 1, n, out, size)
    out_start[size] = end
    return size
