"""What can go wrong with visibility.

VisibilityError
├── AnchorError           an anchor that cannot be used: below ground, duplicate id, impossible limits ...
├── VisibilityInputError  points, heights or options that make no question
├── MeshError             a building mesh that cannot be used
└── AlmanacError          satellite orbits that cannot be used: of another week, all unhealthy, no orbit ...
    └── AlmanacFileError  an almanac or navigation file that is missing, truncated or damaged
"""

__all__ = ["AlmanacError", "AlmanacFileError", "AnchorError", "MeshError", "VisibilityError", "VisibilityInputError"]


class VisibilityError(Exception):
    """Base of everything that visibility raises on purpose."""


class AnchorError(VisibilityError):
    """An anchor cannot be used."""


class VisibilityInputError(VisibilityError):
    """Points, heights or options make no question that can be answered."""


class MeshError(VisibilityError):
    """A building mesh cannot be used."""


class AlmanacError(VisibilityError):
    """Satellite orbits cannot be used."""


class AlmanacFileError(AlmanacError):
    """An almanac or navigation file is missing, truncated or damaged."""
