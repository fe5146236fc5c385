"""Navigation by pseudoranges and wheels where many of the signals come round corners."""

from .following import StreetTrack, follow_street
from .inputs import StreetErrors, StreetRanges, StreetStart, WheelReadings

__all__ = ["StreetErrors", "StreetRanges", "StreetStart", "StreetTrack", "WheelReadings", "follow_street"]
