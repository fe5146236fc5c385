"""Satellites: time, almanacs and broadcast ephemerides, where the satellites stand, and the sky over a place."""

from .almanac import Almanac, AlmanacEntry
from .almanac_files import parse_almanac, read_almanac
from .almanac_orbits import almanac_positions_ecef_m
from .broadcast_ephemeris import BroadcastEphemeris, Ephemerides, ephemeris_clocks_s, ephemeris_positions_ecef_m
from .errors import AlmanacError, AlmanacFileError, GnssError, GnssInputError, GnssLibraryError, SamplesError
from .gps_time import GpsTime, Instants, ReceiverClock, full_week, instants, leap_seconds_at
from .rinex_navigation import parse_rinex_navigation, read_rinex_navigation
from .sky import LookAngles, Place, ecef_to_enu_m, enu_to_ecef_m, look_angles, off_axis_rad, place_ecef_m

__all__ = [
    "Almanac",
    "AlmanacEntry",
    "AlmanacError",
    "AlmanacFileError",
    "BroadcastEphemeris",
    "Ephemerides",
    "GnssError",
    "GnssInputError",
    "GnssLibraryError",
    "GpsTime",
    "Instants",
    "LookAngles",
    "Place",
    "ReceiverClock",
    "SamplesError",
    "almanac_positions_ecef_m",
    "ecef_to_enu_m",
    "enu_to_ecef_m",
    "ephemeris_clocks_s",
    "ephemeris_positions_ecef_m",
    "full_week",
    "instants",
    "leap_seconds_at",
    "look_angles",
    "off_axis_rad",
    "parse_almanac",
    "parse_rinex_navigation",
    "place_ecef_m",
    "read_almanac",
    "read_rinex_navigation",
]
