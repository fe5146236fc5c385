"""Other ways than the cheapest, and plans made again from wherever a rover is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.planning.path_problems import grounds, random_problems
from benchmarks.planning.paths import rolling
from benchmarks.report import Row, Table, duration
from benchmarks.timing import Timed
from planning import NoCoverageError, PlaceError
from planning.alternatives import alternatives_to, prepare_replanning
from planning.paths import plan_path

__all__ = ["other_ways", "replanning"]

REPLAN_S = 0.3
WAYS_NOTE = """\
Random problems without the sampling planner, three other ways asked for. Shorter, less out of sight, surer: how many
paths have another way that is by more than 1 %. Apart: share of a way that is away from all before it. Time: of all
three, the path's own plan excluded: the lesser of the clock's and of all threads' processor time."""
AGAIN_NOTE = """\
Rolling fractal ground with six anchors; from squares drawn at random from which a way is known, to the goals of random
problems. Prepared once for each problem: sight is given, field and costs from everywhere are worked out. Each plan is
checked by exact lines and the validator. Refused: what these did not pass, and would be planned anew. Cost: over that
of a whole plan on the grid. Time: the lesser of the clock's and of all threads' processor time."""


def other_ways(count: int = 60, posts: int = 120, wanted: int = 3) -> Table:
    """How many other ways there are, and what they are worth."""
    rows = []
    for number, ground in enumerate(grounds(posts)):
        found, seconds, apart, better = [], [], [], np.zeros(3, np.int64)
        for problem in random_problems(ground, count // 5, seed=700 + number):
            try:
                outcome = plan_path(problem)
            except (PlaceError, NoCoverageError):
                continue
            if outcome.path is None:
                continue
            timed = Timed()
            others = alternatives_to(problem, outcome, wanted)
            seconds.append(timed.s())
            found.append(len(others.paths))
            apart += [one.apart for one in others.paths]
            totals = outcome.path.totals
            there = (totals.length_m, totals.out_of_sight_s, totals.mean_position_sigma_m)
            ways = [one.path.totals for one in others.paths]
            here = [(way.length_m, way.out_of_sight_s, way.mean_position_sigma_m) for way in ways]
            better += [any(way[n] < 0.99 * there[n] for way in here) for n in range(3)]
        cells = (
            ground.name, f"{len(found)}", f"{np.mean(found):.1f}", *(f"{n}" for n in better),
            f"{np.mean(apart):.0%}" if apart else "–", duration(float(np.median(seconds))), duration(max(seconds)),
        )  # fmt: skip
        rows.append(Row(cells))
    told = ("shorter", "less out of sight", "surer", "apart", "time, median", "longest")
    columns = ("ground", "paths", "other ways, mean", *told)
    return Table(f"Other ways, up to {wanted}", columns, rows, WAYS_NOTE)


def replanning(posts: int = 1024, problems: int = 4, starts: int = 5) -> Table:
    """How soon there is a plan from another place, once costs are known."""
    ground = rolling(posts)
    seconds: list[float] = []
    prepared_s, ratios, anew = [], [], 0
    random = np.random.default_rng(3)
    for problem in random_problems(ground, problems, seed=5):
        prepared = prepare_replanning(problem)
        prepared_s.append(prepared.prepared_s)
        joined = np.argwhere(np.isfinite(prepared.cost))
        made = 0
        while made < starts:
            row, col = joined[int(random.integers(len(joined)))]
            place = ground.grid.position_of(row + 0.5, col + 0.5)
            try:
                if not seconds:  # what is compiled is loaded
                    prepared.plan_from(place, anew=False)
                timed = Timed()
                again = prepared.plan_from(place, anew=False)
            except PlaceError:  # by exact sight lines too few anchors are in sight there
                continue
            seconds.append(timed.s())
            made += 1
            anew += again.path is None
            whole = None if again.path is None else plan_path(replace(problem, start=place)).path
            if again.path is not None and whole is not None:
                ratios.append(again.path.cost / whole.cost)
    longest_s = max(seconds)
    rows = [
        Row((f"plan from another place, {len(seconds)}", duration(float(np.median(seconds))), duration(longest_s)),
            f"≤ {REPLAN_S} s", longest_s <= REPLAN_S),
        Row(("prepared once", duration(float(np.median(prepared_s))), duration(max(prepared_s)))),
        Row(("cost over that of a whole plan", f"{np.median(ratios):.4f}", f"{max(ratios):.4f}")),
        Row(("refused", f"{anew}", "")),
    ]  # fmt: skip
    return Table(f"Plans from another place, {posts}²", ("what", "median", "longest"), rows, AGAIN_NOTE)
