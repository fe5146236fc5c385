"""A CRS taken apart: horizontal part, datum shift, vertical datum and height unit, and whether its axes make a grid."""

from __future__ import annotations

import re
from typing import Any

import pyproj

from ..units import HeightUnit, height_unit_of_axis

__all__ = ["axes_fault", "horizontal_part", "same_map", "split_shift", "vertical_part", "with_shift"]

# as PROJ turns them (always_xy): east and north; round a pole both run along meridians, away from the south pole or
# from the north pole, the first 90° clockwise of the second like any east and north
GRID_AXES = ({"east", "north"}, {"north"}, {"south"})

UNNAMED = {"", "unknown", "unnamed"}
# as GDAL names the datums of the ellipsoidal vertical CRSs of GeoTIFF 1.0, codes 5001 to 5033
BASED_ON = re.compile(r"Not specified \(based on (.+)\)")
ELLIPSOID = re.compile("ellipsoid|spheroid", re.IGNORECASE)
DEPTH = re.compile("depth", re.IGNORECASE)


def horizontal_part(crs: pyproj.CRS) -> pyproj.CRS:
    """The two-dimensional CRS in a compound or three-dimensional one, registered where it is that, with its shift."""
    crs, shift = split_shift(crs)
    if crs.is_compound:
        return with_shift(horizontal_part(crs.sub_crs_list[0]), shift)
    flat = crs.to_2d() if len(crs.axis_info) == 3 else crs
    code = flat.to_epsg(min_confidence=100)
    return with_shift(flat if code is None else pyproj.CRS.from_epsg(code), shift)


def vertical_part(crs: pyproj.CRS) -> tuple[str | None, HeightUnit | None]:
    """(vertical datum, unit and direction of the heights); None where the CRS has no heights.

    Depths are turned when they are read, so a datum that is named after them is named after heights here.
    """
    crs, _ = split_shift(crs)
    if crs.is_compound:
        vertical = crs.sub_crs_list[1]
        return _surface_of(vertical), height_unit_of_axis(vertical.axis_info[0])
    if len(crs.axis_info) == 3:
        return f"ellipsoid of {crs.name}", height_unit_of_axis(crs.axis_info[2])
    return None, None


def _surface_of(vertical: pyproj.CRS) -> str | None:
    """The name of a vertical CRS, or that of the ellipsoid that its datum names; GDAL leaves the first one empty."""
    datum = "" if vertical.datum is None else BASED_ON.sub(r"\1", vertical.datum.name)
    if ELLIPSOID.search(datum):
        return datum
    name = next((name for name in (vertical.name, datum) if name.lower() not in UNNAMED), None)
    return None if name is None else DEPTH.sub("height", name)


def split_shift(crs: pyproj.CRS) -> tuple[pyproj.CRS, dict[str, Any] | None]:
    """(the CRS itself, the datum shift that is bound to it), as TOWGS84 in a file binds one."""
    if not crs.is_bound or crs.source_crs is None:
        return crs, None
    description = crs.to_json_dict()
    return crs.source_crs, {key: description[key] for key in ("target_crs", "transformation")}


def with_shift(crs: pyproj.CRS, shift: dict[str, Any] | None) -> pyproj.CRS:
    """The CRS with a datum shift bound to it; without one, as it is."""
    if shift is None:
        return crs
    source = crs.to_json_dict()
    source.pop("$schema", None)
    bound = pyproj.CRS.from_json_dict({"type": "BoundCRS", "source_crs": source, **shift})
    return pyproj.CRS.from_wkt(bound.to_wkt())


def same_map(one: pyproj.CRS, other: pyproj.CRS) -> bool:
    """Whether two CRSs give one place the same east and north; datum shifts, which concern degrees alone, aside."""
    return bool(split_shift(one)[0].equals(split_shift(other)[0], ignore_axis_order=True))


def axes_fault(crs: pyproj.CRS) -> str | None:
    """Why a projected CRS's axes are no east and north, as a sentence; None where they are."""
    directions = {axis.direction.lower() for axis in crs.axis_info[:2]}
    if directions in GRID_AXES:
        return None
    return f"The axes of {crs.name} run {' and '.join(sorted(directions, reverse=True))}; warp the DEM to another CRS."
