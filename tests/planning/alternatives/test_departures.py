"""When to leave: a drone that passes a shadowed valley only later lets the rover pass only later."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from planning import PathProblemError
from planning.alternatives import plan_departures
from planning.paths import PathLimits, PathOutcome, PathProblem, PlanBudget, RoverModel, plan_path
from planning.validation import validate_path
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import AnchorTrack

CELL_M = 5.0


def behind_a_ridge(**changes: object) -> PathProblem:
    """The way runs behind a ridge that hides it from a drone far south until that has flown over to the north."""
    heights_m = np.zeros((30, 60), np.float32)
    heights_m[20, :] = 25.0
    grid = ElevationGrid(heights_m, CELL_M, CELL_M)
    ways_m = np.array([[150.0, -140.0, 20.0], [150.0, -140.0, 20.0], [150.0, -30.0, 80.0], [150.0, -30.0, 80.0]])
    track = AnchorTrack("T", np.array([0.0, 400.0, 500.0, 3000.0]), ways_m)
    given = {"rover": RoverModel(max_slope_rad=0.5, speed_m_per_s=1.0), "limits": PathLimits(min_anchors=1)} | changes
    return PathProblem(
        grid, (22.0, -52.0), (272.0, -52.0), anchors=(track,), budget=PlanBudget(sampling=False), **given
    )


def test_the_rover_leaves_once_the_drone_is_over_the_ridge() -> None:
    problem = behind_a_ridge()
    found = plan_departures(problem, 800.0)
    assert [one.departure_s for one in found.tried] == [0.0, 200.0, 400.0, 600.0, 800.0]
    assert [one.in_time for one in found.tried] == [False, False, False, True, True]
    assert found.best is not None
    assert found.best.departure_s == 600.0
    assert found.best.arrival_s == pytest.approx(600.0 + 250.0, abs=2.0)
    assert found.best.outcome is not None
    path = found.best.outcome.path
    assert path is not None
    leaving = behind_a_ridge(departure_s=600.0)
    assert validate_path(leaving, np.column_stack([path.east_m, path.north_m])).passed
    assert found.sentence == "Of 5 departures the one at 10 min costs least; it arrives at 14 min."


def test_a_window_in_which_nobody_arrives_says_when_somebody_would() -> None:
    found = plan_departures(behind_a_ridge(), 800.0, arrive_by_s=700.0)
    assert found.best is None
    assert found.sentence == "At none of 5 departures does a path arrive by 12 min; the soonest arrives at 14 min."
    never = plan_departures(behind_a_ridge(), 200.0, count=2)
    assert never.best is None
    assert never.sentence.startswith("At none of 2 departures was a path found: ")


def test_each_departure_has_what_those_before_left_of_the_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    left_s: list[float] = []

    def noted(problem: PathProblem, stop: Callable[[], bool] | None) -> PathOutcome:
        left_s.append(problem.budget.seconds)
        return plan_path(problem, stop=stop)

    monkeypatch.setattr("planning.alternatives.departures.plan_path", noted)
    plan_departures(behind_a_ridge(), 800.0, count=3)
    assert 60.0 >= left_s[0] > left_s[1] > left_s[2] > 0.0
    ended = plan_departures(behind_a_ridge(), 800.0, stop=lambda: True)
    assert (len(ended.tried), ended.ended) == (1, True)
    assert ended.sentence.startswith("At none of 1 departure was a path found: ")
    assert ended.sentence.endswith(" The search ended before more were tried.")


def test_windows_of_nothing_are_refused() -> None:
    for words, sentence in (
        ((0.0, {}), "leave_by_s must be after departure_s"),
        ((math.nan, {}), "leave_by_s must be after departure_s"),
        ((9.0, {"arrive_by_s": -1.0}), "arrive_by_s must be after departure_s"),
        ((9.0, {"count": 1}), "Departures are 2 to 32"),
    ):
        with pytest.raises(PathProblemError, match=sentence):
            plan_departures(behind_a_ridge(), words[0], **words[1])
    grid = behind_a_ridge().grid
    standing = PathProblem(grid, (22.0, -52.0), (272.0, -52.0), anchors=(Anchor("A", 150.0, -30.0, 80.0),))
    with pytest.raises(PathProblemError, match="only with anchors that move"):
        plan_departures(standing, 9.0)
