"""CRSs named in files: by authority and code alone, for any other text may make PROJ read files of this machine."""

from __future__ import annotations

import re

import pyproj
from pyproj.exceptions import CRSError

from service.errors import RequestError

__all__ = ["crs_of_name"]

AUTHORITY, CODE = r"(?P<authority>[A-Za-z][\w.]*)", r"(?P<code>\w+)"
SPELLINGS = tuple(
    re.compile(spelling, re.IGNORECASE)
    for spelling in (
        rf"{AUTHORITY}:{CODE}",
        rf"urn:(?:x-)?ogc:def:crs:{AUTHORITY}:[\w.]*:{CODE}",
        rf"urn:(?:x-)?ogc:def:crs:{AUTHORITY}:{CODE}",
        rf"https?://www\.opengis\.net/def/crs/{AUTHORITY}/[\w.]+/{CODE}",
        rf"https?://www\.opengis\.net/gml/srs/(?P<authority>epsg)\.xml#{CODE}",
        r"(?P<authority>)(?P<code>CRS84)",
    )
)


def crs_of_name(name: str, called: str) -> pyproj.CRS:
    """The CRS of "EPSG:25832", "urn:ogc:def:crs:OGC:1.3:CRS84" and the like. Raises RequestError.

    called: what error sentences call the file.
    """
    for spelling in SPELLINGS:
        found = spelling.fullmatch(name.strip())
        if found is not None:
            try:
                return pyproj.CRS.from_authority((found["authority"] or "OGC").upper(), found["code"].upper())
            except CRSError as error:
                raise RequestError(f"{called} is in the CRS {name[:80]!r}, which is not known.") from error
    raise RequestError(
        f"{called} is in the CRS {name[:80]!r}; a CRS is named by authority and code, such as EPSG:25832 or "
        "urn:ogc:def:crs:OGC:1.3:CRS84."
    )
