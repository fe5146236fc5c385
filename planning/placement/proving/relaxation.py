"""A goal as rows that gather what they need from the anchors chosen, which no set of anchors betters.

A target counts once enough anchors see it: a need of so many parts, one from each that does. A dilution below a limit
is a need as well. Let M be the sum of weight · u uᵀ over the directions u of the anchors in sight. The function
1 / tr M⁻¹ is concave in M and grows in proportion with it, so it lies below each of its tangents: for any M₀,
1 / tr M⁻¹ ≤ Σ weight · uᵀ G u with G = M₀⁻² / (tr M₀⁻¹)². A variance below limit² thus needs Σ limit² · weight · uᵀ G u
≥ 1, to which an anchor alone brings at most 1.

An error in metres is the root of 1 / g, g = 1 / tr M⁻¹, and -1 / √g is concave in g as well: it lies below each of its
tangents, which at an error e is -3/2 e + 1/2 e³ g. So a target that enough anchors see is worth 3/2 e less than the
worst error at once, and the rest in proportion to g, up to what g comes to at most.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from planning.placement.goals import Goal
from planning.placement.judges import GeometryJudge, Problem

__all__ = ["Relaxation", "fits", "relaxation_of"]

Floats = npt.NDArray[np.float64]
Parts = npt.NDArray[np.float32]

MOST_PARTS = 12_000_000
# how much all candidates count beside the set around which tangents are laid
BESIDE = 0.3
RIDGE = 1e-6
ROUNDING = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Relaxation:
    """Rows, what they need, and what each candidate brings.

    part: (n, needs, rows) float32. need: (needs, rows) what fixed anchors leave to be brought; a row is good once
        every need is met. weight: (rows,) what a good row adds to the value. base: the value where no row is good.
    unit: what any two different values differ by at least, 0 = unknown. whole: whether the rows are the goal itself, so
        that a set has the value of the relaxation.
    ramp: whether the last need is of what is left of 1, and met in part worth that part, once the others are met.
    """

    part: Parts
    need: Parts
    weight: Floats
    base: float
    unit: float
    whole: bool
    ramp: bool = False

    @property
    def to_be_met(self) -> slice:
        """The needs without which a row is worth nothing."""
        return slice(0, -1 if self.ramp else None)


def fits(problem: Problem) -> bool:
    """Whether the rows of a problem are few enough to be worked with."""
    goal = problem.goal
    each = {"coverage": 1, "dop": 2, "mean_error": 2}.get(goal.wanted)
    return each is not None and len(problem.anchor) * len(problem.targets) * each <= MOST_PARTS


def relaxation_of(problem: Problem, count: int, around: Sequence[int] = ()) -> Relaxation:
    """The rows of a problem for sets of so many candidates; those that no such set makes good are left out.

    around: a set near which the rows of errors are to be tight.
    """
    goal, targets = problem.goal, problem.targets
    weight = targets.weight / targets.total
    sees = problem.sight.visible()
    counted = (goal.needed_with_spare - problem.fixed_sight.visible().sum(axis=0)).astype(np.float32)
    if goal.objective == "coverage":
        unit = float(weight[0]) if np.ptp(weight) == 0.0 else 0.0
        grouped = _grouped(sees, counted, weight, unit)
        return _taken(grouped, _hopeful(grouped, count))
    fixed, chosen = _shares(problem, sees, () if goal.is_share else around)
    base = 0.0 if goal.is_share else -goal.worst_counted_m
    if goal.is_share:
        worth, at_once, scale = np.ones((3, len(targets))) * [[1.0], [0.0], [goal.dop_limit**2]]
    else:
        most = fixed + np.sort(chosen, axis=0)[::-1][:count].sum(axis=0)
        error_m = -GeometryJudge(problem).of_targets(list(around))
        worth, at_once, scale = _ramp(most, error_m, goal.worst_counted_m)
    brings = np.minimum(scale * chosen, 1.0).astype(np.float32)
    left = (1.0 - at_once - scale * fixed).astype(np.float32)
    part, need = np.stack([sees.astype(np.float32), brings], axis=1), np.stack([counted, left])
    rows = Relaxation(part, need, weight * worth, base, 0.0, False, ramp=not goal.is_share)
    kept = _hopeful(rows, count)
    if goal.is_share:
        best = GeometryJudge(replace(problem, goal=replace(goal, spare=0)))
        kept &= best.of_targets(list(range(len(problem.anchor)))) > 0.5
    return _taken(rows, kept)


def _ramp(most: Floats, error_m: Floats, worst_m: float) -> tuple[Floats, Floats, Floats]:
    """Of each target (m,): what it is worth at most, metres, which part of that at once, how fast g brings the rest.

    most: what g comes to at most. error_m: where the tangent is laid.
    """
    least_m = np.minimum(1.0 / np.sqrt(np.maximum(most, 1e-30)), worst_m)
    worth_m = np.maximum(worst_m - least_m, 1e-12)
    # at larger errors a tangent would be worth less than nothing where g is 0
    tangent_m = np.clip(error_m, least_m, worst_m / 1.5)
    return worth_m, (worst_m - 1.5 * tangent_m) / worth_m, 0.5 * tangent_m**3 / worth_m


def _grouped(sees: npt.NDArray[np.bool_], need: Parts, weight: Floats, unit: float) -> Relaxation:
    """Targets that the same candidates see, and that need as many, as one row: no set tells them apart."""
    keys = np.ascontiguousarray(np.vstack([np.packbits(sees, axis=0), need.astype(np.int8).view(np.uint8)[None, :]]).T)
    whole = keys.view([("", np.uint8)] * keys.shape[1]).ravel()
    _, first, group = np.unique(whole, return_index=True, return_inverse=True)
    joined: Floats = np.bincount(group.ravel(), weight, minlength=len(first)).astype(np.float64)
    part = sees[:, None, first].astype(np.float32)
    return Relaxation(part, need[None, first], joined, 0.0, unit, True)


def _hopeful(rows: Relaxation, count: int) -> npt.NDArray[np.bool_]:
    """(rows,) which the ``count`` candidates that bring most to each make good."""
    top = np.sort(rows.part[:, rows.to_be_met], axis=0)[::-1][:count].sum(axis=0)
    return np.asarray((top >= rows.need[rows.to_be_met] - ROUNDING).all(axis=0))


def _taken(rows: Relaxation, which: npt.NDArray[np.bool_]) -> Relaxation:
    return replace(
        rows,
        part=np.ascontiguousarray(rows.part[:, :, which]),
        need=np.ascontiguousarray(rows.need[:, which]),
        weight=rows.weight[which],
    )


def _shares(problem: Problem, sees: npt.NDArray[np.bool_], around: Sequence[int]) -> tuple[Floats, Floats]:
    """What anchors bring to 1 / variance of each target at most: (fixed ones together (m,), each candidate (n, m)).

    Tangents are laid at what fixed anchors and those of ``around`` bring, and all others a little.
    """
    targets, goal = problem.targets, problem.goal
    axes = _axes(goal, targets.normal)
    fixed_sees = problem.fixed_sight.visible()
    information = np.zeros((len(targets), axes.shape[1], axes.shape[1]))
    share = np.full(len(sees), BESIDE * max(len(around), 1) / len(sees) if around else 1.0)
    share[list(around)] = 1.0
    for anchors, seen, shares in ((problem.fixed, fixed_sees, np.ones(len(fixed_sees))), (problem.anchor, sees, share)):
        for anchor, one, part in zip(anchors, seen, shares.tolist(), strict=True):
            along = _along(axes, targets.point_m, anchor, one)
            information += part * along[:, :, None] * along[:, None, :]
    trace = np.trace(information, axis1=1, axis2=2)
    ridge = RIDGE * np.maximum(trace, 1e-30)[:, None, None] * np.eye(axes.shape[1])
    inverse = np.linalg.inv(information + ridge)
    tangent = inverse @ inverse / np.trace(inverse, axis1=1, axis2=2)[:, None, None] ** 2

    def brought(anchor: Floats, seen: npt.NDArray[np.bool_]) -> Floats:
        along = _along(axes, targets.point_m, anchor, seen)
        return np.asarray((along * np.einsum("mij,mj->mi", tangent, along)).sum(axis=1))

    fixed = np.zeros(len(targets))
    for anchor, one in zip(problem.fixed, fixed_sees, strict=True):
        fixed += brought(anchor, one)
    chosen = np.array([brought(anchor, one) for anchor, one in zip(problem.anchor, sees, strict=True)])
    return fixed, chosen


def _axes(goal: Goal, normal: Floats) -> Floats:
    """(m, d, 3) orthonormal axes of what counts of a position: all, along the surface, across or up."""
    if goal.on_surface:
        # an axis that is never along the normal, made orthogonal to it
        other = np.where(np.abs(normal[:, [2]]) > 0.5, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
        first = np.cross(normal, other)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        return np.stack([first, np.cross(normal, first)], axis=1)
    kept = {"hdop": [0, 1], "vdop": [2]}.get(goal.measure, [0, 1, 2])
    return np.broadcast_to(np.eye(3)[kept], (len(normal), len(kept), 3))


def _along(axes: Floats, point_m: Floats, anchor: Floats, seen: npt.NDArray[np.bool_]) -> Floats:
    """(m, d) directions to an anchor along the axes, by the root of its weight; 0 where it is not seen."""
    away_m = anchor[:3] - point_m
    length_m = np.linalg.norm(away_m, axis=1)
    scale = np.where(seen & (length_m > 0.0), math.sqrt(anchor[3]) / np.maximum(length_m, 1e-12), 0.0)
    return np.asarray(np.einsum("mdi,mi->md", axes, away_m * scale[:, None]))
