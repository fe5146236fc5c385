"""What no set can exceed: the other half of an optimality gap."""

from __future__ import annotations

import math

import numpy as np

from .goals import Goal
from .greedy import greedy, upper_bound
from .judges import CountJudge, GeometryJudge, Problem
from .together import Together

__all__ = ["bound_of"]


def bound_of(problem: Problem, count: int) -> float:
    """A value that no set of so many candidates exceeds, whatever rules hold between them.

    A target that counts sees at least as many anchors as the goal needs, so the share of such targets is at most the
    mean of min(in sight, needed) / needed, which is submodular. Targets for which even all candidates together do not
    suffice count for neither. Errors are bounded by what all candidates together would give, and by what the best
    geometry of so many ranges gives.
    """
    goal = problem.goal
    possible = _possible(problem)
    if goal.is_share:
        needed = goal.needed_with_spare
        judge = CountJudge(problem, needed, partial=True, possible=possible)
        anyone = Together.anything_goes(len(problem.anchor))
        members = greedy(judge, len(problem.anchor), count, anyone)
        most = float(problem.targets.weight[possible].sum()) / problem.targets.total
        return min(upper_bound(judge, len(problem.anchor), count, members), most)
    return -_least_error(problem, count)


def _possible(problem: Problem) -> np.ndarray:
    """(m,) bool: targets that would count if every candidate stood."""
    goal, sight = problem.goal, problem.sight.visible().sum(axis=0) + problem.fixed_sight.visible().sum(axis=0)
    enough = sight >= goal.needed_with_spare
    if goal.objective != "dop":
        return np.asarray(enough)
    best = GeometryJudge(_without_spare(problem)).of_targets(list(range(len(problem.anchor))))
    return np.asarray(enough & (best > 0.5))


def _without_spare(problem: Problem) -> Problem:
    from dataclasses import replace

    return replace(problem, goal=replace(problem.goal, spare=0))


def _least_error(problem: Problem, count: int) -> float:
    """Metres that no set gets below, mean or worst as the goal says, as its judge joins them."""
    goal = problem.goal
    error_m = -GeometryJudge(_without_spare(problem)).of_targets(list(range(len(problem.anchor))))
    ranges = count + len(problem.fixed) - goal.spare
    weight = float(max(problem.anchor[:, 3].max(), problem.fixed[:, 3].max(initial=0.0)))
    error_m = np.minimum(
        np.maximum(error_m, _best_geometry(goal) / math.sqrt(weight * max(ranges, 1))), goal.worst_counted_m
    )
    mean_m = float(error_m @ problem.targets.weight) / problem.targets.total
    return mean_m if goal.objective == "mean_error" else float(error_m.max())


def _best_geometry(goal: Goal) -> float:
    """sqrt(n) times the least dilution of n ranges: n unknowns in an isotropic information of trace n."""
    if goal.on_surface:
        return 2.0
    return {"hdop": 2.0, "vdop": 1.0}.get(goal.measure, 3.0)
