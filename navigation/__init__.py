"""Where the rover is and how surely: Kalman filters of ranges, measurement quality, the safety bubble."""

from .bubbles import bubble_radius_m
from .errors import BubbleError, MeasurementError, NavigationError, StateError, TimeOrderError
from .motion import MotionNoise
from .prediction import PredictedBubble, predict_bubble
from .quality import range_variances_m2
from .ranging import RangeUpdate, Verdict, predict, update_range, update_ranges
from .states import FilterState, initial_state

__all__ = [
    "BubbleError",
    "FilterState",
    "MeasurementError",
    "MotionNoise",
    "NavigationError",
    "PredictedBubble",
    "RangeUpdate",
    "StateError",
    "TimeOrderError",
    "Verdict",
    "bubble_radius_m",
    "initial_state",
    "predict",
    "predict_bubble",
    "range_variances_m2",
    "update_range",
    "update_ranges",
]
