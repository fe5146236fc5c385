"""From sight to signal: radios, diffraction, canopy, the margin of a link, and how likely a range arrives."""

from visibility.sight.radios import RADIOS, Polarization, Radio, arrival_probability, free_space_loss_db
from visibility.signal.calibration import CanopyFit, FittedSky, HeardThrough, fit_canopy, heard_from, ways_upwards
from visibility.signal.foliage import Foliage, FoliageModel, foliage_of, with_foliage
from visibility.signal.links import Signals, profile_diffraction_db, signals
from visibility.signal.reception import Reception, reception, usable_probability
from visibility.signal.usable import margin_map, min_usable_altitude

__all__ = [
    "RADIOS",
    "CanopyFit",
    "FittedSky",
    "Foliage",
    "FoliageModel",
    "HeardThrough",
    "Polarization",
    "Radio",
    "Reception",
    "Signals",
    "arrival_probability",
    "fit_canopy",
    "foliage_of",
    "free_space_loss_db",
    "heard_from",
    "margin_map",
    "min_usable_altitude",
    "profile_diffraction_db",
    "reception",
    "signals",
    "usable_probability",
    "ways_upwards",
    "with_foliage",
]
