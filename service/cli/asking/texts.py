"""Heights, places, anchors, cuts and frames as options write them, as fields of requests.

A height is 80agl above the ground, 612msl above sea level, 660hae above the ellipsoid.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from service.errors import RequestError
from service.files.written import written_number

if TYPE_CHECKING:
    from service.parts.anchors import AnchorIn

__all__ = [
    "ANCHOR_FORM",
    "anchor_from_text",
    "bounds_fields",
    "ceiling_fields",
    "cut_fields",
    "frames_fields",
    "height_field",
    "height_fields",
    "numbers_of",
    "place_fields",
    "position_fields",
]

HEIGHT = re.compile(r"(?P<metres>[^a-zA-Z]+(?:[eE][-+]?\d+)?)(?P<above>agl|msl|hae)", re.IGNORECASE)
ANCHOR_FORM = "ID,EAST,NORTH,HEIGHT with HEIGHT like 80agl (above ground), 612msl (sea level) or 650hae (ellipsoid)"
CUT_FORM = "a line EAST,NORTH,EAST,NORTH of two or more places nor a height like 1000msl or 50agl"


def anchor_from_text(text: str, *, lonlat: bool) -> AnchorIn:
    """The anchor that an --anchor option describes. Raises RequestError."""
    from pydantic import ValidationError

    from service.parts.anchors import AnchorIn
    from service.parts.sentences import sentence_of

    complaint = f"--anchor {text!r} is not of the form {ANCHOR_FORM}."
    name, comma, position = text.partition(",")
    if not comma:
        raise RequestError(complaint)
    fields = position_fields(position, lonlat=lonlat, complaint=complaint)
    try:
        return AnchorIn.model_validate({"id": name.strip(), **fields})
    except ValidationError as error:
        raise RequestError(f"--anchor {text!r}: {sentence_of(error)}") from error


def place_fields(text: str, *, lonlat: bool, complaint: str) -> dict[str, float]:
    """EAST,NORTH as the fields of a request. Raises RequestError with the given complaint."""
    numbers = numbers_of(text)
    if numbers is None or len(numbers) != 2:
        raise RequestError(complaint)
    return dict(zip(("lon_deg", "lat_deg") if lonlat else ("east_m", "north_m"), numbers, strict=True))


def position_fields(text: str, *, lonlat: bool, complaint: str) -> dict[str, float | str]:
    """EAST,NORTH,HEIGHT as the fields of a request. Raises RequestError with the given complaint."""
    pair, _, height = text.rpartition(",")
    metres = height_field(height, complaint)
    place = place_fields(pair, lonlat=lonlat, complaint=complaint)
    if lonlat and abs(place["lon_deg"]) <= 90.0 < abs(place["lat_deg"]) <= 360.0:
        first, second = place.values()
        raise RequestError(
            f"{second:g} degrees is no latitude; --lonlat takes the longitude first: {second:g},{first:g}."
        )
    return {**place, **metres}


def height_field(text: str, complaint: str) -> dict[str, float | str]:
    """80agl, 612msl or 660hae as the fields of a request. Raises RequestError with the given complaint."""
    found = height_fields(text)
    if found is None:
        raise RequestError(complaint)
    return found


def ceiling_fields(text: str) -> dict[str, float | str]:
    """--ceiling as the fields of a request. Raises RequestError."""
    found = height_fields(text, "ceiling_")
    if found is None:
        raise RequestError(f"--ceiling {text!r} is not of the form 2500msl (altitude) or 300agl (above ground).")
    return found


def cut_fields(text: str, *, lonlat: bool) -> dict[str, object]:
    """One --cut as an entry of a request's ``cuts``. Raises RequestError."""
    height = height_fields(text)
    if height is not None:
        return {**height}
    numbers = numbers_of(text)
    if numbers is None or len(numbers) < 4 or len(numbers) % 2:
        raise RequestError(f"--cut {text!r} is neither {CUT_FORM}.")
    first, second = ("lon_deg", "lat_deg") if lonlat else ("east_m", "north_m")
    return {"line": [{first: a, second: b} for a, b in zip(numbers[::2], numbers[1::2], strict=True)]}


def bounds_fields(text: str) -> dict[str, float]:
    """--bounds as the ``bounds_m`` of a request. Raises RequestError."""
    numbers = numbers_of(text)
    if numbers is None or len(numbers) != 4:
        raise RequestError(f"--bounds {text!r} is not of the form WEST,SOUTH,EAST,NORTH in metres.")
    return dict(zip(("west_m", "south_m", "east_m", "north_m"), numbers, strict=True))


def frames_fields(frames: str | None, available_at: str | None) -> dict[str, float | str] | None:
    """--frames and --available-at as the ``frames`` of a request; None without. Raises RequestError."""
    if frames is None:
        if available_at is not None:
            raise RequestError("--available-at needs --frames FROM,TO,STEP.")
        return None
    numbers = numbers_of(frames)
    if numbers is None or len(numbers) != 3:
        raise RequestError(f"--frames {frames!r} is not of the form FROM,TO,STEP in seconds.")
    fields: dict[str, float | str] = dict(zip(("from_s", "to_s", "step_s"), numbers, strict=True))
    if available_at is None:
        return fields
    form = f"--available-at {available_at!r} is not of the form 60agl (above ground) or 1500msl (altitude)."
    return {**fields, **height_field(available_at, form)}


def numbers_of(text: str) -> list[float] | None:
    """Numbers with commas between them; None for any other text."""
    try:
        return [written_number(part) for part in text.split(",")]
    except ValueError:
        return None


def height_fields(text: str, prefix: str = "") -> dict[str, float | str] | None:
    """The fields of a request that 80agl, 612msl or 660hae make; None for any other text.

    prefix: of the names of the fields, as in ceiling_altitude_m.
    """
    height = HEIGHT.fullmatch(text.strip())
    if height is None:
        return None
    try:
        metres, word = written_number(height["metres"]), height["above"].lower()
    except ValueError:
        return None
    if word == "agl":
        return {f"{prefix}above_ground_m": metres}
    return {f"{prefix}altitude_m": metres, "altitude_datum": word}
