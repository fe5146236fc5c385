"""Heights as options write them: 80agl above the ground, 612msl above sea level, 660hae above the ellipsoid."""

from __future__ import annotations

import re

from service.errors import RequestError

__all__ = ["height_field", "height_fields"]

HEIGHT = re.compile(r"(?P<metres>[^a-zA-Z]+(?:[eE][-+]?\d+)?)(?P<above>agl|msl|hae)", re.IGNORECASE)


def height_fields(text: str, prefix: str = "") -> dict[str, float | str] | None:
    """The fields of a request that 80agl, 612msl or 660hae make; None for any other text.

    prefix: of the names of the fields, as in ceiling_altitude_m.
    """
    height = HEIGHT.fullmatch(text.strip())
    if height is None:
        return None
    try:
        metres, word = float(height["metres"]), height["above"].lower()
    except ValueError:
        return None
    if word == "agl":
        return {f"{prefix}above_ground_m": metres}
    return {f"{prefix}altitude_m": metres, "altitude_datum": word}


def height_field(text: str, complaint: str) -> dict[str, float | str]:
    """The same. Raises RequestError with the given complaint for any other text."""
    fields = height_fields(text)
    if fields is None:
        raise RequestError(complaint)
    return fields
