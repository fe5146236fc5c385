"""Anchors as options write them: ID,EAST,NORTH,HEIGHT."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from service.errors import RequestError
from service.parts.anchors import AnchorIn
from service.parts.sentences import sentence_of

from .height_words import height_field

__all__ = ["anchor_from_text", "position_fields"]

FORM = "ID,EAST,NORTH,HEIGHT with HEIGHT like 80agl (above ground), 612msl (sea level) or 650hae (ellipsoid)"


def anchor_from_text(text: str, *, lonlat: bool) -> AnchorIn:
    """The anchor that an --anchor option describes. Raises RequestError."""
    name, comma, position = text.partition(",")
    if not comma:
        raise RequestError(f"--anchor {text!r} is not of the form {FORM}.")
    fields = position_fields(position, lonlat=lonlat, complaint=f"--anchor {text!r} is not of the form {FORM}.")
    try:
        return AnchorIn.model_validate({"id": name.strip(), **fields})
    except ValidationError as error:
        raise RequestError(f"--anchor {text!r}: {sentence_of(error)}") from error


def position_fields(text: str, *, lonlat: bool, complaint: str) -> dict[str, Any]:
    """EAST,NORTH,HEIGHT as the fields of a request. Raises RequestError with the given complaint."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 3:
        raise RequestError(complaint)
    height = height_field(parts[-1], complaint)
    try:
        first, second = float(parts[0]), float(parts[1])
    except ValueError as error:
        raise RequestError(complaint) from error
    if lonlat and abs(first) <= 90.0 < abs(second) <= 360.0:
        raise RequestError(
            f"{second:g} degrees is no latitude; --lonlat takes the longitude first: {second:g},{first:g}."
        )
    pair = ("lon_deg", "lat_deg") if lonlat else ("east_m", "north_m")
    return {pair[0]: first, pair[1]: second, **height}
