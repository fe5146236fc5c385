"""What heights count from: sea level, an ellipsoid, or something that the file does not say; told by a datum's name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

import pyproj
from pyproj.exceptions import CRSError

from ..crs.frames import body_of
from ..errors import VerticalDatumError
from ..grid import ElevationGrid

__all__ = [
    "EGM96",
    "MEAN_SEA_LEVEL",
    "WGS84_ELLIPSOID",
    "HeightReference",
    "VerticalDatum",
    "height_reference_of",
    "parse_vertical_datum",
    "reference_of_name",
    "vertical_datum_named",
    "vertical_datum_of",
]

GEODETIC = r"^(D_)?(WGS|GRS|NAD|ETRS|ITRF|IGS|GDA|JGD|SIRGAS)[ _]?(19|20)?\d\d"
ELLIPSOIDS = re.compile(rf"ellips|spheroid|\bhae\b|{GEODETIC}", re.IGNORECASE)
GRAVITY = r"geoid|orthometric|normal|sea[ _-]?level|\bmsl\b|\begm[ _]?\d+"
SEA_LEVELS = re.compile(rf"{GRAVITY}|\bnavd|\bngvd|\bevrf|\bnap\b|vertical_datum", re.IGNORECASE)
# names under which files and people have what PROJ calls otherwise
EGM_NAMES = (("EPSG:5773", r"egm[ _-]?(19)?96"), ("EPSG:3855", r"egm[ _-]?(20)?08"), ("EPSG:5798", r"egm[ _-]?(19)?84"))
ANY_SEA_LEVEL = re.compile(r"(mean[ _-]sea[ _-]level|a?msl)(\W.*)?", re.IGNORECASE)
PLAIN = re.compile(r"[\w .,()/+-]+")
CODE = re.compile(r"EPSG:\d{1,6}", re.IGNORECASE)
UNIT = re.compile(r" \((ftUS|ft)\)$")
WORDS = "msl (mean sea level), hae (the WGS 84 ellipsoid), EGM96, EGM2008, or one that PROJ knows, such as EPSG:5703"


class HeightReference(StrEnum):
    """Where zero is. Sea level means any surface of the Earth's gravity: a geoid, a national levelling datum."""

    SEA_LEVEL = "sea level"
    ELLIPSOID = "ellipsoid"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class VerticalDatum:
    """A surface of the Earth that heights count from, in metres upwards.

    name: as files have it. crs: PROJ's vertical CRS above it, where there is one. Mean sea level without a model's name
    stands for whichever sea level the other side of a conversion counts from.
    """

    name: str
    reference: HeightReference
    crs: pyproj.CRS | None = None


WGS84_ELLIPSOID = VerticalDatum("ellipsoid of WGS 84", HeightReference.ELLIPSOID)
MEAN_SEA_LEVEL = VerticalDatum("mean sea level", HeightReference.SEA_LEVEL)
EGM96 = VerticalDatum("EGM96 geoid", HeightReference.SEA_LEVEL, pyproj.CRS.from_epsg(5773))
EGM2008 = VerticalDatum("EGM2008 geoid", HeightReference.SEA_LEVEL, pyproj.CRS.from_epsg(3855))
KNOWN = {one.crs.to_epsg(): one for one in (EGM96, EGM2008) if one.crs is not None}


def height_reference_of(grid: ElevationGrid) -> HeightReference:
    """What a grid's heights count from, told by the name of its vertical datum; of bodies without a sea never that.

    A registered vertical CRS counts from a surface of gravity: heights above an ellipsoid belong to a geographic CRS of
    three dimensions (ISO 19111). One that is named after a geodetic datum counts from its ellipsoid (as ESRI has them).
    """
    reference = reference_of_name(grid.vertical_datum)
    on_earth = grid.crs is None or body_of(grid.crs).name == "Earth"
    return reference if on_earth or reference is HeightReference.ELLIPSOID else HeightReference.UNKNOWN


def vertical_datum_of(grid: ElevationGrid) -> VerticalDatum | None:
    """What a grid's heights count from, on Earth; None where that is not known, or the grid lies elsewhere."""
    if grid.crs is None or body_of(grid.crs).name != "Earth":
        return None
    return vertical_datum_named((grid.vertical_datum or "").strip())


def parse_vertical_datum(text: str) -> VerticalDatum:
    """The vertical datum that a caller, an option or a request names.

    text: msl (mean sea level), hae (the ellipsoid of WGS 84), EGM96, EGM2008, or a vertical CRS by code or name.
    Raises VerticalDatumError.
    """
    datum = vertical_datum_named(text.strip())
    if datum is None:
        raise VerticalDatumError(f"The vertical datum {text[:60]!r} is not known; name {WORDS}.")
    return datum


@lru_cache(maxsize=256)
def vertical_datum_named(name: str) -> VerticalDatum | None:
    """What files and people mean by a name of a vertical datum; None where nobody knows."""
    if CODE.fullmatch(name):
        return _registered_datum(name)
    reference = reference_of_name(name)
    if reference is HeightReference.UNKNOWN:
        return None
    if reference is HeightReference.ELLIPSOID:
        return WGS84_ELLIPSOID if name.lower() in ("ellipsoid", "hae") else VerticalDatum(name, reference)
    if ANY_SEA_LEVEL.fullmatch(name):
        return MEAN_SEA_LEVEL
    for code, words in EGM_NAMES:
        if re.search(words, name, re.IGNORECASE):
            return _registered_datum(code)
    crs = _registered(name) or _registered(f"{name} height")
    return VerticalDatum(name, reference, crs)


def _registered_datum(code: str) -> VerticalDatum | None:
    crs = _registered(code)
    if crs is None:
        return None
    return KNOWN.get(crs.to_epsg(), VerticalDatum(UNIT.sub("", crs.name), HeightReference.SEA_LEVEL, crs))


def reference_of_name(vertical_datum: str | None) -> HeightReference:
    """What heights count from on Earth, by the name of their vertical datum alone."""
    name = (vertical_datum or "").strip()
    if ELLIPSOIDS.search(name):
        return HeightReference.ELLIPSOID
    if SEA_LEVELS.search(name) or _registered(name) is not None:
        return HeightReference.SEA_LEVEL
    return HeightReference.UNKNOWN


@lru_cache(maxsize=256)
def _registered(name: str) -> pyproj.CRS | None:
    if not (PLAIN.fullmatch(name) or CODE.fullmatch(name)):
        return None
    try:
        crs = pyproj.CRS.from_user_input(name)
    except CRSError:
        return None
    return crs if crs.is_vertical else None
