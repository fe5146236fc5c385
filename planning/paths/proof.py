"""The proof that there is no way: which limit cuts it, where, and the least that each limit by itself must give.

On the field a way from square to square exists exactly where a straight-sided one does, so what the search over squares
does not reach cannot be reached without breaking a limit of the field.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from planning.kernels.path_proof import least_worst_way

from .ends import Ends
from .fields import CostField, KernelField, bit_of, reasons_of
from .outcomes import Reason, Relaxation, Unreachable
from .problems import Goal, PathProblem
from .ways import SIXTEEN, grid_way

__all__ = ["closed_in", "proof_of"]

Values = npt.NDArray[np.float64]
Nodes = npt.NDArray[np.int64]

REMOVABLE = {
    Reason.NO_GO: "without the no-go areas",
    Reason.KEEP_IN: "without the keep-in areas",
    Reason.UNKNOWN_GROUND: "if the unknown ground may be driven",
    Reason.MORPHING_MAP: "without the morphing map's limit",
    Reason.BUBBLE: "without the safety bubble",
    Reason.SIGHT_LINE: "with a limit on sight that gives a little",
    Reason.BORDER: "if the border of the map may be driven",
}
# an angle is looked for this closely
ANGLE_RAD = math.radians(0.05)


def proof_of(problem: PathProblem, field: CostField, ends: Sequence[Ends], leg: int) -> Unreachable:
    """What cuts a leg of the way: for a problem whose ``grid_way`` found none there."""
    begin, end = ends[leg].nodes, ends[leg + 1].nodes
    found = []
    for reason in _present(field):
        relaxation = _relaxed(problem, field, reason, begin, end)
        if relaxation is not None:
            found.append(relaxation)
    turned = _gentler(problem, field, ends[leg : leg + 2])
    if turned is not None:
        found.append(turned)
    found.sort(key=lambda pair: _price(pair[0]))
    if found:
        cheapest, where = found[0]
        return Unreachable(cheapest.reason, where, tuple(relaxation for relaxation, _ in found))
    return _several(field, begin, end)


def closed_in(problem: PathProblem, place: str) -> Unreachable:
    """What cuts the way where exact sight lines refused all that was tried around the start, goal or way-point."""
    at: Goal = problem.goals[0]
    if place != "goal":
        at = problem.start if place == "start" else problem.way_points[int(place.removeprefix("way-point ")) - 1]
    where = at if isinstance(at, tuple) else (at.centroid.x, at.centroid.y)
    little = Relaxation(Reason.SIGHT_LINE, math.nan, math.nan, REMOVABLE[Reason.SIGHT_LINE])
    return Unreachable(Reason.SIGHT_LINE, where, (little,))


def _present(field: CostField) -> list[Reason]:
    bits = int(np.bitwise_or.reduce(field.reasons, axis=None))
    return list(reasons_of(bits))


def _price(relaxation: Relaxation) -> float:
    """How much a limit gives, as a share of itself; one that goes altogether costs most."""
    if math.isnan(relaxation.needed):
        return math.inf
    return abs(relaxation.needed - relaxation.asked) / max(abs(relaxation.asked), 1e-9)


def _relaxed(
    problem: PathProblem, field: CostField, reason: Reason, begin: Nodes, end: Nodes
) -> tuple[Relaxation, tuple[float, float]] | None:
    """The least that one limit must give if all others stay; None where that opens no way."""
    violates = (field.reasons & bit_of(reason)) != 0
    value = np.where(violates, _measure(field, reason), -np.inf)
    value[(field.reasons & ~bit_of(reason)) != 0] = np.inf
    worst, nodes = least_worst_way(value, begin, end)
    if not math.isfinite(worst):
        return None
    where = _first_of(field, nodes, violates)
    return _relaxation(problem, reason, float(worst)), where


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


def _relaxation(problem: PathProblem, reason: Reason, worst: float) -> Relaxation:
    limits, rover = problem.limits, problem.rover
    if reason is Reason.SLOPE:
        needed_deg = math.ceil(math.degrees(worst) * 10.0 + 1e-6) / 10.0
        asked_deg = math.degrees(rover.max_slope_rad)
        sentence = f"with slopes up to {needed_deg:.1f} deg instead of {asked_deg:.1f} deg"
        return Relaxation(reason, rover.max_slope_rad, math.radians(needed_deg), sentence)
    if reason is Reason.STEP:
        needed_m = math.ceil(worst * 100.0 + 1e-6) / 100.0
        return Relaxation(
            reason, rover.max_step_m, needed_m, f"with steps up to {needed_m:.2f} m instead of {rover.max_step_m:.2f} m"
        )
    if reason is Reason.ANCHORS:
        fewer = round(-worst)
        sentence = f"with {fewer} anchors in sight instead of {limits.min_anchors}"
        return Relaxation(reason, float(limits.min_anchors), float(fewer), sentence)
    if reason is Reason.DOP:
        needed = math.ceil(worst * 10.0 + 1e-6) / 10.0
        return Relaxation(
            reason, limits.max_dop, needed, f"with a dilution up to {needed:.1f} instead of {limits.max_dop:.1f}"
        )
    return Relaxation(reason, math.nan, math.nan, REMOVABLE[reason])


def _gentler(
    problem: PathProblem, field: CostField, ends: Sequence[Ends]
) -> tuple[Relaxation, tuple[float, float]] | None:
    """The least pitch or roll, both raised alike, with which there is a way over what may be driven."""
    rover, kernel_field = problem.rover, field.for_kernels()
    asked_rad = max(min(rover.max_pitch_rad, rover.max_roll_rad), 1e-3)
    if math.isinf(kernel_field[5][2]) and math.isinf(kernel_field[5][3]):
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
    tangents = (
        math.inf if angle * times >= math.pi / 2 - 1e-9 else math.tan(angle * times) for angle in (pitch_rad, roll_rad)
    )
    return (*field[:5], (*field[5][:2], *tangents, *field[5][4:]), field[6])


def _several(field: CostField, begin: Nodes, end: Nodes) -> Unreachable:
    """No limit alone would do: the one met first on the way that breaks the fewest kinds."""
    broken = np.bitwise_count(field.reasons).astype(np.float64)
    _, nodes = least_worst_way(broken, begin, end)
    where = _first_of(field, nodes, field.reasons != 0)
    square = field.square_at(*field.grid.post_at(*where))
    first = reasons_of(int(field.reasons[square]))
    return Unreachable(first[0] if first else Reason.PITCH_OR_ROLL, where, ())


def _first_of(field: CostField, nodes: Nodes, marked: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """The middle of the first marked square of a way, or of its first square."""
    rows, cols = np.divmod(nodes, field.reasons.shape[1])
    hits = np.flatnonzero(marked[rows, cols])
    n = int(hits[0]) if len(hits) else 0
    return field.grid.position_of(float(rows[n]) + 0.5, float(cols[n]) + 0.5)
