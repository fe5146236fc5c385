"""Where the rover is and how surely: Kalman filters of ranges, measurement quality, the safety bubble."""

from .bubbles import bubble_radius_m
from .clearances import BubbleCheck, BubbleVerdict, check_bubbles
from .confidence import bubble_confidence, radius_of_confidence
from .consistency import mean_bounds, nees
from .errors import BubbleError, MeasurementError, NavigationError, StateError, TimeOrderError
from .estimators import ConstantVelocityEstimator, Estimator, RoverEstimate
from .hypotheses import ESTIMATORS, HypothesesEstimator
from .linear import FixUpdate, LinearUpdate, linear_predict, linear_update, update_fix, update_ground
from .motion import MotionNoise
from .occlusions import OcclusionBelief, OcclusionModel, carry_hypotheses, correct_hypotheses, update_hypotheses
from .prediction import PredictedBubble, predict_bubble
from .quality import range_variances_m2
from .range_logs import FilteredLog, filter_ranges
from .ranging import RangeUpdate, Verdict, predict, update_range, update_ranges
from .states import FilterState, initial_state
from .troposphere import Troposphere, niell_mapping, troposphere_delay_m, zenith_delays

__all__ = [
    "ESTIMATORS",
    "BubbleCheck",
    "BubbleError",
    "BubbleVerdict",
    "ConstantVelocityEstimator",
    "Estimator",
    "FilterState",
    "FilteredLog",
    "FixUpdate",
    "HypothesesEstimator",
    "LinearUpdate",
    "MeasurementError",
    "MotionNoise",
    "NavigationError",
    "OcclusionBelief",
    "OcclusionModel",
    "PredictedBubble",
    "RangeUpdate",
    "RoverEstimate",
    "StateError",
    "TimeOrderError",
    "Troposphere",
    "Verdict",
    "bubble_confidence",
    "bubble_radius_m",
    "carry_hypotheses",
    "check_bubbles",
    "correct_hypotheses",
    "filter_ranges",
    "initial_state",
    "linear_predict",
    "linear_update",
    "mean_bounds",
    "nees",
    "niell_mapping",
    "predict",
    "predict_bubble",
    "radius_of_confidence",
    "range_variances_m2",
    "troposphere_delay_m",
    "update_fix",
    "update_ground",
    "update_hypotheses",
    "update_range",
    "update_ranges",
    "zenith_delays",
]
