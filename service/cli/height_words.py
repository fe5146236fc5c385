"""Heights as options write them: 80agl above the ground, 612msl above sea level, 660hae above the ellipsoid."""

from __future__ import annotations

import re
from collections.abc import Iterable

from service.errors import RequestError
from service.parts.map_facts import body_name
from terrain import ElevationGrid, HeightReference, height_reference_of

__all__ = ["HEIGHT", "height_words", "told_of_heights"]

HEIGHT = re.compile(r"(?P<metres>[^a-zA-Z]+(?:[eE][-+]?\d+)?)(?P<above>agl|msl|hae)", re.IGNORECASE)
MEANS = {"msl": HeightReference.SEA_LEVEL, "hae": HeightReference.ELLIPSOID}


def height_words(*options: str | Iterable[str] | None) -> frozenset[str]:
    """Which of the words agl, msl and hae the heights at the ends of these options' texts have."""
    texts = [text for one in options if one is not None for text in ([one] if isinstance(one, str) else one)]
    found = (HEIGHT.fullmatch(text.rpartition(",")[-1].strip()) for text in texts)
    return frozenset(height["above"].lower() for height in found if height is not None)


def told_of_heights(grid: ElevationGrid, words: frozenset[str]) -> tuple[str, ...]:
    """What to know about heights that were given with these words. Raises RequestError where the DEM has no such.

    A local frame has one kind of altitude only, and any word means it.
    """
    if grid.crs is None:
        return ()
    body, reference, told = body_name(grid), height_reference_of(grid), []
    for word in sorted(words & MEANS.keys()):
        if word == "msl" and body != "Earth":
            told.append(f"{body} has no sea level: heights given as msl were taken as the DEM counts its own.")
        elif reference is HeightReference.UNKNOWN:
            told.append(
                f"The DEM does not say what its heights count from: those given as {word} were taken as it counts."
            )
        elif reference is not MEANS[word]:
            other = "hae" if word == "msl" else "msl"
            raise RequestError(
                f"The DEM's heights count from the {reference} ({grid.vertical_datum}), and no geoid model is there to "
                f"bring heights given as {word} to it; give them above the ground (80agl), or from there (612{other})."
            )
    return tuple(told)
