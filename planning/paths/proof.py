"""What cuts the way: which limit, where, and the least that each limit by itself must give.

Where there is no way is proved by closer looks. What is told here of a limit that gives way has been tried: with it a
path was found that the validator passes, or the answer says that none was shown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from planning.kernels.searches import least_worst_way
from planning.questions.problems import Goal, PathProblem

from .corridors import SIXTEEN, grid_way
from .ends import Ends
from .fields import CostField, KernelField, bit_of, reasons_of
from .judging import CLOSED, Judge, slopes_of
from .leaves import Graph
from .outcomes import Reason, Relaxation, Unreachable

__all__ = ["closed_in", "proof_of"]

Values = npt.NDArray[np.float64]
Nodes = npt.NDArray[np.int64]
Where = tuple[float, float]
# whether a path is found that the validator passes; None = it was not tried to the end
Shows = Callable[[PathProblem], bool | None]

REMOVABLE = {
    Reason.NO_GO: "without the no-go areas",
    Reason.KEEP_IN: "without the keep-in areas",
    Reason.UNKNOWN_GROUND: "if the unknown ground may be driven",
    Reason.MORPHING_MAP: "without the morphing map's limit",
    Reason.BUBBLE: "without the safety bubble",
    Reason.SIGHT_LINE: "with a limit on sight that gives a little",
    Reason.BORDER: "if the border of the map may be driven",
}
# nobody can say what a path over these would be like
NOT_TO_BE_TRIED = (Reason.UNKNOWN_GROUND, Reason.BORDER, Reason.SIGHT_LINE)
# an angle is looked for this closely
ANGLE_RAD = math.radians(0.05)
# a dilution that exact sight lines refuse is tried again so many times as large
MORE_DILUTION = (1.0, 1.05, 1.25)


def proof_of(problem: PathProblem, field: CostField, ends: Sequence[Ends], leg: int, shows: Shows) -> Unreachable:
    """What cuts a leg of the way: for a problem whose ``grid_way`` found none there."""
    begin, end = ends[leg].nodes, ends[leg + 1].nodes
    found = []
    for reason in _present(field):
        at = _cut(field, reason, begin, end)
        for relaxation in _tried(problem, _candidates(problem, field, reason, at, leg), shows):
            found.append((relaxation, _first_of(field, at[1], at[2]) if len(at[1]) else _place(problem, leg)))
    turned = _gentler(problem, field, ends[leg : leg + 2])
    if turned is not None:
        found += [(relaxation, turned[1]) for relaxation in _tried(problem, iter(turned[:1]), shows)]
    found.sort(key=lambda pair: _price(pair[0]))
    if found:
        cheapest, where = found[0]
        return Unreachable(cheapest.reason, where, tuple(relaxation for relaxation, _ in found))
    return _several(problem, field, begin, end, leg)


def closed_in(problem: PathProblem, place: str) -> Unreachable:
    """What cuts the way where exact sight lines refused all that was tried around the start, goal or way-point."""
    at: Goal = problem.goals[0]
    if place != "goal":
        at = problem.start if place == "start" else problem.way_points[int(place.removeprefix("way-point ")) - 1]
    little = Relaxation(Reason.SIGHT_LINE, math.nan, math.nan, REMOVABLE[Reason.SIGHT_LINE])
    return Unreachable(Reason.SIGHT_LINE, _middle(at), (little,))


def _middle(goal: Goal) -> Where:
    return goal if isinstance(goal, tuple) else (goal.centroid.x, goal.centroid.y)


def _place(problem: PathProblem, leg: int) -> Where:
    """Where a leg begins."""
    return (problem.start, *problem.way_points)[leg]


def _present(field: CostField) -> list[Reason]:
    bits = int(np.bitwise_or.reduce(field.reasons, axis=None))
    return list(reasons_of(bits))


def _price(relaxation: Relaxation) -> tuple[bool, float]:
    """Shown before not shown; then how much a limit gives, as a share of itself; all of it is dearest."""
    if math.isnan(relaxation.needed):
        return not relaxation.shown, math.inf
    share = abs(relaxation.needed - relaxation.asked) / max(abs(relaxation.asked), 1e-9)
    return not relaxation.shown, share


def _tried(problem: PathProblem, candidates: Iterator[Relaxation], shows: Shows) -> Iterator[Relaxation]:
    """The first of the candidates with which a path is shown; one that cannot be tried, or was not for want of time."""
    for relaxation in candidates:
        if relaxation.reason in NOT_TO_BE_TRIED:
            yield relaxation
            return
        shown = shows(_relaxed(problem, relaxation))
        if shown is not False:
            yield replace(relaxation, shown=bool(shown))
            return


def _relaxed(problem: PathProblem, relaxation: Relaxation) -> PathProblem:
    """The problem with a limit that gives way."""
    reason, needed, limits = relaxation.reason, relaxation.needed, problem.limits
    rover = problem.rover
    if reason is Reason.SLOPE:
        return replace(problem, rover=replace(rover, max_slope_rad=needed))
    if reason is Reason.PITCH_OR_ROLL:
        times = needed / relaxation.asked
        pitch_rad, roll_rad = (min(times * angle, math.pi / 2) for angle in (rover.max_pitch_rad, rover.max_roll_rad))
        return replace(problem, rover=replace(rover, max_pitch_rad=pitch_rad, max_roll_rad=roll_rad))
    if reason is Reason.STEP:
        return replace(problem, rover=replace(rover, max_step_m=needed))
    if reason is Reason.ANCHORS:
        return replace(problem, limits=replace(limits, min_anchors=round(needed)))
    if reason is Reason.DOP:
        return replace(problem, limits=replace(limits, dop_limit=needed))
    if reason is Reason.BUBBLE:
        return replace(problem, limits=replace(limits, bubble_epsilon=0.0))
    if reason is Reason.NO_GO:
        return replace(problem, no_go=())
    if reason is Reason.KEEP_IN:
        return replace(problem, keep_in=())
    assert reason is Reason.MORPHING_MAP, f"{reason} is never tried"
    return replace(problem, maps=None)


def _cut(field: CostField, reason: Reason, begin: Nodes, end: Nodes) -> tuple[float, Nodes, npt.NDArray[np.bool_]]:
    """(the least that a limit must give over squares if all others stay, the way, squares that break it)."""
    violates = (field.reasons & bit_of(reason)) != 0
    value = np.where(violates, _measure(field, reason), -np.inf)
    value[(field.reasons & ~bit_of(reason)) != 0] = np.inf
    worst, nodes = least_worst_way(value, begin, end)
    return float(worst), nodes, violates


def _candidates(
    problem: PathProblem, field: CostField, reason: Reason, cut: tuple[float, Nodes, npt.NDArray[np.bool_]], leg: int
) -> Iterator[Relaxation]:
    """What a limit may have to give, least first."""
    worst = cut[0]
    if reason is Reason.SLOPE:
        least_rad = _least_slope_rad(problem, field, leg)
        found = [_slope(problem, value, least_rad) for value in (least_rad, worst) if math.isfinite(value)]
        yield from found[:1] if len(found) == 2 and found[0].needed == found[1].needed else found
    elif reason in REMOVABLE:
        if math.isfinite(worst) or reason not in NOT_TO_BE_TRIED:
            yield Relaxation(reason, math.nan, math.nan, REMOVABLE[reason])
    elif math.isfinite(worst):
        if reason is Reason.STEP:
            needed_m, asked_m = math.ceil(worst * 100.0 + 1e-6) / 100.0, problem.rover.max_step_m
            sentence = f"with steps up to {needed_m:.2f} m instead of {asked_m:.2f} m"
            yield Relaxation(reason, asked_m, needed_m, sentence)
        elif reason is Reason.ANCHORS:
            asked = problem.limits.min_anchors
            for fewer in range(round(-worst), -1, -1):
                sentence = f"with {fewer} anchors {problem.counted} instead of {asked}"
                yield Relaxation(reason, float(asked), float(fewer), sentence)
        elif reason is Reason.DOP:
            for more in MORE_DILUTION:
                needed = math.ceil(worst * more * 10.0 + 1e-6) / 10.0
                sentence = f"with a dilution below {needed:.1f} instead of {problem.limits.dop_limit:.1f}"
                yield Relaxation(reason, problem.limits.dop_limit, needed, sentence)


def _measure(field: CostField, reason: Reason) -> Values:
    """What each square asks of a limit; larger is worse, inf = no limit would do."""
    if reason is Reason.SLOPE:
        return np.where(np.isnan(field.slope), np.inf, np.arctan(field.slope.astype(np.float64)))
    if reason is Reason.STEP:
        return np.where(np.isnan(field.step_m), np.inf, field.step_m.astype(np.float64))
    if reason is Reason.ANCHORS:
        return -field.count.astype(np.float64)
    if reason is Reason.DOP:
        return np.where(np.isnan(field.dop), np.inf, field.dop.astype(np.float64))
    return np.zeros(field.reasons.shape)


def _slope(problem: PathProblem, worst_rad: float, least_rad: float) -> Relaxation:
    asked_rad = problem.rover.max_slope_rad
    needed_deg = math.ceil(math.degrees(worst_rad) * 100.0 + 1e-6) / 100.0
    sentence = f"with slopes up to {needed_deg:.2f} deg instead of {math.degrees(asked_rad):.2f} deg"
    needed_rad = min(math.radians(needed_deg), math.pi / 2)
    return Relaxation(Reason.SLOPE, asked_rad, needed_rad, sentence, least=least_rad)


def _least_slope_rad(problem: PathProblem, field: CostField, leg: int) -> float:
    """With a lesser slope there is surely no way: that of the least steep way over triangles that may be open else."""
    steep = replace(problem, rover=replace(problem.rover, max_slope_rad=math.pi / 2))
    leaves, codes = Judge(steep, field, None).coarsest()
    slope = np.hypot(*slopes_of(field.grid)).ravel()
    kept = codes != CLOSED
    leaves, slope = leaves.some(kept), slope[kept]
    at = [
        np.flatnonzero(leaves.hold(np.array([[field.grid.post_at(*_middle(place))]]))[:, 0])
        for place in (
            _place(problem, leg),
            *((problem.way_points[leg],) if leg < len(problem.way_points) else problem.goals),
        )
    ]
    graph = Graph(len(leaves), leaves.sides())
    worst, _ = graph.cheapest(slope[graph.edges].max(axis=1), at[0], np.concatenate(at[1:]), by_worst=True)
    return math.atan(worst) if math.isfinite(worst) and math.atan(worst) > problem.rover.max_slope_rad else math.inf


def _gentler(problem: PathProblem, field: CostField, ends: Sequence[Ends]) -> tuple[Relaxation, Where] | None:
    """The least pitch or roll, both raised alike, with which there is a way over what may be driven."""
    rover, kernel_field = problem.rover, field.for_kernels()
    asked_rad = max(min(rover.max_pitch_rad, rover.max_roll_rad), 1e-3)
    if math.isinf(kernel_field.rates.max_pitch) and math.isinf(kernel_field.rates.max_roll):
        return None
    low, high = 1.0, math.pi / 2 / asked_rad
    free = grid_way(_raised(kernel_field, rover.max_pitch_rad, rover.max_roll_rad, high), ends, SIXTEEN)[0]
    if free is None:
        return None
    while (high - low) * asked_rad > ANGLE_RAD:
        middle = 0.5 * (low + high)
        way = grid_way(_raised(kernel_field, rover.max_pitch_rad, rover.max_roll_rad, middle), ends, SIXTEEN)[0]
        low, high = (middle, high) if way is None else (low, middle)
    at = field.grid.position_of(*(float(x) for x in free.places[len(free.places) // 2]))
    needed_rad = min(asked_rad * high, math.pi / 2)
    sentence = (
        f"with pitch and roll limits {math.degrees(needed_rad - asked_rad):.1f} deg larger than "
        f"{math.degrees(asked_rad):.1f} deg"
    )
    return Relaxation(Reason.PITCH_OR_ROLL, asked_rad, needed_rad, sentence), at


def _raised(field: KernelField, pitch_rad: float, roll_rad: float, times: float) -> KernelField:
    """The field with both limits so many times as large."""
    max_pitch, max_roll = (
        math.inf if angle * times >= math.pi / 2 - 1e-9 else math.tan(angle * times) for angle in (pitch_rad, roll_rad)
    )
    return field._replace(rates=field.rates._replace(max_pitch=max_pitch, max_roll=max_roll))


def _several(problem: PathProblem, field: CostField, begin: Nodes, end: Nodes, leg: int) -> Unreachable:
    """No limit alone would do: the one met first on the way that breaks the fewest kinds."""
    broken = np.bitwise_count(field.reasons).astype(np.float64)
    _, nodes = least_worst_way(broken, begin, end)
    where = _first_of(field, nodes, field.reasons != 0) if len(nodes) else _place(problem, leg)
    square = field.square_at(*field.grid.post_at(*where))
    first = reasons_of(int(field.reasons[square]))
    return Unreachable(first[0] if first else Reason.PITCH_OR_ROLL, where, ())


def _first_of(field: CostField, nodes: Nodes, marked: npt.NDArray[np.bool_]) -> Where:
    """The middle of the first marked square of a way, or of its first square."""
    rows, cols = np.divmod(nodes, field.reasons.shape[1])
    hits = np.flatnonzero(marked[rows, cols])
    n = int(hits[0]) if len(hits) else 0
    return field.grid.position_of(float(rows[n]) + 0.5, float(cols[n]) + 0.5)
