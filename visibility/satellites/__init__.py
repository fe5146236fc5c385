"""Satellites: almanacs and broadcast ephemerides, where the satellites stand, and how a grid sees them."""

from .expected import ExpectedSky, expected_sky
from .eyes import SatelliteEyes, SatelliteTrack, satellite_eyes, satellite_tracks
from .hidden import hidden_observations
from .horizon import TerrainHorizon, terrain_horizon
from .in_view import SatellitesInView, place_on_grid, satellite_positions_ecef_m, satellites_in_view

__all__ = [
    "ExpectedSky",
    "SatelliteEyes",
    "SatelliteTrack",
    "SatellitesInView",
    "TerrainHorizon",
    "expected_sky",
    "hidden_observations",
    "place_on_grid",
    "satellite_eyes",
    "satellite_positions_ecef_m",
    "satellite_tracks",
    "satellites_in_view",
    "terrain_horizon",
]
