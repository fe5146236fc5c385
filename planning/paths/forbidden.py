"""Why a place may not be used, in words, and the nearest one that may."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from planning.errors import PlaceError
from planning.questions.problems import PathProblem, Place
from terrain import told_place

from .checks import breaks
from .fields import CostField
from .outcomes import Reason
from .sight_maps import Sightings, SightMaps

__all__ = ["Ground", "place_error", "sight_error"]

# how far inside its square the nearest allowed place is put, in cells
INSIDE = 0.01
# so many of the nearest places are asked for by exact sight lines at once, and so often
TRIED, TIMES = 128, 32
# of these a place is forbidden; of all others it cannot be stood on
OF_SIGHT = (Reason.ANCHORS, Reason.DOP, Reason.SIGHT_LINE)
WORDS = {Reason.ANCHORS: "too few anchors are in sight there", Reason.DOP: "the dilution there is beyond the limit"}


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
    why = " and ".join(_why(ground, reason, post, what) for reason in reasons)
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


def _why(ground: Ground, reason: Reason, post: tuple[float, float], what: str) -> str:
    """A reason with the number that it stands on, where it is one square's."""
    field = ground.field
    square = field.square_at(*(max(at, 0.0) for at in post))
    if what:
        return WORDS.get(reason, str(reason))
    if reason is Reason.SLOPE:
        return f"slope ({np.degrees(np.arctan(field.slope[square])):.1f} deg)"
    if reason is Reason.ANCHORS:
        return _count_words(ground, int(field.count[square]))
    if reason is Reason.DOP:
        return _dop_words(ground, float(field.dop[square]))
    return str(reason)


def _count_words(ground: Ground, count: int) -> str:
    asked = ground.problem.limits.min_anchors
    if count == 0:
        return (
            "no anchor is in sight there" if asked == 1 else f"none of the {asked} anchors asked for is in sight there"
        )
    return f"only {count} of the {asked} anchors asked for {'is' if count == 1 else 'are'} in sight there"


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
