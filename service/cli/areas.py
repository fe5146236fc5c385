"""``--area``, ``--around`` and ``--polygon``: which piece of ground a command is about."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from service.errors import RequestError

__all__ = ["AreaFile", "AreaText", "AroundText", "area_fields"]

Fields = dict[str, Any]

RADIUS = re.compile(r"(\d+(?:\.\d*)?|\.\d+)\s*(km|m)?")

AreaText = Annotated[
    str | None, typer.Option("--area", metavar="W,S,E,N", help="Only this box: degrees, or metres where pairs are.")
]
AroundText = Annotated[
    str | None,
    typer.Option("--around", metavar="PLACE,RADIUS", help="Only what is so near to a place: -84.23,36.2,5km."),
]
AreaFile = Annotated[
    Path | None, typer.Option("--polygon", metavar="FILE", help="Only the polygon in a GeoJSON file, in degrees.")
]


def area_fields(box: str | None, around: str | None, file: Path | None, *, in_degrees: bool) -> Fields | None:
    """The area of the options as the field of a request, None without one. Raises RequestError."""
    if sum(option is not None for option in (box, around, file)) > 1:
        raise RequestError("Give only one of --area, --around and --polygon.")
    unit = "deg" if in_degrees else "m"
    if box is not None:
        sides = _numbers("--area", box, box.split(","), 4, "W,S,E,N")
        return dict(zip((f"west_{unit}", f"south_{unit}", f"east_{unit}", f"north_{unit}"), sides, strict=True))
    if around is not None:
        *place, radius = around.split(",")
        x, y = _numbers("--around", around, place, 2, "PLACE,RADIUS, such as -84.23,36.2,5km")
        found = RADIUS.fullmatch(radius.strip())
        if found is None:
            raise RequestError(f"--around {around!r} ends in no radius in metres or kilometres, such as 5000 or 5km.")
        names = ("lon_deg", "lat_deg") if in_degrees else ("east_m", "north_m")
        radius_m = float(found[1]) * (1000.0 if found[2] == "km" else 1.0)
        return {names[0]: x, names[1]: y, "radius_m": radius_m}
    if file is None:
        return None
    from .shape_files import polygon_fields

    polygons = polygon_fields(file)
    if len(polygons) != 1:
        raise RequestError(f"The file {file.name} holds {len(polygons)} polygons; an area is one.")
    return polygons[0]


def _numbers(option: str, text: str, words: list[str], count: int, form: str) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise RequestError(f"{option} {text!r} is not of the form {form}.") from error
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise RequestError(f"{option} {text!r} is not of the form {form}.")
    return numbers
