"""Units of heights and of CRS axes, brought to metres."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import pyproj

from .errors import DemUnsupportedError

__all__ = [
    "HEIGHT_UNITS",
    "HeightUnit",
    "axis_unit",
    "counts_down",
    "degrees_per_unit",
    "height_unit_of",
    "height_unit_of_axis",
    "in_metres",
    "metres_per_unit",
]

# metres per unit; the keys are what height_unit= takes
HEIGHT_UNITS = {
    "m": 1.0, "ft": 0.3048, "us-ft": 1200.0 / 3937.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0,
}  # fmt: skip
FEET, SURVEY = ("ft", "foot", "feet"), ("us", "us survey", "survey", "usa survey")
# in lower case, with single spaces for everything that is neither letter nor digit
SPELLINGS = {
    **{f"{prefix}{word}": key
       for prefix, key in (("", "m"), ("deci", "dm"), ("centi", "cm"), ("milli", "mm"), ("kilo", "km"))
       for word in ("meter", "metre", "meters", "metres")},
    **{key: key for key in ("m", "dm", "cm", "mm", "km")},
    "mtr": "m", "mtrs": "m", "mts": "m",
    **dict.fromkeys(FEET, "ft"),
    **{f"{word} {foot}": "ft" for foot in FEET for word in ("international", "intl", "int")},
    **{f"{foot} {word}": "ft" for foot in FEET for word in ("international", "intl", "int")},
    "ift": "ft",
    **{f"{word} {foot}": "us-ft" for foot in FEET for word in SURVEY},
    **{f"{foot} {word}": "us-ft" for foot in FEET for word in SURVEY},
    **dict.fromkeys(("ftus", "usft", "sft", "survey ft us", "survey foot us", "survey feet us"), "us-ft"),
}  # fmt: skip
UNSAID = {"", "unknown", "none", "unspecified", "n a", "na"}
# after a unit: another dimension or a factor, where no height can be told
MULTIPLIED = re.compile(r"\s*([/*^×·²³]|(per|x|times|sq\w*|cub\w*|by)\b|[-+]?\d)", re.IGNORECASE)
# which way numbers count: "below sea level", "m (depth)", "positive down", but "m, negative below sea level" counts up
DOWN_WORDS = re.compile(r"(?<![^\W_])(below|beneath|under|depths?|soundings?|down(wards?)?)(?![^\W_])", re.IGNORECASE)
UP_WORDS = re.compile(r"(?<![^\W_])(above|over|heights?|altitudes?|elevations?|up(wards?)?)(?![^\W_])", re.IGNORECASE)
NEGATIVE = re.compile(r"(?<![^\W_])(negative|minus)(?![^\W_])", re.IGNORECASE)
# what stands before the name of the surface that heights count from
BEFORE_SURFACE = re.compile(
    r"^([\W_]|(above|over|below|beneath|under|depths?|heights?|positive|negative|up(wards?)?|down(wards?)?)(?![^\W_]))+",
    re.IGNORECASE,
)
# two factors closer than this are one unit, spelled with fewer digits
SAME_UNIT = 1e-7


@dataclass(frozen=True, slots=True)
class HeightUnit:
    """A unit of heights: what to call it, metres per unit, and what the words say that heights are above.

    down: whether heights count downward, as depths do; None where it is not said.
    """

    name: str
    metres: float
    above: str | None = None
    down: bool | None = None


def height_unit_of(text: str | None) -> HeightUnit | None:
    """The unit that a file spells, such as "US_survey_foot" or "m above EGM2008"; None for an empty text.

    Raises DemUnsupportedError.
    """
    plain = re.sub(r"u\.s\.", "us", text or "", flags=re.IGNORECASE)
    words = list(re.finditer(r"[^\W_]+", plain))
    if " ".join(word[0] for word in words).lower() in UNSAID:
        return None
    for count in range(len(words), 0, -1):
        key = SPELLINGS.get(" ".join(word[0] for word in words[:count]).lower())
        if key is not None and not MULTIPLIED.match(rest := plain[words[count - 1].end() :]):
            above = re.sub(r"[\W_]+$", "", BEFORE_SURFACE.sub("", rest))
            return HeightUnit(key, HEIGHT_UNITS[key], above or None, counts_down(plain))
    raise DemUnsupportedError(
        f"The height unit {plain[:40]!r} is not known; give height_unit= as one of {', '.join(HEIGHT_UNITS)}."
    )


def counts_down(text: str | None) -> bool | None:
    """Whether the words of a unit say that heights count downward; None where they say neither, or both."""
    down, up = (words.search(text or "") is not None for words in (DOWN_WORDS, UP_WORDS))
    if down == up:
        return None
    return down != (NEGATIVE.search(text or "") is not None)


def height_unit_of_axis(axis: Any) -> HeightUnit:
    """The unit of a vertical axis of a CRS, which always tells its metres and its direction."""
    metres, down = float(axis.unit_conversion_factor), axis.direction.lower() == "down"
    for name, known in HEIGHT_UNITS.items():
        if abs(metres / known - 1.0) < SAME_UNIT:
            return HeightUnit(name, known, down=down)
    return HeightUnit(axis.unit_name, metres, down=down)


def metres_per_unit(crs: pyproj.CRS) -> float:
    """Metres per unit of the horizontal axes of a CRS that is not in degrees."""
    return float(crs.axis_info[0].unit_conversion_factor)


def degrees_per_unit(crs: pyproj.CRS) -> float:
    """Degrees per unit of a geographic CRS's axes: 0.9 where they are in grads."""
    return math.degrees(crs.axis_info[0].unit_conversion_factor)


def axis_unit(crs: pyproj.CRS) -> str:
    """What to call the unit of a CRS's horizontal axes."""
    name = str(crs.axis_info[0].unit_name)
    return f"units of {metres_per_unit(crs):.10g} m" if name in ("", "unknown") else name


def in_metres(crs: pyproj.CRS) -> pyproj.CRS:
    """The same projection with metres on its axes: positions are those of ``crs`` times ``metres_per_unit``."""
    description = crs.to_json_dict()
    for axis in description["coordinate_system"]["axis"]:
        axis["unit"] = "metre"
    description.pop("id", None)
    description["name"] = f"{crs.name} in metres"
    return pyproj.CRS.from_json_dict(description)
