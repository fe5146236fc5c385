"""What a placement is for where its request names no objective: the request tells it, so that the answer does."""

import pytest
from pydantic import ValidationError

from service.products.placements.request import PlacementIn, PlacementParameters

LATTICE = {"candidates": [{"spacing_m": 100.0, "above_ground_m": [40.0]}]}


@pytest.mark.parametrize("goal", [{}, {"goal": {}}, {"goal": {"min_anchors": 3}}, {"goal": {"on_surface": True}}])
def test_without_an_objective_it_is_the_error_along_the_surface(goal):
    asked = PlacementParameters.model_validate({**LATTICE, **goal, "count": 3})
    assert (asked.goal.objective, asked.goal.on_surface) == ("mean_error", True)
    whole = PlacementIn.model_validate({**LATTICE, **goal, "count": 3, "dem_id": "0" * 32})
    again = PlacementParameters.model_validate(whole.model_dump(mode="json", exclude={"dem_id"}, exclude_unset=True))
    assert again.goal == asked.goal


def test_with_a_share_to_reach_it_is_coverage():
    asked = PlacementParameters.model_validate({**LATTICE, "goal": {"min_anchors": 2}, "reach": 0.5})
    assert (asked.goal.objective, asked.goal.on_surface, asked.goal.min_anchors) == ("coverage", False, 2)


def test_no_objective_and_not_along_the_surface_contradict_each_other():
    with pytest.raises(ValidationError, match="Without an objective the error along the surface is placed for"):
        PlacementParameters.model_validate({**LATTICE, "goal": {"on_surface": False}, "count": 3})
    asked = PlacementParameters.model_validate(
        {**LATTICE, "goal": {"objective": "mean_error", "on_surface": False}, "count": 3}
    )
    assert not asked.goal.on_surface
