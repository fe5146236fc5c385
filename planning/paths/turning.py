"""Paths for a rover that cannot turn on the spot: OMPL's Dubins and Reeds-Shepp curves in the corridor of a way.

States are (metres along the way, metres to its right, radians that the heading is off the way's); between two of them
the rover drives OMPL's shortest curve, taken as a polyline of short chords that is judged and costed exactly.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from planning.kernels.path_smoothing import way_cost

from .corridors import Corridor
from .fields import KernelField
from .sampling import State, Tell, box_space, solved

__all__ = ["TurningTask"]

Places = npt.NDArray[np.float64]
Pose = tuple[float, float, float]

# curves are this much wider than the rover needs, for they are driven as chords
WIDER = 1.03
# chords are at most this part of a cell, and of the radius, long
OF_CELL, OF_RADIUS = 0.3, 0.25
# a way is driven in pieces of so many cells, or radii
PIECE_CELLS, PIECE_RADII = 48.0, 16.0
# a curve is some hundred segments: so many fewer motions are paid for than of straight ones
CURVES = 0.2


@dataclass(frozen=True, eq=False, slots=True)
class TurningTask:
    """Find a way that can be driven, near one that could be on the spot.

    way: (n, 2) fractional posts; fixed: those that stay. radius_m: the least of the rover's turns. can_reverse: whether
    it may also drive backwards. start_heading_rad: clockwise from north, None = along the way.
    """

    field: KernelField
    way: Places
    fixed: tuple[Places, ...]
    radius_m: float
    can_reverse: bool
    start_heading_rad: float | None
    iterations: int
    seed: int

    def solve(self, tell: Tell) -> Places | None:
        """Places of chords of the way that was found; None where none was. Told once only the end gets better."""
        corridor = Corridor(self.way, self.field.cells)
        stops_m = [0.0, *(corridor.along_m(place) for place in self.fixed), corridor.length_m]
        heading_rad = corridor.heading_rad(0.0) if self.start_heading_rad is None else self.start_heading_rad
        begin = (0.0, 0.0, _off(heading_rad, corridor.heading_rad(0.0)))
        chords: list[Places] = []
        for to_m in stops_m[1:]:
            end = (to_m, 0.0, 0.0)
            last = to_m == corridor.length_m
            leg = self._leg(corridor, begin, end, partial(_told_whole, tell, chords) if last else None)
            if leg is None:
                return None
            chords.append(leg)
            begin = end
        return _joined(chords)

    def _leg(self, corridor: Corridor, begin: Pose, end: Pose, tell: Tell | None) -> Places | None:
        """A leg by short pieces of the way, or else as a whole; forwards alone, or else backwards too."""
        share = (end[0] - begin[0]) / corridor.length_m
        piece_m = max(PIECE_CELLS * max(self.field.cells), PIECE_RADII * self.radius_m)
        cuts = np.linspace(begin[0], end[0], max(round((end[0] - begin[0]) / piece_m), 1) + 1)[1:-1].tolist()
        for reverse, inner in itertools.product((False, True) if self.can_reverse else (False,), (cuts, [])):
            poses = [begin, *((at_m, 0.0, 0.0) for at_m in inner), end]
            iterations = int(self.iterations * CURVES * share / (len(poses) - 1))
            found: list[Places] = []
            for one, other in itertools.pairwise(poses):
                told = partial(_told_whole, tell, found) if tell is not None and other is end else None
                piece = self._piece(corridor, one, other, iterations, reverse, told)
                if piece is None:
                    break
                found.append(piece)
            if len(found) == len(poses) - 1:
                return _joined(found)
        return None

    def _piece(
        self, corridor: Corridor, begin: Pose, end: Pose, iterations: int, reverse: bool, tell: Tell | None
    ) -> Places | None:
        wide_m = max(2.0 * self.radius_m, 2.0 * max(self.field.cells))
        back_m = 2.0 * self.radius_m
        bounds = ((max(begin[0] - back_m, 0.0), min(end[0] + back_m, corridor.length_m)), (-wide_m, wide_m))
        curves = _Curves(self.field, corridor, self.radius_m * WIDER, reverse)

        def driven(states: list[State]) -> Places:
            poses = [(state[0], state[1], state[2]) for state in states]
            return _joined([curves.chords(one, other, True) for one, other in itertools.pairwise(poses)])

        better = None if tell is None else lambda states: tell(driven(states))
        found = solved(box_space((*bounds, (-math.pi, math.pi))), curves, "BITstar", begin, end, iterations, better)
        return None if found is None else driven(found)


class _Curves:
    """Motions along OMPL's curves between poses of a corridor."""

    def __init__(self, field: KernelField, corridor: Corridor, radius_m: float, reverse: bool) -> None:
        from ompl import base

        self._field, self._corridor, self._radius_m = field, corridor, radius_m
        self._space: Any = (base.ReedsSheppStateSpace if reverse else base.DubinsStateSpace)(radius_m)
        limits = base.RealVectorBounds(2)
        limits.setLow(-1e9)
        limits.setHigh(1e9)
        self._space.setBounds(limits)
        self._begin, self._end, self._there = (self._space.allocState() for _ in range(3))
        self._step_m = min(OF_CELL * min(field.cells), OF_RADIUS * radius_m)
        self._reverse = reverse

    def allowed(self, state: State) -> bool:
        row, col = self._corridor.place(state[0], state[1])
        rows, cols = self._field.allowed.shape
        return 0.0 <= row < rows and 0.0 <= col < cols and bool(self._field.allowed[int(row), int(col)])

    def cost(self, begin: State, end: State) -> float:
        chords = self.chords((begin[0], begin[1], begin[2]), (end[0], end[1], end[2]), False)
        return float(way_cost(self._field, chords))

    def chords(self, begin: Pose, end: Pose, cusps: bool) -> Places:
        """(n, 2) fractional posts along the curve; cusps: with a place where the way turns back."""
        for state, pose in ((self._begin, begin), (self._end, end)):
            row, col = self._corridor.place(pose[0], pose[1])
            state.setXY(col * self._field.cells.east_m, -row * self._field.cells.north_m)
            # OMPL's yaw is counterclockwise from east
            state.setYaw(_off(math.pi / 2, self._corridor.heading_rad(pose[0]) + pose[2]))
        steps = max(math.ceil(self._space.distance(self._begin, self._end) / self._step_m), 1)
        shares = np.linspace(0.0, 1.0, steps + 1).tolist()
        poses = [self._at(share) for share in shares]
        if cusps and self._reverse:
            turned = self._turned_back(shares, poses)
            poses = [pose for _, pose in sorted([*zip(shares, poses, strict=True), *turned])]
        at_m = np.array(poses)[:, :2]
        places = np.column_stack([-at_m[:, 1] / self._field.cells.north_m, at_m[:, 0] / self._field.cells.east_m])
        # the ends are the corridor's to the last bit
        places[0] = self._corridor.place(begin[0], begin[1])
        places[-1] = self._corridor.place(end[0], end[1])
        return np.ascontiguousarray(places)

    def _at(self, share: float) -> tuple[float, float, float]:
        self._space.interpolate(self._begin, self._end, share, self._there)
        return self._there.getX(), self._there.getY(), self._there.getYaw()

    def _turned_back(
        self, shares: list[float], poses: list[tuple[float, float, float]]
    ) -> list[tuple[float, tuple[float, float, float]]]:
        """Where driving changes between forwards and backwards: found by halving between two places."""
        found = []
        forward = [_is_forward(one, other) for one, other in itertools.pairwise(poses)]
        for n in range(len(forward) - 1):
            if forward[n] == forward[n + 1]:
                continue
            low, high = shares[n], shares[n + 2]
            for _ in range(40):
                middle = 0.5 * (low + high)
                ahead = _is_forward(self._at(middle), self._at(middle + 1e-7))
                low, high = (middle, high) if ahead == forward[n] else (low, middle)
            found.append((low, self._at(low)))
        return found


def _told_whole(tell: Tell, before: list[Places], piece: Places) -> None:
    """Tell a piece with what leads to it."""
    tell(_joined([*before, piece]))


def _joined(pieces: list[Places]) -> Places:
    """Pieces each of which begins where the one before ends."""
    return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])


def _is_forward(one: tuple[float, float, float], other: tuple[float, float, float]) -> bool:
    yaw = 0.5 * (one[2] + one[2] + _off(other[2], one[2]))
    return (other[0] - one[0]) * math.cos(yaw) + (other[1] - one[1]) * math.sin(yaw) >= 0.0


def _off(angle_rad: float, other_rad: float) -> float:
    """How far one angle is beyond another, -pi to pi."""
    return (angle_rad - other_rad + math.pi) % math.tau - math.pi
