"""Heights, places, anchors, cuts and frames as options write them, as fields of requests.

A height is 80agl above the ground, 612msl above sea level, 660hae above the ellipsoid.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from service.errors import RequestError

if TYPE_CHECKING:
    from service.parts.anchors import AnchorIn
    from terrain import ElevationGrid

__all__ = [
    "ANCHOR_FORM",
    "anchor_from_text",
    "bounds_fields",
    "ceiling_fields",
    "cut_fields",
    "frames_fields",
    "height_field",
    "height_words",
    "numbers_of",
    "place_fields",
    "position_fields",
    "told_of_heights",
    "warnings_with",
]

HEIGHT = re.compile(r"(?P<metres>[^a-zA-Z]+(?:[eE][-+]?\d+)?)(?P<above>agl|msl|hae)", re.IGNORECASE)
ANCHOR_FORM = "ID,EAST,NORTH,HEIGHT with HEIGHT like 80agl (above ground) or 612msl (altitude)"
FROM_WHERE = "what its heights count from"
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


def position_fields(text: str, *, lonlat: bool, complaint: str) -> dict[str, float]:
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


def height_field(text: str, complaint: str) -> dict[str, float]:
    """80agl or 612msl as a field of a request. Raises RequestError with the given complaint."""
    found = _height(text)
    if found is None:
        raise RequestError(complaint)
    return found


def ceiling_fields(text: str) -> dict[str, float]:
    """--ceiling as a field of a request. Raises RequestError."""
    complaint = f"--ceiling {text!r} is not of the form 2500msl (altitude) or 300agl (above ground)."
    return {f"ceiling_{name}": metres for name, metres in height_field(text, complaint).items()}


def cut_fields(text: str, *, lonlat: bool) -> dict[str, object]:
    """One --cut as an entry of a request's ``cuts``. Raises RequestError."""
    height = _height(text)
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


def frames_fields(frames: str | None, available_at: str | None) -> dict[str, float] | None:
    """--frames and --available-at as the ``frames`` of a request; None without. Raises RequestError."""
    if frames is None:
        if available_at is not None:
            raise RequestError("--available-at needs --frames FROM,TO,STEP.")
        return None
    numbers = numbers_of(frames)
    if numbers is None or len(numbers) != 3:
        raise RequestError(f"--frames {frames!r} is not of the form FROM,TO,STEP in seconds.")
    fields = dict(zip(("from_s", "to_s", "step_s"), numbers, strict=True))
    if available_at is None:
        return fields
    form = f"--available-at {available_at!r} is not of the form 60agl (above ground) or 1500msl (altitude)."
    return {**fields, **height_field(available_at, form)}


def numbers_of(text: str) -> list[float] | None:
    """Numbers with commas between them; None for any other text."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        return None


def height_words(*options: str | Iterable[str] | None) -> frozenset[str]:
    """Which of the words agl, msl and hae the heights at the ends of these options' texts have."""
    texts = [text for one in options if one is not None for text in ([one] if isinstance(one, str) else one)]
    found = (HEIGHT.fullmatch(text.rpartition(",")[-1].strip()) for text in texts)
    return frozenset(height["above"].lower() for height in found if height is not None)


def told_of_heights(grid: ElevationGrid, words: frozenset[str]) -> tuple[str, ...]:
    """What to know about heights that were given with these words. Raises RequestError where the DEM has no such.

    A local frame has one kind of altitude only, and any word means it.
    """
    from service.parts.map_facts import body_name
    from terrain import HeightReference, height_reference_of

    if grid.crs is None:
        return ()
    means = {"msl": HeightReference.SEA_LEVEL, "hae": HeightReference.ELLIPSOID}
    body, reference, told = body_name(grid), height_reference_of(grid), []
    for word in sorted(words & means.keys()):
        if word == "msl" and body != "Earth":
            told.append(f"{body} has no sea level: heights given as msl were taken as the DEM counts its own.")
        elif reference is HeightReference.UNKNOWN:
            told.append(f"The DEM does not say {FROM_WHERE}: those given as {word} were taken as it counts.")
        elif reference is not means[word]:
            other = "hae" if word == "msl" else "msl"
            raise RequestError(
                f"The DEM's heights count from the {reference} ({grid.vertical_datum}), and no geoid model is there to "
                f"bring heights given as {word} to it; give them above the ground (80agl), or from there (612{other})."
            )
    return tuple(told)


def warnings_with(told: Iterable[str], warnings: Iterable[str]) -> list[str]:
    """The warnings of an answer with what told_of_heights told; what both say is said once."""
    found = list(warnings)
    for sentence in told:
        _, same, more = sentence.partition(f"{FROM_WHERE}: ")
        said = next((number for number, one in enumerate(found) if same and f"{FROM_WHERE}; " in one), None)
        if said is None:
            found.append(sentence)
        else:
            found[said] = f"{found[said].removesuffix('.')}, and {more}"
    return found


def _height(text: str) -> dict[str, float] | None:
    """80agl or 612msl as a field of a request; None for any other text."""
    height = HEIGHT.fullmatch(text.strip())
    if height is None:
        return None
    try:
        return {"above_ground_m" if height["above"].lower() == "agl" else "altitude_m": float(height["metres"])}
    except ValueError:
        return None
