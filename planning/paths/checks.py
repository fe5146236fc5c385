"""Limits that a field of squares cannot judge, along a path and at a place: exact sight lines, and the safety bubble.

Squares in which a path breaks one are taken out of the field, and the path is planned again. Of a place that may not be
used it is told why, and which one near it may.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import scipy

from planning.errors import PlaceError
from planning.kernels.path_fields import clearances
from planning.questions.models import PathLimits
from planning.questions.problems import PathProblem, Place
from planning.validation import PathValidation
from terrain import told_place

from .describing import described
from .exact_lines import Enough
from .fields import CostField, bit_of, running_sums
from .outcomes import Path, Reason
from .places import Cells, sampled
from .sight_maps import Sightings, SightMaps

__all__ = [
    "Ground",
    "breaks",
    "hidden_places",
    "place_error",
    "sight_error",
    "without_broken_squares",
    "without_refused_squares",
]

Floats = npt.NDArray[np.float64]

# how closely sight lines are asked along a path, in cells: everywhere, and closer the nearer to the ground a line is
STEPS = (0.5, 0.0625, 0.0078125)
NEAR_M_PER_CELL = 0.25  # for the first; in proportion to the step for the others
# limits, as the validator calls them, that a path around the place keeps
REPAIRED = ("anchors in sight", "dilution", "height over the morphing map", "room for the safety bubble")
# how far inside its square the nearest allowed place is put, in cells
INSIDE = 0.01
# so many of the nearest places are asked for by exact sight lines at once, and so often
TRIED, TIMES = 128, 32
# of these a place is forbidden; of all others it cannot be stood on
OF_SIGHT = (Reason.ANCHORS, Reason.DOP, Reason.SIGHT_LINE)
WORDS = {Reason.ANCHORS: "too few anchors are in sight there", Reason.DOP: "the dilution there is beyond the limit"}


def without_broken_squares(
    problem: PathProblem, field: CostField, maps: SightMaps | None, places: Floats
) -> CostField | None:
    """The field without the squares in which a path breaks a limit on positioning; None where it breaks none."""
    if maps is None or not problem.limits.on_positioning:
        return None
    hidden = hidden_places(problem, field, maps, places)
    if len(hidden):
        return _without(field, hidden[:, 0].astype(np.intp), hidden[:, 1].astype(np.intp), Reason.SIGHT_LINE)
    if problem.limits.bubble_epsilon == 0.0:
        return None
    return _without_tight(problem, field, described(problem, field, maps, places), places)


def without_refused_squares(field: CostField, validation: PathValidation) -> CostField | None:
    """The field without the squares where the validator found a limit on sight broken; None where that is not it."""
    first_m = [check.first_m for check in validation.failures if str(check.limit) in REPAIRED]
    posts = [field.square_at(*field.grid.post_at(*place)) for place in first_m if place is not None]
    if len(posts) == 0 or len(posts) < len(validation.failures):
        return None
    rows, cols = np.array(posts, np.intp).T
    return _without(field, rows, cols, Reason.SIGHT_LINE)


def _without(field: CostField, rows: npt.NDArray[np.intp], cols: npt.NDArray[np.intp], reason: Reason) -> CostField:
    reasons = field.reasons.copy()
    reasons[np.clip(rows, 0, reasons.shape[0] - 1), np.clip(cols, 0, reasons.shape[1] - 1)] |= bit_of(reason)
    return replace(field, reasons=reasons)


def hidden_places(
    problem: PathProblem, field: CostField, maps: SightMaps | None, places: Floats, *, everywhere: bool = False
) -> Floats:
    """Places along a path at which exact sight lines break a limit; everywhere: over forbidden squares, too."""
    limits = problem.limits
    if maps is None or not limits.on_positioning:
        return np.zeros((0, 2))
    coarse, _ = sampled(places, STEPS[0])
    times_s = running_sums(field.for_kernels(everywhere=everywhere), coarse).time_s
    near_m = NEAR_M_PER_CELL * max(field.grid.cell_east_m, field.grid.cell_north_m)
    seen = maps.sightings(coarse, times_s)
    by_sight = tuple(np.argsort(-seen.visible.sum(axis=0), kind="stable").tolist())
    hidden = [coarse[breaks(limits, seen)]]
    loose = _loose(limits, seen, near_m, 1)[1:-1, 0]
    begin, end = ((np.column_stack([coarse, times_s])[part])[loose] for part in (slice(None, -1), slice(1, None)))
    for step, finer in pairwise(STEPS):
        if len(begin) == 0:
            break
        share = np.linspace(0.0, 1.0, round(step / finer) + 1)[:, None, None]
        at = begin + share * (end - begin)
        inner = at[1:-1].reshape(-1, 3)
        near_m *= finer / step
        # a point is good by enough lines whatever its others are; a dilution is of all of them
        enough = None if math.isfinite(limits.dop_limit) else Enough(limits.min_anchors, near_m, by_sight)
        seen = maps.sightings(inner[:, :2], inner[:, 2], enough)
        hidden.append(inner[breaks(limits, seen), :2])
        loose = _loose(limits, seen, near_m, len(begin))
        begin, end = at[:-1][loose], at[1:][loose]
    return np.concatenate(hidden)


def _loose(limits: PathLimits, seen: Sightings, near_m: float, abreast: int) -> npt.NDArray[np.bool_]:
    """(m + 1, p) which pieces before, between and after m points in a row may break a limit somewhere within.

    abreast: p, so many rows of m points lie side by side. A line that is in sight near to the ground may be hidden a
    little further on; lines further from it stay in sight from one point to the next.
    """
    sure = (seen.visible & ~(seen.margin_m < near_m)).reshape(-1, abreast, seen.visible.shape[1])
    stay = np.concatenate([sure[:1], sure[:-1] & sure[1:], sure[-1:]])
    loose = stay.sum(axis=2) < limits.min_anchors
    if math.isfinite(limits.dop_limit):
        near = (seen.visible.reshape(sure.shape) & ~sure).any(axis=2)
        loose[:-1] |= near
        loose[1:] |= near
    return np.asarray(loose)


def breaks(limits: PathLimits, seen: Sightings) -> npt.NDArray[np.bool_]:
    """(n,) whether limits on positioning are broken at the points that were looked at."""
    broken = np.zeros(len(seen.dop), np.bool_)
    broken[seen.visible.sum(axis=1) < limits.min_anchors] = True
    if math.isfinite(limits.dop_limit):
        broken[~(seen.dop < limits.dop_limit)] = True
    return broken


def _without_tight(problem: PathProblem, field: CostField, path: Path, places: Floats) -> CostField | None:
    """The field without squares whose surroundings are tighter than the bubble that the path has near them."""
    tight = np.flatnonzero(path.clearance_m < path.bubble_radius_m)
    if len(tight) == 0:
        return None
    fine, _ = sampled(places, 1.0)
    rows = np.minimum(fine[tight, 0].astype(np.intp), field.reasons.shape[0] - 1)
    cols = np.minimum(fine[tight, 1].astype(np.intp), field.reasons.shape[1] - 1)
    radius_m = np.zeros(field.reasons.shape)
    np.maximum.at(radius_m, (rows, cols), path.bubble_radius_m[tight])
    around = [
        2 * math.ceil(2.0 * radius_m.max() / cell_m) + 1 for cell_m in (field.grid.cell_north_m, field.grid.cell_east_m)
    ]
    radius_m = scipy.ndimage.maximum_filter(radius_m, size=[min(size, 201) for size in around])
    near_rows, near_cols = np.nonzero(radius_m)
    clearance_m = np.empty(len(near_rows))
    middles = np.column_stack([near_rows, near_cols]) + 0.5
    clearances(field.obstacles(), Cells.of(field.grid), middles, clearance_m)
    narrow = clearance_m < radius_m[near_rows, near_cols]
    without = _without(field, near_rows[narrow], near_cols[narrow], Reason.BUBBLE)
    return _without(without, rows, cols, Reason.BUBBLE)


@dataclass(frozen=True, eq=False, slots=True)
class Ground:
    """A question, its field, and maps to ask for exact sight lines; None = what the field says is enough."""

    problem: PathProblem
    field: CostField
    maps: SightMaps | None

    def seen(self, places: npt.NDArray[np.float64], name: str) -> Sightings | None:
        """What exact sight lines say of fractional posts (n, 2); None where no limit depends on them.

        With moving anchors only the start's time is known.
        """
        problem = self.problem
        if self.maps is None or not problem.limits.on_positioning or (problem.moves and name != "start"):
            return None
        return self.maps.sightings(places, np.zeros(len(places)))


def sight_error(ground: Ground, name: str, post: tuple[float, float]) -> PlaceError | None:
    """What is wrong with a place by exact sight lines; None where nothing is."""
    seen = ground.seen(np.array([post]), name)
    if seen is None or not breaks(ground.problem.limits, seen)[0]:
        return None
    count, dop = int(seen.visible.sum()), float(seen.dop[0])
    enough = count >= ground.problem.limits.min_anchors
    return _error(
        ground,
        f"The {name} is forbidden: " + (_dop_words(ground, dop) if enough else _count_words(ground, count)),
        name,
        (Reason.DOP if enough else Reason.ANCHORS,),
        post,
    )


def place_error(
    ground: Ground, name: str, post: tuple[float, float], reasons: tuple[Reason, ...], what: str = ""
) -> PlaceError:
    """What is wrong with a place, or with what = "area" with all of one; without reasons it lies outside the DEM."""
    if not reasons:
        return _error(ground, f"The {name} lies outside the DEM", name, ("outside the DEM",), post)
    verb = "is forbidden" if set(reasons) <= set(OF_SIGHT) else "cannot be stood on"
    why = " and ".join(_why(ground, name, reason, post, what) for reason in reasons)
    return _error(ground, f"The {name} {what}".rstrip() + f" {verb}: {why}", name, reasons, post)


def _error(ground: Ground, sentence: str, name: str, reasons: tuple[str, ...], post: tuple[float, float]) -> PlaceError:
    nearest, rest = None, "no place on the map is allowed."
    for squares, which in _from_where_to_go(ground, name):
        nearest = _nearest(ground, name, squares, *post)
        if nearest is not None:
            within_m = INSIDE * min(ground.field.grid.cell_north_m, ground.field.grid.cell_east_m)
            rest = f"the nearest allowed place {which}is {told_place(ground.field.grid, *nearest, within_m)}."
            break
    return PlaceError(f"{sentence}; {rest}", name, tuple(str(reason) for reason in reasons), nearest)


def _why(ground: Ground, name: str, reason: Reason, post: tuple[float, float], what: str) -> str:
    """A reason with the number that it stands on, the place's own where it is known, else that of its square."""
    field = ground.field
    square = field.square_at(*(max(at, 0.0) for at in post))
    if what:
        return WORDS.get(reason, str(reason))
    if reason is Reason.SLOPE:
        return f"slope ({np.degrees(np.arctan(field.slope[square])):.1f} deg)"
    if reason in (Reason.ANCHORS, Reason.DOP):
        seen, limits = ground.seen(np.array([post]), name), ground.problem.limits
        own = seen is not None and breaks(limits, seen)[0]
        if reason is Reason.ANCHORS:
            count = int(seen.visible.sum()) if seen is not None and own else int(field.count[square])
            return _count_words(ground, min(count, limits.min_anchors - 1))
        return _dop_words(ground, float(seen.dop[0]) if seen is not None and own else float(field.dop[square]))
    if reason is Reason.NO_GO and field.grid.standing is not None:
        return f"{reason} or building"
    return str(reason)


def _count_words(ground: Ground, count: int) -> str:
    asked = ground.problem.limits.min_anchors
    what = ground.problem.counted
    if count == 0:
        return f"no anchor is {what} there" if asked == 1 else f"none of the {asked} anchors asked for is {what} there"
    return f"only {count} of the {asked} anchors asked for {'is' if count == 1 else 'are'} {what} there"


def _dop_words(ground: Ground, dop: float) -> str:
    limits = ground.problem.limits
    if not math.isfinite(dop):
        return f"no fix is possible there, and a dilution below {limits.dop_limit:g} is asked for"
    return f"the dilution there is {dop:.2f}, and one below {limits.dop_limit:g} is asked for"


def _from_where_to_go(ground: Ground, name: str) -> Iterator[tuple[npt.NDArray[np.bool_], str]]:
    """Squares in which to look for a place, best first, and what to say of it.

    From a start the goals are to be reached, and all else from the start; where that stands nowhere itself, the most
    of the map that hangs together will do.
    """
    problem, field = ground.problem, ground.field
    # sides in common: through a corner goes nobody
    parts, _ = scipy.ndimage.label(field.reasons == 0)
    others = problem.goals if name == "start" else (problem.start,)
    there = set()
    for other in others:
        at = other if isinstance(other, tuple) else (other.representative_point().x, other.representative_point().y)
        if field.grid.contains(*at):
            there.add(int(parts[field.square_at(*field.grid.post_at(*at))]))
    reached = np.isin(parts, list(there - {0}))
    if reached.any():
        yield reached, "with a way to the goal " if name == "start" else "with a way from the start "
    elif parts.any():
        yield parts == int(np.bincount(parts.ravel())[1:].argmax()) + 1, ""
    yield parts > 0, ""


def _nearest(ground: Ground, name: str, squares: npt.NDArray[np.bool_], row: float, col: float) -> Place | None:
    """The nearest place in one of the squares, a little inside it, at which exact sight lines hold too."""
    grid, (rows, cols) = ground.field.grid, np.nonzero(squares)
    at_row = np.clip(row, rows + INSIDE, rows + 1 - INSIDE)
    at_col = np.clip(col, cols + INSIDE, cols + 1 - INSIDE)
    away = ((at_row - row) * grid.cell_north_m) ** 2 + ((at_col - col) * grid.cell_east_m) ** 2
    places = np.column_stack([at_row, at_col])[np.argsort(away, kind="stable")[: TRIED * TIMES]]
    for begin in range(0, len(places), TRIED):
        tried = places[begin : begin + TRIED]
        seen = ground.seen(tried, name)
        kept = tried if seen is None else tried[~breaks(ground.problem.limits, seen)]
        if len(kept):
            east_m, north_m = grid.position_of(*kept[0].tolist())
            return east_m, north_m
    return None
