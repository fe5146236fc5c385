"""Which ways of writing a CRS are taken: authority codes, WKT, PROJJSON and plain PROJ strings, none that names a file.

PROJ opens whatever file its input names (``+init=PATH:section``, ``+nadgrids=PATH``, ``PARAMETERFILE``), when it reads
the text or when the first position is transformed, and a CRS comes from strangers: in a file, a query, a form.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

import pyproj
from pyproj.exceptions import CRSError

from ..errors import FrameError

__all__ = ["check_no_files", "parse_crs"]

LONGEST_TEXT = 200_000
AUTHORITY_CODE = re.compile(r"[A-Za-z]\w*:[\w.-]+(\+([A-Za-z]\w*:)?[\w.-]+)?", re.ASCII)
OGC_URN = re.compile(r"urn:(?:x-)?ogc:def:crs:(\w+):[\w.]*:([\w.-]+)", re.ASCII | re.IGNORECASE)
OGC_URL = re.compile(r"https?://(?:www\.)?opengis\.net/def/crs/(\w+)/[\w.]+/([\w.-]+)", re.ASCII | re.IGNORECASE)
LEGACY_INIT = re.compile(
    r"\+?init=(epsg|esri|ignf):(\w+)(?:\s+\+(?:no_defs|wktext|type=crs))*", re.ASCII | re.IGNORECASE
)
PROJ_STRING = re.compile(r"\w+=", re.ASCII)
WKT = re.compile(r"[A-Za-z]\w*\s*[\[(]", re.ASCII)
WKT_INSIDE = re.compile(r"\w\s*[\[(]\s*[\"\u201c]")
PE_STRING = re.compile(r"ESRI PE String\s*=", re.IGNORECASE)
FILE_PARTS = re.compile(r"proj4_grids|parameterfile", re.IGNORECASE)
# what PROJ reads as a PROJ string, or as parameters of one, inside WKT and PROJJSON
PROJ_INSIDE = re.compile(r"\bproj\b|\binit\s*=", re.IGNORECASE)
PAIR = re.compile(r"(\w+)\s*=\s*([^\s\"\u201d]*)", re.ASCII)
PARAMETER = re.compile(r"\+?(\w+)(?:=(.*))?", re.ASCII)
PLAIN_VALUE = re.compile(r"[\w.,+-]*", re.ASCII)
# shape, place and unit of a map, each a number or a word; of those that name files only the null grid
PARAMETERS = frozenset(
    re.findall(
        r"\w+",
        """
        proj type no_defs wktext over datum ellps a b rf f es e R R_A R_V R_a R_g R_h R_lat_a R_lat_g pm towgs84 units
        to_meter axis lat_0 lat_1 lat_2 lat_3 lat_b lat_ts lon_0 lon_1 lon_2 lon_3 lonc lon_wrap k k_0 x_0 y_0 zone
        south alpha gamma azi tilt h sweep n m M W q no_cut no_off no_uoff no_rot approx algo czech guam hyperbolic
        bns ns geoc theta nadgrids o_proj o_lat_p o_lon_p o_alpha o_lon_c o_lat_c o_lon_1 o_lat_1 o_lon_2 o_lat_2
        vunits vto_meter
        """,
    )
)
NULL_GRID = "@null"


def parse_crs(crs: Any) -> pyproj.CRS:
    """A CRS that a caller, a request or a file names, as pyproj's; every reader of one comes through here.

    crs: authority code ("EPSG:32611", its number, its URN), WKT, PROJJSON, a PROJ string of plain parameters, or a CRS
    of pyproj or rasterio. A geoid model of its heights is left out: it is for transforming heights, which nothing does.
    Raises FrameError for what is not known, not one of these, or names a file.
    """
    try:
        text = _text_of(crs)
        _check_length(text)
        parsed = crs if isinstance(crs, pyproj.CRS) else pyproj.CRS.from_user_input(text)
        return _without_grid_files(parsed)
    except (CRSError, ValueError, RecursionError) as error:
        shown = str(crs)[:80]
        raise FrameError(f"The CRS {shown!r} is not known; give an EPSG code such as 'EPSG:32611'.") from error


def check_no_files(text: str) -> None:
    """What a file states of its CRS, before GDAL reads it. Raises FrameError where it names a file to open."""
    named = FILE_PARTS.search(text)
    if named is not None:
        raise FrameError(
            f"The CRS holds {named[0].upper()}, which makes PROJ open a file; take it out, such as by writing the CRS "
            "anew as an authority code."
        )
    if WKT_INSIDE.search(text):
        _check_inner(PE_STRING.sub("", text))


def _check_length(text: str) -> None:
    if len(text) > LONGEST_TEXT:
        raise FrameError(f"A CRS of {len(text):,} characters is not taken; give an EPSG code such as 'EPSG:32611'.")


def _text_of(crs: Any) -> str:
    """The text that PROJ may be given. Raises FrameError, ValueError, RecursionError."""
    if isinstance(crs, int) and not isinstance(crs, bool):
        return f"EPSG:{crs}"
    if isinstance(crs, tuple | list) and len(crs) == 2:
        crs = f"{crs[0]}:{crs[1]}"
    if isinstance(crs, Mapping):
        crs = json.dumps(crs) if "type" in crs and "proj" not in crs else _proj_string(crs)
    text = str(crs.to_wkt() if hasattr(crs, "to_wkt") else crs).strip().lstrip("\ufeff")
    _check_length(text)
    if "\0" in text:
        raise ValueError("PROJ ends its texts there.")
    for registered in (OGC_URN, OGC_URL, LEGACY_INIT):
        if (found := registered.fullmatch(text)) is not None:
            return f"{found[1].upper()}:{found[2]}"
    if AUTHORITY_CODE.fullmatch(text):
        return text
    if text.startswith("{"):
        return _checked_json(text)
    if WKT.match(text):
        _check_inner(text)
        return text
    if text.startswith("+") or PROJ_STRING.match(text):
        return _checked_proj(text)
    raise ValueError("This is no code, no WKT, no PROJJSON and no PROJ string.")


def _proj_string(parameters: Mapping[Any, Any]) -> str:
    return " ".join(f"+{key}" if value is True else f"+{key}={value}" for key, value in parameters.items())


def _checked_proj(text: str) -> str:
    """The same parameters, each one known to be harmless."""
    for word in text.split():
        found = PARAMETER.fullmatch(word)
        _check_parameter(*(found[1], found[2] or "") if found else (word, ""))
    return text


def _checked_json(text: str) -> str:
    """Written anew, so that what was checked is what PROJ reads."""
    document = json.loads(text)
    for inner in _texts_in(document):
        _check_inner(inner)
    return json.dumps(document)


def _check_inner(text: str) -> None:
    if PROJ_INSIDE.search(text):
        for key, value in PAIR.findall(text):
            _check_parameter(key, value)


def _check_parameter(key: str, value: str) -> None:
    harmless = value == NULL_GRID if key == "nadgrids" else PLAIN_VALUE.fullmatch(value) and value != "pipeline"
    if key not in PARAMETERS or not harmless:
        shown = f"{key}={value}" if value else key
        raise FrameError(
            f"The CRS holds {shown[:60]!r}, which may make PROJ open a file, so it is not taken; give an authority "
            "code such as 'EPSG:32611', or a PROJ string of plain map parameters."
        )


def _texts_in(document: Any) -> Iterator[str]:
    if isinstance(document, str):
        yield document
    elif isinstance(document, dict):
        for key, value in document.items():
            yield key
            yield from _texts_in(value)
    elif isinstance(document, list):
        for value in document:
            yield from _texts_in(value)


def _without_grid_files(crs: pyproj.CRS) -> pyproj.CRS:
    """The CRS without the geoid models of its heights. Raises FrameError where its positions need a file."""
    description = crs.to_json_dict()
    plain = _without_geoids(description)
    for files in _file_parameters(plain):
        raise FrameError(
            f"The CRS needs the file {files[:60]!r} for its datum, and files that a CRS names are not opened; give an "
            "authority code such as 'EPSG:32611'."
        )
    return crs if plain == description else pyproj.CRS.from_json_dict(plain)


def _without_geoids(description: Any) -> Any:
    if isinstance(description, list):
        return [_without_geoids(part) for part in description]
    if not isinstance(description, dict):
        return description
    if description.get("type") == "BoundCRS" and description["source_crs"].get("type") == "VerticalCRS":
        return _without_geoids(description["source_crs"])
    # geoid_model only tells which one; it is a name
    return {key: _without_geoids(value) for key, value in description.items()}


def _file_parameters(description: Any) -> Iterator[str]:
    """Values of parameters that are texts: files."""
    if isinstance(description, list):
        for part in description:
            yield from _file_parameters(part)
    elif isinstance(description, dict):
        for parameter in description.get("parameters", ()):
            if isinstance(parameter.get("value"), str) and parameter["value"] != NULL_GRID:
                yield parameter["value"]
        for part in description.values():
            yield from _file_parameters(part)
