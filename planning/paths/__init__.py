"""Ways for a rover over the ground: cheap, within every limit, and where the anchors are in sight."""

from .flight_problems import FlightOutcome, FlightProblem
from .flights import plan_flight
from .limits import CostWeights, PathLimits, PlanBudget
from .navigation_models import NavigationModel
from .outcomes import Grain, Path, PathOutcome, PathStatus, PathTotals, Reason, Relaxation, Unreachable
from .planning import plan_path
from .problems import Goal, PathProblem, Place
from .rovers import RoverModel

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
