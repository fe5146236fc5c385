"""Which drone to move where when an anchor stays occluded: the cheapest move that restores what is asked ahead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import NoCandidateError
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import check_anchors

from .goals import Goal
from .judges import CountJudge, judge_of
from .moves import ROUNDING, USUAL_HEIGHTS_M, Move, MoveQuestion, moved_to
from .rules import candidates_within, feasible_candidates
from .sight import forget_doubted, positions_of
from .stretches import SeenStretch, flight_costs, problem_along, worth_over
from .together import may_stand_beside

__all__ = ["Repositioning", "reposition", "reposition_for"]

Floats = npt.NDArray[np.float64]
MOST_CHECKS = 400  # places whose lines are traced exactly, cheapest first
TRIES = 8  # places of each drone that are traced when none restores


@dataclass(frozen=True, slots=True)
class Repositioning:
    """The answer to ``reposition``.

    move: the cheapest that restores the share asked for; where none does, the one that leaves most; None where nothing
        has to move or can. before, after: the goal's value over the stretch, the occluded anchors not counted before.
    restored: whether the share is reached after. places: how many were looked at. sentence: all that in words.
    """

    move: Move | None
    before: float
    after: float
    restored: bool
    places: int
    sentence: str

    def anchors_after(self, anchors: Sequence[Anchor]) -> tuple[Anchor, ...]:
        """The anchors with the moved one at its new place."""
        if self.move is None:
            return tuple(anchors)
        return tuple(self.move.to if anchor.id == self.move.anchor.id else anchor for anchor in anchors)


def reposition(
    grid: ElevationGrid, anchors: Sequence[Anchor], path_m: npt.ArrayLike, question: MoveQuestion
) -> Repositioning:
    """The cheapest move of one drone that restores a share of the goal over the path (n, 2) ahead.

    Every post within the flight range is considered at each of the heights. Raises PlacementError, AnchorError.
    """
    check_anchors(grid, anchors)
    return reposition_for(
        SeenStretch.of(grid, path_m, question.receiver_above_ground_m, question.sight), anchors, question
    )


def reposition_for(
    stretch: SeenStretch, anchors: Sequence[Anchor], question: MoveQuestion, *, toward: bool = False
) -> Repositioning:
    """The same over a stretch that is swept already.

    toward: where no move restores or gains, take one that brings points nearer to what the goal needs in sight.
    """
    question.check_ids(anchors)
    goal, share = question.goal, question.share
    counted = [anchor for anchor in anchors if anchor.id not in question.occluded]
    before, partly = worth_over(stretch, counted, goal)
    if before >= share - ROUNDING:
        return Repositioning(
            None, before, before, True, 0, f"Nothing has to move: {before:.1%} of the stretch as it is."
        )
    options: list[_Places] = []
    for anchor in anchors:
        if question.movable is None or anchor.id in question.movable:
            others = [other for other in counted if other.id != anchor.id]
            standing = [other for other in anchors if other.id != anchor.id]
            found = _places_of(stretch, anchor, others, standing, question)
            if found is not None:
                options.append(found)
    looked_at = sum(len(some.position_m) for some in options)
    chosen = _cheapest_that_restores(stretch, options, question)
    restored = chosen is not None
    if chosen is None:
        chosen = _best_effort(stretch, options, goal, (before, partly if toward else 1.0))
    if chosen is None:
        told = f"No move of one drone helps: {before:.1%} of the stretch before, and {looked_at:,} places give no more."
        return Repositioning(None, before, before, False, looked_at, told)
    move, after = chosen
    told = f"{move.words()}: {before:.1%} of the stretch before, {after:.1%} after" + (
        "." if restored else f"; no move of one drone restores {share:.0%}."
    )
    return Repositioning(move, before, after, restored, looked_at, told)


@dataclass(frozen=True, slots=True, eq=False)
class _Places:
    """Where one drone could go: places (n, 3), their shares over the few points, and what the flights cost.

    partly: mean part of the anchors that the goal needs in sight.
    """

    anchor: Anchor
    others: list[Anchor]
    position_m: Floats
    share: Floats
    partly: Floats
    flight_m: Floats
    flight_s: Floats


def _places_of(
    stretch: SeenStretch,
    anchor: Anchor,
    others: list[Anchor],
    standing: list[Anchor],
    question: MoveQuestion,
) -> _Places | None:
    """Every post within the flight range at every height, a cell away or more, as far as the rules allow; None = none.

    others: those that count; standing: all that stay where they are.
    """
    grid, goal, flight, rules = stretch.grid, question.goal, question.flight, question.rules
    here_m = np.array([anchor.east_m, anchor.north_m, anchor.altitude_m])
    heights_m = USUAL_HEIGHTS_M if question.above_ground_m is None else question.above_ground_m
    own_m = [anchor.altitude_m] if question.above_ground_m is None else []
    post, candidates = candidates_within(grid, here_m, flight.max_flight_m, heights_m, own_m, question.every)
    relayed = rules.link is not None and rules.link.relays > 0
    try:
        feasible = feasible_candidates(
            grid, candidates, replace(rules, link=None) if relayed else rules, stretch.targets
        )
    except NoCandidateError:
        return None
    numbers = feasible.number
    numbers = numbers[
        may_stand_beside(
            grid, candidates.position_m[numbers], positions_of(standing), rules.min_separation_m, rules.link
        )
    ]
    place_m = candidates.position_m[numbers]
    flight_m, flight_s = flight_costs(grid, flight, here_m, place_m)
    # what hides an occluded anchor is not on the map: less than a cell from where it is, it is taken to hide it too
    moved = np.linalg.norm(place_m - here_m, axis=1) >= min(grid.cell_east_m, grid.cell_north_m)
    keep = moved & (flight_m <= flight.max_flight_m)
    if rules.no_fly:
        ways = shapely.linestrings(
            np.stack([np.broadcast_to(here_m[:2], place_m[:, :2].shape), place_m[:, :2]], axis=1)
        )
        zone = shapely.union_all(rules.no_fly)
        shapely.prepare(zone)
        keep &= ~shapely.intersects(zone, ways)
    if not keep.any():
        return None
    numbers, place_m = numbers[keep], place_m[keep]
    bits = stretch.seen_from_posts(post[numbers], place_m, anchor.radio)
    for doubt in anchor.doubts:  # they go along where it moves by less than they reach
        near = np.hypot(*(place_m[:, :2] - here_m[:2]).T) <= doubt.reach_m
        kept = bits[near]
        forget_doubted(kept, (doubt,), stretch.few)
        bits[near] = kept
    rows = np.hstack([place_m, np.ones((len(place_m), 1))])
    problem = problem_along(stretch.few, goal, others, stretch.seen_from(others, stretch.few), rows, bits)
    everyone = np.arange(len(place_m))
    share = judge_of(problem).with_each([], everyone)
    partly = CountJudge(problem, goal.needed_with_spare, partial=True).with_each([], everyone)
    return _Places(anchor, others, place_m, share, partly, flight_m[keep], flight_s[keep])


def _cheapest_that_restores(
    stretch: SeenStretch, options: list[_Places], question: MoveQuestion
) -> tuple[Move, float] | None:
    """The cheapest place whose exact lines restore the share; candidates in the order of their cost."""
    # of a share below the whole the few points tell only roughly
    share = question.share
    enough = share - ROUNDING - (0.0 if share == 1.0 else 1.0 / len(stretch.few))
    queue = [
        (float((some.flight_m if question.cheapest == "distance" else some.flight_s)[n]), option, int(n))
        for option, some in enumerate(options)
        for n in np.flatnonzero(some.share >= enough)
    ]
    for _, option, number in sorted(queue)[:MOST_CHECKS]:
        move, (after, _) = _tried(stretch, options[option], number, question.goal)
        if after >= share - ROUNDING:
            return move, after
    return None


def _best_effort(
    stretch: SeenStretch, options: list[_Places], goal: Goal, before: tuple[float, float]
) -> tuple[Move, float] | None:
    """The place that leaves most, when nothing restores all that was asked for; None where nothing leaves more.

    before: (share, mean part of the anchors needed in sight) to better.
    """
    best, chosen = before, None
    for some in options:
        for number in np.lexsort((some.flight_m, -some.partly, -some.share))[:TRIES]:
            move, after = _tried(stretch, some, int(number), goal)
            if after[0] > best[0] + ROUNDING or (after[0] > best[0] - ROUNDING and after[1] > best[1] + ROUNDING):
                best, chosen = after, move
    return None if chosen is None else (chosen, best[0])


def _tried(stretch: SeenStretch, some: _Places, number: int, goal: Goal) -> tuple[Move, tuple[float, float]]:
    east_m, north_m, altitude_m = some.position_m[number].tolist()
    to = moved_to(some.anchor, (east_m, north_m, altitude_m))
    move = Move(some.anchor, to, float(some.flight_m[number]), float(some.flight_s[number]))
    return move, worth_over(stretch, [*some.others, to], goal)
