"""Bounds of many nodes of a search tree at once, by subgradients of the Lagrangian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .relaxation import ROUNDING, Parts, Relaxation

__all__ = ["Bounds", "Node", "bounds_of"]

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

# of what a step would take to close the gap, at first and at last
FIRST_STEP, LAST_STEP = 1.0, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """All sets of the members and ``left`` of the allowed candidates. price: (needs, rows), to begin with."""

    members: tuple[int, ...]
    allowed: npt.NDArray[np.intp]
    left: int
    price: npt.NDArray[np.float16]


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Of each node: what none of its sets exceeds, as base plus the largest gains. price: (needs, rows) at best.

    gain: (n,) of each candidate, -inf where it is not allowed.
    """

    bound: Floats
    base: Floats
    gain: Floats
    price: npt.NDArray[np.float32]


def bounds_of(rows: Relaxation, most: Sequence[Parts], nodes: Sequence[Node], floor: float, rounds: int) -> Bounds:
    """The least bounds met in so many rounds.

    Each good row is worth no more than 1, and no more than what is brought to each of its needs, in parts of the need;
    so also no more than their mean by any prices. For given prices the best candidates are those that gain most.
    most: by number of candidates, what they bring to each need at most. floor: a value that some set has.
    """
    count, candidates, shape = len(nodes), len(rows.part), rows.need.shape
    flat = rows.part.reshape(candidates, -1)
    allowed: Mask = np.zeros((count, candidates), np.bool_)
    need = np.empty((count, *shape), np.float32)
    possible = np.ones((count, shape[1]), np.bool_)
    for at, node in enumerate(nodes):
        allowed[at, node.allowed] = True
        need[at] = rows.need - rows.part[list(node.members)].sum(axis=0)
        possible[at] = (most[node.left] >= need[at] - ROUNDING)[rows.to_be_met].all(axis=0)
    live = (need > ROUNDING) & possible[:, None, :]
    per_need = np.where(live, 1.0 / np.where(live, need, 1.0), 0.0).astype(np.float32)
    # what is left of a need, in parts of what is sought after: of a ramp some is won already
    sought = np.ones_like(need)
    if rows.ramp:
        per_need[:, -1] = live[:, -1]
        sought[:, -1] = np.clip(need[:, -1], 0.0, 1.0)
    weight = (rows.weight * possible).astype(np.float32)
    # prices that were kept in 16 bits may add up to a little more than 1, by which no bound would hold
    kept = _within(np.array([node.price for node in nodes], np.float32))
    price = np.where(live, kept, np.float32(0.0))
    left = np.array([node.left for node in nodes])
    most_left = int(left.max())
    picked = (np.arange(most_left)[None, :] < left[:, None]).astype(np.float32)
    best = Bounds(np.full(count, np.inf), np.zeros(count), np.zeros((count, candidates)), price.copy())
    for number in range(rounds):
        each = weight[:, None, :] * per_need * price
        gain = np.where(allowed, (each.reshape(count, -1) @ flat.T).astype(np.float64), -np.inf)
        base = rows.base + (weight * (1.0 - (price * sought).sum(axis=1))).sum(axis=1, dtype=np.float64)
        top = np.argpartition(-gain, most_left - 1, axis=1)[:, :most_left]
        top = np.take_along_axis(top, np.argsort(-np.take_along_axis(gain, top, axis=1), axis=1), axis=1)
        found = np.maximum(np.take_along_axis(gain, top, axis=1), 0.0)
        bound = base + (found * picked).sum(axis=1)
        better = bound < best.bound
        best.bound[better], best.base[better], best.gain[better] = bound[better], base[better], gain[better]
        best.price[better] = price[better]
        if number + 1 == rounds:
            break
        brought = np.zeros((count, flat.shape[1]), np.float32)
        for place in range(most_left):
            usable = picked[:, place] * np.isfinite(np.take_along_axis(gain, top[:, [place]], axis=1)[:, 0])
            brought += flat[top[:, place]] * usable.astype(np.float32)[:, None]
        slope = np.where(live, brought.reshape(price.shape) * per_need - sought, np.float32(0.0))
        # what cannot move further that way is no part of the way
        slope[((price <= 0.0) & (slope > 0.0)) | ((price >= 1.0) & (slope < 0.0))] = 0.0
        length = (weight[:, None, :] * slope**2).sum(axis=(1, 2), dtype=np.float64)
        part = FIRST_STEP * (LAST_STEP / FIRST_STEP) ** (number / rounds)
        step = part * np.maximum(bound - floor, 0.0) / np.maximum(length, 1e-12)
        price = _within(price - step.astype(np.float32)[:, None, None] * slope)
        price = np.where(live, price, np.float32(0.0))
    return Bounds(best.bound + ROUNDING, best.base, best.gain, best.price)


def _within(price: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The nearest prices >= 0 whose sum over the needs of a row is <= 1."""
    price = np.maximum(price, np.float32(0.0))
    if price.shape[1] == 1:
        return np.asarray(np.minimum(price, np.float32(1.0)))
    excess = np.maximum(price.sum(axis=1) - 1.0, 0.0)
    first, second = price[:, 0] - excess / 2.0, price[:, 1] - excess / 2.0
    # where one would fall below 0, all that is too much comes off the other
    taken = np.stack([first + np.minimum(second, 0.0), second + np.minimum(first, 0.0)], axis=1)
    return np.asarray(np.clip(taken, 0.0, 1.0))
