"""What a map says while a rover drives: who should be in sight, how high the ground is, and where ranges disagree."""

from .detector import MapDetector, WatchedEpoch
from .doubts import Expected, MapDoubt
from .forecasts import GroundErrors, SightForecast, forecast_sight

__all__ = [
    "Expected",
    "GroundErrors",
    "MapDetector",
    "MapDoubt",
    "SightForecast",
    "WatchedEpoch",
    "forecast_sight",
]
