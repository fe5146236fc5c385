"""Starts and goals where exact sight lines see less than the map: why they are forbidden, and the nearest allowed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
import shapely

from planning import PlaceError
from planning.paths import PathLimits, PathProblem, PathStatus, PlanBudget, Reason, RoverModel, plan_path
from planning.paths.checks import breaks
from planning.paths.ends import ends_of
from planning.paths.exact_lines import Enough
from planning.paths.fields import bit_of, cost_field
from planning.paths.sight_maps import Positioning, Sightings, sight_maps
from terrain import ElevationGrid, height_at
from visibility import Anchor, dop
from visibility.signal import RADIOS

GRID_ALONE = PlanBudget(sampling=False)
START, GOAL = (22.0, -98.0), (281.0, -97.0)
ANCHORS = tuple(
    Anchor(f"A{n}", *place)
    for n, place in enumerate(((10.0, -20.0, 80.0), (290.0, -20.0, 95.0), (20.0, -180.0, 70.0), (280.0, -170.0, 99.0)))
)


class Veiled:
    """The true maps of a problem, whose exact sight lines lose some anchors at some places."""

    def __init__(self, problem: PathProblem, left: Callable[[float, float], int]) -> None:
        true = sight_maps(problem)
        assert true is not None
        self._true, self._left, self._grid = true, left, problem.grid

    @property
    def warnings(self) -> tuple[str, ...]:
        return ()

    def positioning(self, arrival_s: npt.NDArray[np.float64] | None) -> Positioning:
        return self._true.positioning(arrival_s)

    def sightings(
        self, places: npt.NDArray[np.float64], times_s: npt.NDArray[np.float64], enough: Enough | None = None
    ) -> Sightings:
        seen = self._true.sightings(places, times_s)
        left = np.array([self._left(*self._grid.position_of(*place)) for place in places.tolist()])
        visible = seen.visible & (np.arange(seen.visible.shape[1]) < left[:, None])
        return Sightings(visible, seen.margin_m, np.where(left >= 3, seen.dop, np.inf))


def level_problem(**limits: float) -> PathProblem:
    grid = ElevationGrid(np.zeros((40, 60), np.float32), 5.0, 5.0)
    asked = PathLimits(**limits)
    return PathProblem(grid, START, GOAL, anchors=ANCHORS, limits=asked, budget=PlanBudget(sampling=False))


@pytest.mark.parametrize(
    ("left", "limits", "sentence", "reason"),
    [
        (1, {"min_anchors": 4}, "only 1 of the 4 anchors asked for is in sight there", Reason.ANCHORS),
        (2, {"min_anchors": 3}, "only 2 of the 3 anchors asked for are in sight there", Reason.ANCHORS),
        (0, {"min_anchors": 2}, "none of the 2 anchors asked for is in sight there", Reason.ANCHORS),
        (0, {"min_anchors": 1}, "no anchor is in sight there", Reason.ANCHORS),
        (2, {"dop_limit": 50.0}, "no fix is possible there, and a dilution below 50 is asked for", Reason.DOP),
    ],
)
@pytest.mark.parametrize("place", ["start", "goal"])
def test_a_place_that_exact_sight_lines_forbid_says_why_and_names_the_nearest_that_they_allow(
    place: str, left: int, limits: dict[str, float], sentence: str, reason: Reason
) -> None:
    problem = level_problem(**limits)
    east_m, north_m = START if place == "start" else GOAL
    maps = Veiled(problem, lambda e, n: left if abs(e - east_m) < 12.0 and abs(n - north_m) < 60.0 else 4)
    with pytest.raises(PlaceError) as refused:
        ends_of(problem, cost_field(problem, maps), maps)
    nearest = refused.value.nearest_m
    assert nearest is not None
    assert str(refused.value) == (
        f"The {place} is forbidden: {sentence}; the nearest allowed place with a way "
        f"{'to the goal' if place == 'start' else 'from the start'} is "
        f"({nearest[0]:.2f} m east, {nearest[1]:.2f} m north)."
    )
    assert (refused.value.place, refused.value.reasons) == (place, (reason,))
    # squares are 5 m wide: the nearest place beyond the veil is at its edge, or a little inside the next square
    assert 12.0 <= np.hypot(nearest[0] - east_m, nearest[1] - north_m) < 17.5


def test_anchors_whose_signals_decide_are_called_usable() -> None:
    heard = tuple(replace(anchor, radio=RADIOS["868MHz"]) for anchor in ANCHORS)
    problem = replace(level_problem(min_anchors=2), anchors=heard)
    maps = Veiled(problem, lambda _e, _n: 1)
    with pytest.raises(PlaceError, match=r"only 1 of the 2 anchors asked for is usable there"):
        ends_of(problem, cost_field(problem, maps), maps)


def test_a_veil_over_everything_leaves_no_place_to_name() -> None:
    problem = level_problem(min_anchors=2)
    maps = Veiled(problem, lambda _e, _n: 1)
    with pytest.raises(PlaceError, match=r"only 1 of the 2 .* no place on the map is allowed") as refused:
        ends_of(problem, cost_field(problem, maps), maps)
    assert refused.value.nearest_m is None


def test_a_dilution_beyond_the_limit_is_told_with_both_numbers() -> None:
    problem = level_problem(dop_limit=1.59)
    receiver_m = (*START, height_at(problem.grid, *START) + problem.rover.receiver_above_ground_m)
    at_start = dop(
        np.array([(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in ANCHORS]), receiver_m
    ).pdop
    assert at_start >= 1.59
    with pytest.raises(PlaceError) as refused:
        plan_path(problem)
    assert f"start is forbidden: the dilution there is {at_start:.2f}, and one below 1.59 is asked" in str(
        refused.value
    )


def test_a_dilution_that_reaches_the_limit_is_no_good_one() -> None:
    """Eq. 15: no-fly is where the dilution is the limit or more."""
    none = np.zeros((5, 4))
    seen = Sightings(none.astype(np.bool_), none, np.array([1.9, 2.0, 2.1, np.inf, np.nan]))
    assert breaks(PathLimits(dop_limit=2.0), seen).tolist() == [False, True, True, True, True]
    assert not breaks(PathLimits(), seen).any()
    maps = sight_maps(level_problem(dop_limit=50.0))
    assert maps is not None
    squares = maps.positioning(None).dop
    limit = float(squares[20, 30])
    barred = cost_field(level_problem(dop_limit=limit), maps).reasons & bit_of(Reason.DOP) != 0
    assert barred[20, 30]
    assert not barred.all()
    assert (barred == (squares >= np.float32(limit))).all()


def test_a_start_that_has_its_sight_and_loses_it_on_every_way_on_is_not_forbidden_but_cut_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = level_problem(min_anchors=2)
    maps = Veiled(
        problem, lambda e, n: 1 if abs(e - START[0]) + abs(n - START[1]) > 0.01 and e < 25.0 and n > -100.0 else 4
    )
    monkeypatch.setattr("planning.paths.planning.sight_maps", lambda _: maps)
    outcome = plan_path(problem)
    assert (outcome.status, outcome.stopped_by) == (PathStatus.UNDECIDED, "grain")
    assert outcome.unreachable is not None
    assert outcome.unreachable.grain is None
    assert (outcome.unreachable.reason, outcome.unreachable.where_m) == (Reason.SIGHT_LINE, START)
    assert outcome.sentence.startswith(
        "No way was found, and that there is none is not proved, for exact sight lines refused what was tried: what "
        "blocks it near (22 m east"
    )


def test_a_goal_area_is_reached_where_it_leaves_room_beside_a_no_go_area_that_takes_all_its_squares() -> None:
    grid = ElevationGrid(np.full((30, 40), 100.0, np.float32), 30.0, 30.0, 0.0, 870.0)
    goal, no_go = shapely.box(900.0, 400.0, 1100.0, 500.0), shapely.box(850.0, 380.0, 1090.0, 520.0)
    problem = PathProblem(grid, (150.0, 435.0), goal, no_go=(no_go,), budget=GRID_ALONE)
    outcome = plan_path(problem)
    assert outcome.path is not None
    end_m = float(outcome.path.east_m[-1]), float(outcome.path.north_m[-1])
    assert shapely.intersects_xy(goal, *end_m)
    assert not shapely.intersects_xy(no_go, *end_m)
    assert np.hypot(np.diff(outcome.path.east_m), np.diff(outcome.path.north_m)).sum() < 1100.0
    with pytest.raises(PlaceError, match="goal area cannot be stood on: no-go area"):
        plan_path(replace(problem, no_go=(shapely.box(850.0, 380.0, 1110.0, 520.0),)))


@pytest.mark.parametrize("east_m", [300.0, 299.7, 307.0, 310.0])
def test_all_places_of_an_even_slope_are_alike_where_roll_leaves_few_headings(east_m: float) -> None:
    rise = (29 - np.mgrid[0:30, 0:40][0]) * 30.0 * np.tan(np.radians(15.0))
    grid = ElevationGrid((rise + 100.0).astype(np.float32), 30.0, 30.0, 0.0, 870.0)
    rover = RoverModel(max_slope_rad=math.radians(30.0), max_roll_rad=math.radians(3.0))
    outcome = plan_path(PathProblem(grid, (east_m, 100.0), (310.0, 700.0), rover=rover, budget=GRID_ALONE))
    assert outcome.status is PathStatus.FOUND
