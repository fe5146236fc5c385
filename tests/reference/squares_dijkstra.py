"""Cheapest ways over squares of posts, the plain way: costs summed over many tiny steps, Dijkstra over a dictionary."""

from __future__ import annotations

import heapq
import math

import numpy as np


def tangent_along(heights_m: np.ndarray, cells: tuple[float, float], row: float, col: float, way: tuple[float, float]):
    """Rise per horizontal metre of the triangle around a place, along a unit way (east, north)."""
    r, c = int(row), int(col)
    corner, far = float(heights_m[r, c]), float(heights_m[r + 1, c + 1])
    if row - r >= col - c:
        third = float(heights_m[r + 1, c])
        east, north = (far - third) / cells[0], (corner - third) / cells[1]
    else:
        third = float(heights_m[r, c + 1])
        east, north = (third - corner) / cells[0], (third - far) / cells[1]
    return east * way[0] + north * way[1]


def segment_cost(heights_m, allowed, cells, weights, begin, end, steps: int = 4000) -> float:
    """length · metres on the ground + climb · metres climbed, by the midpoint rule; inf where a square is forbidden."""
    down, across = end[0] - begin[0], end[1] - begin[1]
    east_m, north_m = across * cells[0], -down * cells[1]
    flat_m = math.hypot(east_m, north_m)
    way = (east_m / flat_m, north_m / flat_m)
    total = 0.0
    for n in range(steps):
        share = (n + 0.5) / steps
        row, col = begin[0] + share * down, begin[1] + share * across
        if not allowed[int(row), int(col)]:
            return math.inf
        tangent = tangent_along(heights_m, cells, row, col, way)
        total += weights[0] * math.sqrt(1.0 + tangent**2) + weights[1] * max(tangent, 0.0)
    return total * flat_m / steps


def reachable(allowed: np.ndarray, start: tuple[int, int]) -> set[tuple[int, int]]:
    """Squares that are joined with a square by their sides."""
    seen, rest = {start}, [start]
    while rest:
        row, col = rest.pop()
        for r, c in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
            inside = 0 <= r < allowed.shape[0] and 0 <= c < allowed.shape[1]
            if inside and allowed[r, c] and (r, c) not in seen:
                seen.add((r, c))
                rest.append((r, c))
    return seen


def cheapest(heights_m, allowed, cells, weights, start: tuple[int, int], goal: tuple[int, int]) -> float:
    """Cost between the middles of two squares over the eight neighbours; no corner of a forbidden square is cut."""
    known = {start: 0.0}
    rest = [(0.0, start)]
    while rest:
        cost, (row, col) = heapq.heappop(rest)
        if (row, col) == goal:
            return cost
        if cost > known[row, col]:
            continue
        for d in (-1, 0, 1):
            for e in (-1, 0, 1):
                r, c = row + d, col + e
                inside = 0 <= r < allowed.shape[0] and 0 <= c < allowed.shape[1]
                if not inside or not (allowed[r, c] and allowed[row, c] and allowed[r, col]) or (d, e) == (0, 0):
                    continue
                begin, end = (row + 0.5, col + 0.5), (r + 0.5, c + 0.5)
                step = segment_cost(heights_m, allowed, cells, weights, begin, end, 20)
                if cost + step < known.get((r, c), math.inf):
                    known[r, c] = cost + step
                    heapq.heappush(rest, (cost + step, (r, c)))
    return math.inf


def least_worst(value: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> float:
    """The least limit under which squares with at most that value join two of them, tried one after the other."""
    for limit in sorted(set(value[np.isfinite(value)].tolist())):
        allowed = value <= limit
        if allowed[start] and goal in reachable(allowed, start):
            return limit
    return math.inf
