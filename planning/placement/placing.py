"""Where to put anchors: the whole way from candidates and targets to a placement."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid
from terrain.version import VERSION
from visibility.sight import Anchor, AntennaLimits, check_anchors

from .candidates import Candidates
from .cluster import Cluster, anchors_table, sight_table
from .fewest import fewest
from .goals import Goal
from .judges import CountJudge, Judge, Problem, judge_of, shown_value
from .rules import Feasible, PlacementRules, feasible_candidates
from .searching import Found, SearchOptions, search
from .sight import SightOptions, SightTable, positions_of
from .targets import Targets
from .together import Together

__all__ = ["Placement", "anchor_rows", "by_gain", "place_anchors", "prepare", "require_enough", "require_sight"]

Floats = npt.NDArray[np.float64]
SHARE_OF_SIGHT = 0.7


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """The answer to ``place_anchors``.

    anchors: the chosen places, in the order in which each adds most. candidate: their numbers among the candidates.
    value: what the goal asks for: a share 0..1, or metres. bound: what no choice can better; gap: how far apart the
        two are, in the same unit. proved: no choice is better. before: the value with the fixed anchors alone.
    marginal: (k,) what each anchor added to the value when it came; error goals: how many metres less.
    needed: no fewer anchors reach the share that was asked for; None where a number was asked for.
    greedy_value: what greedy alone reached. feasible: candidates that kept the rules, and what took the others.
    stopped: the search was stopped; the answer is the best so far.
    """

    anchors: tuple[Anchor, ...]
    candidate: npt.NDArray[np.intp]
    fixed: tuple[Anchor, ...]
    goal: Goal
    rules: PlacementRules
    targets: Targets
    feasible: Feasible
    value: float
    before: float
    bound: float
    marginal: Floats
    needed: int | None
    greedy_value: float
    method: str
    proved: bool
    stopped: bool
    statement: str
    warnings: tuple[str, ...]
    sight: SightOptions
    timing_s: dict[str, float]
    version: str

    @property
    def gap(self) -> float:
        """Distance from the bound, in the value's unit, >= 0."""
        return abs(self.bound - self.value)

    @property
    def what(self) -> tuple[str, ...]:
        """What each of the anchors is: drone, mast or site."""
        left = dict(zip(self.feasible.number.tolist(), self.feasible.candidates.what, strict=True))
        return tuple(left[number] for number in self.candidate.tolist())

    @property
    def within_limits_m(self) -> float | None:
        """Metres of a path that reach a goal that is a share; None for other targets and goals."""
        return self.value * self.targets.total if self.targets.what == "path" and self.goal.is_share else None


def place_anchors(
    grid: ElevationGrid,
    candidates: Candidates,
    targets: Targets,
    count: int | None = None,
    goal: Goal | None = None,
    rules: PlacementRules | None = None,
    *,
    reach: float | None = None,
    fixed: Sequence[Anchor] = (),
    sight: SightOptions | None = None,
    options: SearchOptions | None = None,
    cluster: Cluster | str | None = None,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Placement:
    """The best places for ``count`` anchors among the candidates, beside those that are fixed.

    goal: None = the position error along the surface, or with ``reach`` the coverage.
    reach: in place of count, a share 0..1: the fewest anchors that reach it.
    progress: called with the finished share 0..1. stop: asked again and again; once it says True the best placement so
    far comes back, marked as stopped. cluster: works out sight on a Dask cluster, by the address of its scheduler; the
    answer is the same. Raises PlacementError, NoCandidateError, ClusterError, AnchorError.
    """
    goal = goal or Goal(None if reach is None else "coverage")
    rules, options = rules or PlacementRules(), options or SearchOptions()
    _check_number(count, reach, goal)
    require_sight(count, len(fixed), goal)
    spread = Cluster(cluster) if isinstance(cluster, str) else cluster
    begin_s = time.perf_counter()
    ready = prepare(grid, candidates, targets, goal, rules, fixed, sight, progress, stop, spread)
    sight_s = time.perf_counter() - begin_s
    told = None if progress is None else lambda share: progress(SHARE_OF_SIGHT + (1.0 - SHARE_OF_SIGHT) * share)
    if count is not None:
        if not (stop is not None and stop()):
            require_enough(count, ready.feasible)
        found, needed = search(ready.problem, count, ready.together, options, told, stop), None
    else:
        assert reach is not None, "it has been checked"
        found, needed = fewest(ready.problem, reach, ready.together, options, told, stop)
    timing_s = {"sight_s": sight_s, "search_s": time.perf_counter() - begin_s - sight_s}
    return answer(ready, found, count or len(found.chosen), needed, timing_s)


def _check_number(count: int | None, reach: float | None, goal: Goal) -> None:
    if (count is None) == (reach is None):
        raise PlacementError("Give exactly one of count and reach.")
    if count is not None and count < 1:
        raise PlacementError(f"At least one anchor has to be placed, not {count}.")
    if reach is not None and not (goal.is_share and 0.0 < reach <= 1.0):
        raise PlacementError(f"reach must be a share > 0 and <= 1 of a goal that is a share, not {reach}.")


def require_enough(count: int, feasible: Feasible) -> None:
    """Raises PlacementError where there are fewer candidates than anchors to place."""
    left = len(feasible.candidates)
    if count > left:
        raise PlacementError(
            f"{count} anchors cannot be placed on {left:,} candidate{'' if left == 1 else 's'}: {feasible.sentence()}"
        )


def require_sight(count: int | None, fixed: int, goal: Goal) -> None:
    """Raises PlacementError where all anchors are fewer than one target needs; count None = as many as needed."""
    if count is None or fixed + count >= goal.needed_with_spare:
        return
    there = f"there {'is' if fixed + count == 1 else 'are'} only {fixed + count}"
    one = goal.needed == 1
    lost = " besides one that may be lost" if goal.spare else ""
    if goal.min_anchors == goal.needed:
        raise PlacementError(
            f"{goal.min_anchors} anchor{' in sight is' if one else 's in sight are'} asked for{lost}, and {there}."
        )
    if goal.objective == "coverage":
        what = f"Without a min_anchors coverage counts places with {goal.needed} anchors in sight"
        raise PlacementError(f"{what}{lost}, and {there}.")
    fix = f"A fix needs {goal.needed} anchor{'' if one else 's'} in sight{lost}"
    raise PlacementError(f"{fix}, and {there}; the objective coverage counts places that see fewer.")


@dataclass(frozen=True, slots=True, eq=False)
class Ready:
    """Everything that a search needs."""

    problem: Problem
    together: Together
    feasible: Feasible
    fixed: tuple[Anchor, ...]
    rules: PlacementRules
    sight: SightOptions
    warnings: tuple[str, ...]


def prepare(
    grid: ElevationGrid,
    candidates: Candidates,
    targets: Targets,
    goal: Goal,
    rules: PlacementRules,
    fixed: Sequence[Anchor],
    sight: SightOptions | None,
    progress: Callable[[float], None] | None,
    stop: Callable[[], bool] | None,
    cluster: Cluster | None,
) -> Ready:
    """Rules applied and sight worked out. Raises NoCandidateError, AnchorError."""
    warnings = check_anchors(grid, fixed) if fixed else ()
    seeing = replace(sight or SightOptions(), max_range_m=rules.max_range_m)
    feasible = feasible_candidates(grid, candidates, rules, targets)
    fixed_sight = anchors_table(grid, targets, fixed, seeing)
    worked = sight_table(
        grid,
        targets,
        feasible.candidates.position_m,
        seeing,
        None if progress is None else lambda share: progress(SHARE_OF_SIGHT * share),
        stop,
        cluster,
    )
    table, done = worked.table, worked.done
    if not done.all():
        feasible = Feasible(feasible.candidates.take(done), feasible.number[done], feasible.removed)
        table = SightTable(table.bits[done], table.targets)
    position_m = feasible.candidates.position_m
    weight = np.full((len(position_m), 1), 1.0 if goal.is_share else goal.ranging_sigma_m**-2)
    problem = Problem(targets, goal, np.hstack([position_m, weight]), table, anchor_rows(fixed, goal), fixed_sight)
    together = Together(grid, position_m, positions_of(fixed), rules.min_separation_m, rules.link)
    return Ready(problem, together, feasible, tuple(fixed), rules, seeing, (*warnings, *worked.warnings))


def anchor_rows(anchors: Sequence[Anchor], goal: Goal) -> Floats:
    """(n, 4) anchors as judges take them; weights are 1 for dilutions and 1/variance for errors in metres."""
    variance_m2 = np.array([a.ranging_sigma_m**2 + a.pose_sigma_m**2 for a in anchors]).reshape(-1, 1)
    weight = np.ones((len(anchors), 1)) if goal.is_share else 1.0 / np.maximum(variance_m2, 1e-12)
    return np.hstack([positions_of(anchors), weight])


def answer(ready: Ready, found: Found, count: int, needed: int | None, timing_s: dict[str, float]) -> Placement:
    """A placement out of what a search found."""
    problem, goal = ready.problem, ready.problem.goal
    guide = CountJudge(problem, goal.needed_with_spare, partial=True)
    order, marginal = by_gain(judge_of(problem), guide, found.chosen)
    sign = 1.0 if goal.is_share else -1.0
    warnings = list(ready.warnings)
    if len(order) < count:
        warnings.append(
            f"Only {len(order)} of {count} anchors are placed: no set of more was found that keeps the rules between "
            "anchors (separation, link)."
        )
    limits = AntennaLimits(max_range_m=ready.rules.max_range_m)
    anchors = tuple(
        Anchor(f"P{number}", *at_m, goal.ranging_sigma_m, limits=limits, radio=ready.sight.radio)
        for number, at_m in enumerate(map(_place, problem.anchor[order].tolist()), 1)
    )
    return Placement(
        anchors=anchors,
        candidate=ready.feasible.number[np.array(order, np.intp)],
        fixed=ready.fixed,
        goal=goal,
        rules=ready.rules,
        targets=problem.targets,
        feasible=ready.feasible,
        value=shown_value(problem, order),
        before=shown_value(problem, []),
        bound=sign * found.bound,
        marginal=marginal,
        needed=needed,
        greedy_value=shown_value(problem, found.greedy),
        method=found.method,
        proved=found.proved,
        stopped=found.stopped,
        statement=_statement(goal, ready.together),
        warnings=tuple(warnings),
        sight=ready.sight,
        timing_s=timing_s,
        version=VERSION,
    )


def _place(row: list[float]) -> tuple[float, float, float]:
    return row[0], row[1], row[2]


def by_gain(judge: Judge, guide: Judge, chosen: list[int]) -> tuple[list[int], Floats]:
    """(a set in the order in which each adds most, what each added); guide: orders those that add nothing yet."""
    order: list[int] = []
    left = list(chosen)
    values = [judge.value([])]
    while left:
        which = np.array(left, np.intp)
        added = judge.with_each(order, which)
        # while nothing counts yet, what brings targets nearer to counting goes first
        best = int(np.lexsort((-guide.with_each(order, which), -np.round(added, 12)))[0])
        order.append(left.pop(best))
        values.append(judge.value(order))
    return order, np.diff(values)


def _statement(goal: Goal, together: Together) -> str:
    """What is proved about greedy for this goal."""
    if goal.submodular and together.free:
        return (
            "The goal is submodular: greedy alone reaches at least 1 − 1/e = 63 % of the best, and what is returned is "
            "no worse than greedy."
        )
    why = (
        "rules between anchors (separation or relays) exclude sets"
        if goal.submodular
        else "a target counts only once several anchors see it"
        if goal.objective == "coverage"
        else "a dilution of precision depends on anchors together, not on each"
    )
    return f"The goal is not submodular: {why}; greedy has no guarantee here, and the bound is what is proved."
