"""What a map says while a rover drives: who should be in sight, how high the ground is, and where ranges disagree."""

from .advice import Advice, DarkStretch, Drive, SpeedAdvice, advise
from .detector import MapDetector, WatchedEpoch
from .detours import PathAdvice, advise_path
from .doubts import Expected, MapDoubt
from .forecasts import GroundErrors, SightForecast, forecast_sight
from .moves import MoveAdvice, advise_move
from .obstructions import Obstacle, ObstructedStretch

__all__ = [
    "Advice",
    "DarkStretch",
    "Drive",
    "Expected",
    "GroundErrors",
    "MapDetector",
    "MapDoubt",
    "MoveAdvice",
    "Obstacle",
    "ObstructedStretch",
    "PathAdvice",
    "SightForecast",
    "SpeedAdvice",
    "WatchedEpoch",
    "advise",
    "advise_move",
    "advise_path",
    "forecast_sight",
]
