"""What can go wrong with satellites.

GnssError
├── GnssInputError        times or places that make no question
├── SamplesError          recorded samples that cannot be used: truncated, clipped, of another type or rate
└── AlmanacError          satellite orbits that cannot be used: of another week, all unhealthy, no orbit ...
    └── AlmanacFileError  an almanac or navigation file that is missing, truncated or damaged
"""

__all__ = ["AlmanacError", "AlmanacFileError", "GnssError", "GnssInputError", "SamplesError"]


class GnssError(Exception):
    """Base of everything that gnss raises on purpose."""


class GnssInputError(GnssError):
    """Times or places make no question that can be answered."""


class SamplesError(GnssError):
    """Recorded samples of a receiver cannot be used."""


class AlmanacError(GnssError):
    """Satellite orbits cannot be used."""


class AlmanacFileError(AlmanacError):
    """An almanac or navigation file is missing, truncated or damaged."""
