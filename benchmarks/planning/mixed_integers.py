"""Coverage as a mixed-integer program for HiGHS, the solver that SciPy brings: what it places, and what it proves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_matrix, diags_array, hstack

from benchmarks.timing import Timed
from planning.placement.judges import Problem

__all__ = ["MixedInteger", "best_by_highs"]


@dataclass(frozen=True, slots=True)
class MixedInteger:
    """Shares of the ground: of the best set found, NaN where none was, and what no set exceeds; and the time."""

    value: float
    bound: float
    taken_s: float


def best_by_highs(problem: Problem, count: int, seconds: float) -> MixedInteger:
    """Choose so many candidates that most weight sees ``needed`` of them; nothing stands yet, none is spare.

    A row for all targets that the same candidates see: Σ sees·chosen ≥ needed·reached, and so many are chosen. Reached
    follows from chosen where one is needed, and may then be any number 0..1; else it is whole.
    """
    assert len(problem.fixed) == 0
    assert problem.goal.spare == 0
    needed, weight = problem.goal.needed, problem.targets.weight
    timed = Timed()
    sees, member = np.unique(np.packbits(problem.sight.visible(), axis=0), axis=1, return_inverse=True)
    shares = np.bincount(member.ravel(), weights=weight, minlength=sees.shape[1]) / weight.sum()
    rows = np.unpackbits(sees, axis=0, count=len(problem.anchor)).T
    able = rows.sum(axis=1) >= needed
    rows, shares = csr_matrix(rows[able].astype(np.float64)), shares[able]
    targets, candidates = rows.shape
    reach = LinearConstraint(hstack([rows, diags_array(np.full(targets, -float(needed)))]), 0.0, math.inf)
    chosen = LinearConstraint(np.concatenate([np.ones(candidates), np.zeros(targets)])[None, :], count, count)
    whole = np.concatenate([np.ones(candidates), np.full(targets, float(needed > 1))])
    answer = milp(
        np.concatenate([np.zeros(candidates), -shares]),
        integrality=whole,
        bounds=Bounds(0.0, 1.0),
        constraints=[reach, chosen],
        options={"time_limit": seconds},
    )
    value = math.nan if answer.fun is None else -float(answer.fun)
    bound = -float(answer.mip_dual_bound) if answer.mip_dual_bound is not None else float(shares.sum())
    return MixedInteger(value, min(bound, float(shares.sum())), timed.s())
