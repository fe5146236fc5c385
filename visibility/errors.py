"""What can go wrong with visibility.

VisibilityError
├── AnchorError           an anchor that cannot be used: below ground, duplicate id, impossible limits ...
├── VisibilityInputError  points, heights or options that make no question
├── MeshError             a building mesh that cannot be used
├── CoverError            footprints or canopy that cannot be used
└── SignalError           radios, links or profiles that cannot be used
"""

__all__ = ["AnchorError", "CoverError", "MeshError", "SignalError", "VisibilityError", "VisibilityInputError"]


class VisibilityError(Exception):
    """Base of everything that visibility raises on purpose."""


class AnchorError(VisibilityError):
    """An anchor cannot be used."""


class VisibilityInputError(VisibilityError):
    """Points, heights or options make no question that can be answered."""


class MeshError(VisibilityError):
    """A building mesh cannot be used."""


class CoverError(VisibilityError):
    """Footprints of buildings, or canopy, cannot be used."""


class SignalError(VisibilityError):
    """A radio, a link or a profile cannot be used."""
