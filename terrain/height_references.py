"""What heights count from: sea level, an ellipsoid, or something that the file does not say."""

from __future__ import annotations

import re
from enum import StrEnum

import pyproj
from pyproj.exceptions import CRSError

from .frames import body_of
from .grid import ElevationGrid

__all__ = ["HeightReference", "height_reference_of", "reference_of_name"]

GEODETIC = r"^(D_)?(WGS|GRS|NAD|ETRS|ITRF|IGS|GDA|JGD|SIRGAS)[ _]?(19|20)?\d\d"
ELLIPSOIDS = re.compile(rf"ellips|spheroid|\bhae\b|{GEODETIC}", re.IGNORECASE)
GRAVITY = r"geoid|orthometric|normal|sea[ _-]?level|\bmsl\b|\begm[ _]?\d+"
SEA_LEVELS = re.compile(rf"{GRAVITY}|\bnavd|\bngvd|\bevrf|\bnap\b|vertical_datum", re.IGNORECASE)
PLAIN = re.compile(r"[\w .,()/+-]+")


class HeightReference(StrEnum):
    """Where zero is. Sea level means any surface of the Earth's gravity: a geoid, a national levelling datum."""

    SEA_LEVEL = "sea level"
    ELLIPSOID = "ellipsoid"
    UNKNOWN = "unknown"


def height_reference_of(grid: ElevationGrid) -> HeightReference:
    """What a grid's heights count from, told by the name of its vertical datum; of bodies without a sea never that.

    A registered vertical CRS counts from a surface of gravity: heights above an ellipsoid belong to a geographic CRS of
    three dimensions (ISO 19111). One that is named after a geodetic datum counts from its ellipsoid (as ESRI has them).
    """
    reference = reference_of_name(grid.vertical_datum)
    on_earth = grid.crs is None or body_of(grid.crs).name == "Earth"
    return reference if on_earth or reference is HeightReference.ELLIPSOID else HeightReference.UNKNOWN


def reference_of_name(vertical_datum: str | None) -> HeightReference:
    """What heights count from on Earth, by the name of their vertical datum alone."""
    name = (vertical_datum or "").strip()
    if ELLIPSOIDS.search(name):
        return HeightReference.ELLIPSOID
    if SEA_LEVELS.search(name) or _is_registered(name):
        return HeightReference.SEA_LEVEL
    return HeightReference.UNKNOWN


def _is_registered(name: str) -> bool:
    if not PLAIN.fullmatch(name):
        return False
    try:
        return bool(pyproj.CRS.from_user_input(name).is_vertical)
    except CRSError:
        return False
