"""From sight to signal: radios, diffraction, canopy, the margin of a link, and how likely a range arrives."""

from visibility.sight.radios import RADIOS, Polarization, Radio, arrival_probability, free_space_loss_db
from visibility.signal.foliage import Foliage, FoliageModel, foliage_of, with_foliage
from visibility.signal.links import Signals, profile_diffraction_db, signals
from visibility.signal.usable import margin_map, min_usable_altitude

__all__ = [
    "RADIOS",
    "Foliage",
    "FoliageModel",
    "Polarization",
    "Radio",
    "Signals",
    "arrival_probability",
    "foliage_of",
    "free_space_loss_db",
    "margin_map",
    "min_usable_altitude",
    "profile_diffraction_db",
    "signals",
    "with_foliage",
]
