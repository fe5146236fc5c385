"""A file's CRS taken apart: horizontal part, height unit and vertical datum."""

from __future__ import annotations

from typing import Any

import pyproj
from pyproj.exceptions import CRSError

from .errors import FrameError

__all__ = ["horizontal_part", "parse_crs", "vertical_part"]


def parse_crs(crs: Any) -> pyproj.CRS:
    """Any way of writing a CRS (EPSG code, WKT, PROJ string, pyproj or rasterio CRS) as pyproj's. Raises FrameError."""
    try:
        return pyproj.CRS.from_user_input(crs.to_wkt() if hasattr(crs, "to_wkt") else crs)
    except CRSError as error:
        raise FrameError(f"The CRS {str(crs)[:80]!r} is not known; give an EPSG code such as 'EPSG:32611'.") from error


def horizontal_part(crs: pyproj.CRS) -> pyproj.CRS:
    """The two-dimensional CRS in a compound, bound or three-dimensional one; the registered one where it is that."""
    if crs.is_bound and crs.source_crs is not None:
        return horizontal_part(crs.source_crs)
    if crs.is_compound:
        return horizontal_part(crs.sub_crs_list[0])
    flat = crs.to_2d() if len(crs.axis_info) == 3 else crs
    code = flat.to_epsg(min_confidence=100)
    return flat if code is None else pyproj.CRS.from_epsg(code)


def vertical_part(crs: pyproj.CRS) -> tuple[str | None, str | None]:
    """(vertical datum, unit of the heights as the CRS spells it); None where the CRS has no heights."""
    if crs.is_bound and crs.source_crs is not None:
        return vertical_part(crs.source_crs)
    if crs.is_compound:
        vertical = crs.sub_crs_list[1]
        return vertical.name, vertical.axis_info[0].unit_name
    if len(crs.axis_info) == 3:
        return f"ellipsoid of {crs.name}", crs.axis_info[2].unit_name
    return None, None
