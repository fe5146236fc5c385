"""Whether a path keeps its limits, by code that shares nothing with what planned it.

Of ``planning.paths`` it imports the question alone: problem, rover, limits.
"""

from .reports import LimitCheck, PathLimit, PathValidation
from .validating import validate_path

__all__ = ["LimitCheck", "PathLimit", "PathValidation", "validate_path"]
