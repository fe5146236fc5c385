"""Places in sentences: in the numbers of the question, with digits enough to be typed back."""

from __future__ import annotations

import re

import numpy as np
import pytest

from terrain import ElevationGrid, places_told, to_grid_frame, told_place

GRID = ElevationGrid(np.zeros((3, 4), np.float32), 30.0, 30.0, 500_000.0, 7_600_000.0, "EPSG:32611")
PLACE = (500_012.3456, 7_599_987.6543)


def numbers_in(sentence: str) -> tuple[float, float]:
    east, north = re.findall(r"-?[\d.]+(?= (?:m|deg) )", sentence)
    return float(east), float(north)


@pytest.mark.parametrize("within_m", [1.0, 0.1, 0.003])
def test_what_is_told_lies_within_the_metres_asked_for(within_m: float) -> None:
    assert np.hypot(*np.subtract(numbers_in(told_place(GRID, *PLACE, within_m)), PLACE)) < within_m
    with places_told(in_metres=False, in_degrees=True):
        degrees = told_place(GRID, *PLACE, within_m)
    assert degrees.endswith(" deg north)")
    assert np.hypot(*np.subtract(to_grid_frame(GRID, *numbers_in(degrees)), PLACE)) < within_m


def test_a_question_in_both_is_answered_in_both_and_one_without_degrees_in_metres() -> None:
    with places_told(in_metres=True, in_degrees=True):
        assert re.fullmatch(r"\(.* m east, .* m north\) or \(.* deg east, .* deg north\)", told_place(GRID, *PLACE))
        local = ElevationGrid(np.zeros((3, 4), np.float32), 30.0, 30.0)
        assert told_place(local, 1.0, 2.0) == "(1 m east, 2 m north)"
    assert told_place(GRID, *PLACE) == "(500012 m east, 7599988 m north)"
