"""Satellites: almanacs and broadcast ephemerides, where the satellites stand, and how a grid sees them."""

from .almanac import Almanac, AlmanacEntry
from .almanac_files import parse_almanac, read_almanac
from .almanac_orbits import almanac_positions_ecef_m
from .broadcast_ephemeris import BroadcastEphemeris, Ephemerides, ephemeris_positions_ecef_m
from .eyes import SatelliteEyes, satellite_eyes
from .gps_time import GpsTime, Instants, full_week, instants, leap_seconds_at
from .grid_places import place_on_grid
from .in_view import SatellitesInView, satellite_positions_ecef_m, satellites_in_view
from .rinex_navigation import parse_rinex_navigation, read_rinex_navigation
from .sky import LookAngles, Place, ecef_to_enu_m, enu_to_ecef_m, look_angles, off_axis_rad, place_ecef_m
from .tracks import SatelliteTrack, satellite_tracks

__all__ = [
    "Almanac",
    "AlmanacEntry",
    "BroadcastEphemeris",
    "Ephemerides",
    "GpsTime",
    "Instants",
    "LookAngles",
    "Place",
    "SatelliteEyes",
    "SatelliteTrack",
    "SatellitesInView",
    "almanac_positions_ecef_m",
    "ecef_to_enu_m",
    "enu_to_ecef_m",
    "ephemeris_positions_ecef_m",
    "full_week",
    "instants",
    "leap_seconds_at",
    "look_angles",
    "off_axis_rad",
    "parse_almanac",
    "parse_rinex_navigation",
    "place_ecef_m",
    "place_on_grid",
    "read_almanac",
    "read_rinex_navigation",
    "satellite_eyes",
    "satellite_positions_ecef_m",
    "satellite_tracks",
    "satellites_in_view",
]
