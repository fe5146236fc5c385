"""Groups of options map one to one on parts of requests: same names, and defaults that are the part's own."""

from dataclasses import MISSING, fields

import pytest
from pydantic_core import PydanticUndefined

from service.cli import bubble, detect, dop, fly, los, plan, reposition, visibility
from service.cli.asking import options, placing
from service.cli.operating import serve
from service.live.settings import DetectorSettingsIn
from service.parts.anchors import SightParameters
from service.parts.positioning import MorphingMapParameters
from service.products.dop.request import DopMapParameters, VolumeIn
from service.products.flights.request import FlightBudgetIn, FlightParameters
from service.products.lines_of_sight.request import LineOptions
from service.products.paths.request import BudgetIn, PathLimitsIn, PathQuestion, RoverIn
from service.products.placements.request import GoalIn, LinkIn, RulesIn, TargetsIn
from service.products.repositionings.request import DroneFlightIn, RepositioningParameters
from service.products.safety_bubbles.request import BubbleParameters
from service.products.visibility.request import VisibilityMapParameters
from service.settings import Settings

# what a group has besides the fields of its part, because people type it otherwise
GROUPS = [
    (options.SignalOptions, SightParameters, {"radio"}),
    (options.PositioningOptions, DopMapParameters, set()),
    (options.PositioningOptions, MorphingMapParameters, set()),
    (placing.TargetOptions, TargetsIn, set()),
    (placing.PlacementGoal, GoalIn, set()),
    (placing.HoldingGoal, GoalIn, {"objective"}),  # a share, whatever a placement is for where nothing is said
    (placing.PlacementRules, RulesIn, set()),
    (placing.MoveRules, RulesIn, set()),
    (placing.LinkOptions, LinkIn, {"base"}),
    (visibility.ReceiverOptions, VisibilityMapParameters, set()),
    (dop.RoverOptions, DopMapParameters, set()),
    (dop.VolumeOptions, VolumeIn, {"volume", "ceiling", "bounds"}),
    (bubble.FilterOptions, BubbleParameters, set()),
    (plan.RoverOptions, RoverIn, set()),
    (plan.LimitOptions, PathLimitsIn, set()),
    (plan.BudgetOptions, BudgetIn, {"no_sampling"}),
    (options.HeardOptions, PathQuestion, {"radio"}),
    (plan.RestOptions, PathQuestion, set()),
    (fly.MapOptions, MorphingMapParameters, set()),
    (fly.FlightOptions, FlightParameters, set()),
    (fly.BudgetOptions, FlightBudgetIn, set()),
    (reposition.MoveOptions, RepositioningParameters, set()),
    (reposition.DroneOptions, DroneFlightIn, set()),
    (los.LineOptions, LineOptions, set()),
    (detect.DetectorOptions, DetectorSettingsIn, {"more"}),
    (serve.ServiceOptions, Settings, {"scheduler"}),
]


@pytest.mark.parametrize(
    ("group", "part", "more"), GROUPS, ids=[f"{group.__module__}-{group.__name__}" for group, _, _ in GROUPS]
)
def test_a_group_has_the_fields_of_its_part_with_their_defaults(group, part, more):
    named = {field.name for field in fields(group)}
    assert more <= named
    assert named - more <= set(part.model_fields)
    for field in fields(group):
        if field.name in more:
            continue
        assert field.default is not MISSING, "left out, an option says nothing"
        theirs = part.model_fields[field.name].default
        if field.default not in (None, ()) and theirs is not PydanticUndefined:
            assert field.default == theirs, field.name
