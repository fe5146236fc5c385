"""From sight to signal: radios, diffraction, canopy, the margin of a link, and how likely a range arrives."""

from visibility.signal.foliage import Foliage, FoliageModel
from visibility.signal.links import Signals, profile_diffraction_db, signals
from visibility.signal.radio import RADIOS, Polarization, Radio, arrival_probability, free_space_loss_db

__all__ = [
    "RADIOS",
    "Foliage",
    "FoliageModel",
    "Polarization",
    "Radio",
    "Signals",
    "arrival_probability",
    "free_space_loss_db",
    "profile_diffraction_db",
    "signals",
]
