"""Ways for a rover over the ground: cheap, within every limit, and where the anchors are in sight."""

from planning.paths.outcomes import FlightOutcome
from planning.questions.models import CostWeights, NavigationModel, PathLimits, PlanBudget, RoverModel
from planning.questions.problems import FlightProblem, Goal, PathProblem, Place

from .flights import plan_flight
from .outcomes import Grain, Path, PathOutcome, PathStatus, PathTotals, Reason, Relaxation, Unreachable
from .planning import plan_path

__all__ = [
    "CostWeights",
    "FlightOutcome",
    "FlightProblem",
    "Goal",
    "Grain",
    "NavigationModel",
    "Path",
    "PathLimits",
    "PathOutcome",
    "PathProblem",
    "PathStatus",
    "PathTotals",
    "Place",
    "PlanBudget",
    "Reason",
    "Relaxation",
    "RoverModel",
    "Unreachable",
    "plan_flight",
    "plan_path",
]
