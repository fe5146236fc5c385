"""The search for a set: greedy, local search from several starts, exact where it is small."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
import numpy.typing as npt

from .annealing import annealed, between
from .greedy import bound_of, exchange, fill_up, greedy, roomy
from .judges import CountJudge, GeometryJudge, Judge, Problem, judge_of, sampled
from .proving import ExactAnswer, every_set, fits, number_of_sets, prove, relaxation_of
from .together import Together

__all__ = ["ROUNDING", "Found", "SearchOptions", "search"]

MOST_SETS = 6_000
MOST_EVALUATIONS = 60_000_000  # sets × targets that are worth going through
SHORTLIST = 48
PACKINGS = 24  # tries to make room for all anchors under a large separation
ELITE, FINALISTS = 4, 2
WALKS_THAT_AGREE = 3
SHARE_OF_WALKS = 0.7
NS = {"coverage": 0.004, "dop": 7.0, "mean_error": 16.0, "worst_error": 16.0}  # of a candidate and a target, two cores
# times that, where geometry is judged without each of the anchors as well
EVERY_LOSS = {"dop": 1.0, "mean_error": 3.0, "worst_error": 3.0}
STEPS_PER_CANDIDATE, LEAST_STEPS = 30, 60
ROUNDING = 1e-12
NOTHING = 1e-9  # a gap that is none


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """How hard to search.

    seed: of the walks; the same seed gives the same answer. walks: how many set out, and walk_s: how long each takes,
    seconds of two cores, about. coarse: so many targets at most judge walks, and sample: those sets that promise most;
    the answer is judged by all. exact: whether small instances are gone through, and a proof is sought for proof_s
    seconds of two cores, about. Such seconds are counted by what there is to work out, not by a clock.
    """

    seed: int = 0
    walks: int = 8
    walk_s: float = 0.5
    coarse: int = 1_500
    sample: int = 6_000
    exact: bool = True
    proof_s: float = 1.0


@dataclass(frozen=True, slots=True)
class Found:
    """A set, its value, what no set exceeds, how it was found, and whether the search was stopped before its end.

    greedy: the set that greedy alone reached.
    """

    chosen: list[int]
    value: float
    bound: float
    method: str
    proved: bool
    stopped: bool
    greedy: list[int]


def search(
    problem: Problem,
    count: int,
    together: Together,
    options: SearchOptions,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Found:
    """The best set of ``count`` candidates that was found; fewer where none was that keeps the rules between them."""
    judge = judge_of(problem)
    # also when the search is to stop at once: something has to come of it
    first = greedy(_guides(problem)[0], len(problem.anchor), count, together)
    if not (stop is not None and stop()):
        first = fill_up(judge, first, count, together)
    first_value = judge.value(first)
    exact = _exact(problem, judge, count, together, stop) if options.exact else None
    if exact is not None:
        value = judge.value(exact.chosen)
        return Found(exact.chosen, value, max(exact.value, value), "exact", True, False, first)
    best, value = first, first_value
    for candidate in _good_sets(problem, count, together, options, progress, stop):
        found = judge.value(candidate)
        if (len(candidate), found) > (len(best), value):
            best, value = candidate, found
    bound, proved = bound_of(problem, count), False
    if options.exact and len(best) == count and fits(problem) and not together.relayed and not _stopped(stop):
        proof = prove(relaxation_of(problem, count, best), judge, best, together, options.proof_s, stop)
        best, value, bound, proved = proof.chosen, proof.value, min(bound, proof.bound), proof.proved
    bound = max(bound, value)
    proved = proved or bound <= value + NOTHING
    if progress is not None:
        progress(1.0)
    return Found(best, value, bound, "exact" if proved else "local search", proved, _stopped(stop), first)


def _stopped(stop: Callable[[], bool] | None) -> bool:
    return stop is not None and stop()


def _exact(
    problem: Problem, judge: Judge, count: int, together: Together, stop: Callable[[], bool] | None
) -> ExactAnswer | None:
    candidates = len(problem.anchor)
    sets = number_of_sets(candidates, count)
    if sets <= MOST_SETS and sets * len(problem.targets) <= MOST_EVALUATIONS:
        return every_set(judge, candidates, count, together, stop)
    return None


def _guides(problem: Problem) -> list[Judge]:
    """Submodular judges for greedy: they reward the first anchors over a target too, which the goal itself may not."""
    counting = CountJudge(problem, problem.goal.needed_with_spare, partial=True)
    if problem.goal.objective == "coverage":
        return [counting]
    return [counting, GeometryJudge(problem, information=True)]


def _good_sets(
    problem: Problem,
    count: int,
    together: Together,
    options: SearchOptions,
    progress: Callable[[float], None] | None,
    stop: Callable[[], bool] | None,
) -> Iterator[list[int]]:
    """Sets that no exchange betters by ever more targets, the best of them by all."""
    coarse = _sampled(problem, options.coarse)
    told = None if progress is None else lambda share: progress(SHARE_OF_WALKS * share)
    elite = _elite(coarse, count, together, options, told, stop)
    yield from elite
    sample = _sampled(problem, options.sample)
    judge = judge_of(sample)
    if sample is not coarse:
        # an exchange by more targets costs as much more: only what promises most is worth it
        elite = [exchange(judge, chosen, together, stop=stop) for chosen in elite[:FINALISTS]]
        yield from elite
    if sample is not problem and not _stopped(stop):
        best = max(elite, key=lambda chosen: (len(chosen), judge.value(chosen)))
        yield exchange(judge_of(problem), best, together, shortlist=_shortlist(sample, best, together), stop=stop)


def _elite(
    problem: Problem,
    count: int,
    together: Together,
    options: SearchOptions,
    progress: Callable[[float], None] | None,
    stop: Callable[[], bool] | None,
) -> list[list[int]]:
    """Different sets that no exchange betters, best first: from greedy, from places far apart, from high ones, from
    walks that begin at those, and from what lies between the best.
    """
    judge, candidates = judge_of(problem), len(problem.anchor)
    random = np.random.default_rng(options.seed)
    found: dict[tuple[int, ...], float] = {}

    def keep(start: list[int]) -> list[int]:
        chosen = exchange(judge, fill_up(judge, start, count, together), together, stop=stop)
        found[tuple(sorted(chosen))] = judge.value(chosen)
        return chosen

    def best_first() -> list[list[int]]:
        return [list(chosen) for chosen in sorted(found, key=lambda one: (-len(one), -found[one], one))]

    starts: list[Callable[[], list[int]]] = [
        partial(greedy, guide, candidates, count, together, stop) for guide in _guides(problem)
    ]
    starts += [lambda: _far_apart(problem, count, together), lambda: _highest(problem, count, together)]
    for start in starts:
        if not found or not _stopped(stop):
            keep(start())
    for _ in range(PACKINGS if together.separated else 0):
        # far apart they have to stand, and what is good took the room of others
        if len(best_first()[0]) == count or _stopped(stop):
            break
        keep(roomy(count, together, random))
    steps, agree = _steps(problem, options), 0
    for number in range(options.walks if count > 1 else 0):
        if _stopped(stop) or agree == WALKS_THAT_AGREE:
            break
        ranked = best_first()
        chosen = keep(annealed(judge, ranked[number % len(ranked)], together, random, steps, stop))
        agree = agree + 1 if set(chosen) == set(ranked[0]) else 0
        if progress is not None:
            progress((number + 1) / options.walks)
    for one, other in combinations(best_first()[:ELITE], 2):
        middle = None if _stopped(stop) or len(one) != len(other) else between(judge, one, other, together)
        if middle is not None:
            keep(middle)
    return best_first()


def _steps(problem: Problem, options: SearchOptions) -> int:
    """Of one walk: as many as take about walk_s on two cores, but no more than few candidates need.

    Worked out, not timed: the same seed gives the same answer on any machine.
    """
    pairs = len(problem.anchor) * len(problem.targets)
    goal = problem.goal
    losses = EVERY_LOSS.get(goal.wanted, 1.0) if goal.spare else 1.0
    each_s = 6e-5 + pairs * NS[goal.wanted] * losses * 1e-9
    return max(min(int(options.walk_s / each_s), STEPS_PER_CANDIDATE * len(problem.anchor)), LEAST_STEPS)


def _far_apart(problem: Problem, count: int, together: Together) -> list[int]:
    """Places each as far as can be from those before it, beginning in the middle."""
    position_m = problem.anchor[:, :3]
    middle_m = problem.targets.point_m.mean(axis=0)
    away_m = ((position_m[:, :2] - middle_m[:2]) ** 2).sum(axis=1)
    chosen: list[int] = []
    nearest_m2 = -away_m
    while len(chosen) < count:
        allowed = np.flatnonzero(together.may_join(chosen))
        if not len(allowed):
            break
        chosen.append(int(allowed[np.argmax(nearest_m2[allowed])]))
        apart_m2 = ((position_m - position_m[chosen[-1]]) ** 2).sum(axis=1)
        nearest_m2 = apart_m2 if len(chosen) == 1 else np.minimum(nearest_m2, apart_m2)
    return chosen


def _highest(problem: Problem, count: int, together: Together) -> list[int]:
    """The highest places."""
    chosen: list[int] = []
    for number in np.argsort(-problem.anchor[:, 2], kind="stable"):
        if len(chosen) == count:
            break
        if together.may_join(chosen)[number]:
            chosen.append(int(number))
    return chosen


def _sampled(problem: Problem, most: int) -> Problem:
    """The problem with evenly spread targets, or itself where it has few."""
    targets = len(problem.targets)
    if problem.goal.objective == "coverage" or targets <= most:
        return problem
    # a step that shares no factor with a row of posts leaves no stripes; a shuffled order leaves none at all
    order = np.random.default_rng(20_260_501).permutation(targets)[:most]
    return sampled(problem, np.sort(order))


def _shortlist(sample: Problem, chosen: list[int], together: Together) -> npt.NDArray[np.intp]:
    """The candidates that promise most in place of each member, by the sample."""
    judge = judge_of(sample)
    promising: list[npt.NDArray[np.intp]] = []
    for at in range(len(chosen)):
        rest = chosen[:at] + chosen[at + 1 :]
        which = np.flatnonzero(together.may_join(rest))
        order = np.argsort(-judge.with_each(rest, which), kind="stable")[: max(SHORTLIST // len(chosen), 4)]
        promising.append(which[order])
    return np.unique(np.concatenate([*promising, np.array(chosen, np.intp)]))
