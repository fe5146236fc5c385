"""Satellites: almanacs and broadcast ephemerides, where the satellites stand, and how a grid sees them."""

from .eyes import SatelliteEyes, satellite_eyes
from .grid_places import place_on_grid
from .in_view import SatellitesInView, satellite_positions_ecef_m, satellites_in_view
from .tracks import SatelliteTrack, satellite_tracks

__all__ = [
    "SatelliteEyes",
    "SatelliteTrack",
    "SatellitesInView",
    "place_on_grid",
    "satellite_eyes",
    "satellite_positions_ecef_m",
    "satellite_tracks",
    "satellites_in_view",
]
