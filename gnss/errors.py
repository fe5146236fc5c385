"""What can go wrong with satellites.

GnssError
├── GnssInputError        times or places that make no question
├── SamplesError          recorded samples that cannot be used: truncated, clipped, of another type or rate
├── GnssLibraryError      a library that is asked for and not installed
└── AlmanacError          satellite orbits that cannot be used: of another week, all unhealthy, no orbit ...
    └── AlmanacFileError  an almanac, navigation or observation file that is missing, truncated or damaged
"""

__all__ = [
    "AlmanacError",
    "AlmanacFileError",
    "GnssError",
    "GnssInputError",
    "GnssLibraryError",
    "SamplesError",
]


class GnssError(Exception):
    """Base of everything that gnss raises on purpose."""


class GnssInputError(GnssError):
    """Times or places make no question that can be answered."""


class SamplesError(GnssError):
    """Recorded samples of a receiver cannot be used."""


class GnssLibraryError(GnssError):
    """A library that the question needs is not installed."""


class AlmanacError(GnssError):
    """Satellite orbits cannot be used."""


class AlmanacFileError(AlmanacError):
    """An almanac, navigation or observation file is missing, truncated or damaged."""
