"""Other ways than the cheapest and other times to leave, with what they are worth; and ways on from anywhere."""

from .departures import Departure, Departures, plan_departures
from .distinct import Alternative, Alternatives, alternatives_to
from .replanning import PreparedPlan, prepare_replanning

__all__ = [
    "Alternative",
    "Alternatives",
    "Departure",
    "Departures",
    "PreparedPlan",
    "alternatives_to",
    "plan_departures",
    "prepare_replanning",
]
