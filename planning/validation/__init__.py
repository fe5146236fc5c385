"""Whether a path keeps its limits, by code that shares nothing with what planned it.

Of ``planning.paths`` it imports the question alone: problem, rover, limits.
"""

from .reports import LimitCheck, PathLimit, PathValidation
from .validating import FlightSamples, fly_along, validate_flight, validate_path

__all__ = [
    "FlightSamples",
    "LimitCheck",
    "PathLimit",
    "PathValidation",
    "fly_along",
    "validate_flight",
    "validate_path",
]
