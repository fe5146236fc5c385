"""Units of heights and of CRS axes, brought to metres."""

from __future__ import annotations

import pyproj

from .errors import DemUnsupportedError

__all__ = ["HEIGHT_UNITS", "height_unit_of", "in_metres", "metres_per_unit"]

# metres per unit; the keys are what height_unit= takes
HEIGHT_UNITS = {"m": 1.0, "ft": 0.3048, "us-ft": 1200.0 / 3937.0}
SPELLINGS = {
    "m": {"m", "metre", "meter", "metres", "meters"},
    "ft": {"ft", "foot", "feet", "international foot", "international feet"},
    "us-ft": {"us-ft", "ft_us", "ftus", "usft", "us survey foot", "us survey feet", "foot_us", "survey foot"},
}


def height_unit_of(text: str | None) -> str | None:
    """The key of HEIGHT_UNITS for a unit as files spell it; None for an empty one. Raises DemUnsupportedError."""
    if text is None or not text.strip():
        return None
    plain = text.strip().lower().replace("u.s.", "us").replace("  ", " ")
    for unit, spellings in SPELLINGS.items():
        if plain in spellings:
            return unit
    raise DemUnsupportedError(
        f"The height unit {text[:40]!r} is not known; give height_unit= as one of {', '.join(HEIGHT_UNITS)}."
    )


def metres_per_unit(crs: pyproj.CRS) -> float:
    """Metres per unit of a projected CRS's axes."""
    return float(crs.axis_info[0].unit_conversion_factor)


def in_metres(crs: pyproj.CRS) -> pyproj.CRS:
    """The same projection with metres on its axes: positions are those of ``crs`` times ``metres_per_unit``."""
    description = crs.to_json_dict()
    for axis in description["coordinate_system"]["axis"]:
        axis["unit"] = "metre"
    description.pop("id", None)
    description["name"] = f"{crs.name} in metres"
    return pyproj.CRS.from_json_dict(description)
