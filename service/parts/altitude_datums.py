"""Altitudes of a request that name their vertical datum, brought to that of the DEM before anything is calculated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from service.errors import RequestError
from service.parts.map_facts import body_name
from service.parts.points import InADatum
from terrain import (
    ElevationGrid,
    HeightReference,
    altitude_step,
    height_reference_of,
    parse_vertical_datum,
    to_grid_frame,
    vertical_datum_of,
)

__all__ = ["in_dem_datum"]

Asked = TypeVar("Asked", bound=BaseModel)

# what an option's height may say; on a DEM that knows no datum they are its own
WORDS = {"msl", "hae"}
# places at which the datums of a horizontal plane are compared: the middle of the DEM, then its corners
PLANE_AT = ((0.5, 0.5), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0))


def in_dem_datum(grid: ElevationGrid, asked: Asked) -> tuple[Asked, tuple[str, ...]]:
    """The request with every altitude in the DEM's vertical datum; what there is to tell of how they got there.

    Points are brought there where they are. A horizontal plane becomes one that is right in the middle of the DEM.
    Raises VerticalDatumError, FrameError, RequestError: a datum of the Earth on another body.
    """
    parts = [part for part in _parts(asked) if part.altitude_datum is not None]
    if not parts:
        return asked, ()
    steps_m: dict[int, float] = {}
    told: list[str] = []
    for name in sorted({str(part.altitude_datum) for part in parts}):
        named = [part for part in parts if part.altitude_datum == name]
        told += _steps(grid, name, named, steps_m)
    return _replaced(asked, lambda part: steps_m[id(part)]), tuple(told)


def _steps(grid: ElevationGrid, name: str, parts: list[InADatum], steps_m: dict[int, float]) -> tuple[str, ...]:
    """Put down what to add to each part's altitudes, all above one datum."""
    own = vertical_datum_of(grid)
    if own is None:
        steps_m.update({id(part): 0.0 for part in parts})
        return _taken_as_they_are(grid, name)
    points = [part for part in parts if _is_placed(part)]
    planes = [part for part in parts if not _is_placed(part)]
    corners = [grid.position_of(row * (grid.rows - 1), col * (grid.cols - 1)) for row, col in PLANE_AT if planes]
    places = np.array([*(_place(grid, point) for point in points), *corners])
    step_m, told = altitude_step(grid, *places.T, given=parse_vertical_datum(name), wanted=own)
    steps_m.update({id(point): float(metres) for point, metres in zip(points, step_m, strict=False)})
    of_plane_m = step_m[len(points) :]
    steps_m.update({id(plane): float(of_plane_m[0]) for plane in planes})
    if step_m.any():
        change = f"{step_m.min():+.2f} m" if np.ptp(step_m) < 0.005 else f"{step_m.min():+.2f} to {step_m.max():+.2f} m"
        told = (f"Altitudes given as {name} were brought to the DEM's datum, {own.name}: {change}.", *told)
    if planes and np.ptp(of_plane_m) >= 0.005:
        told += (
            f"A plane at an altitude given as {name} is right in the middle of the DEM and up to "
            f"{np.abs(of_plane_m - of_plane_m[0]).max():.2f} m off at its corners.",
        )
    return told


def _taken_as_they_are(grid: ElevationGrid, name: str) -> tuple[str, ...]:
    """A local frame has one kind of altitude only, and any word means it. Raises RequestError."""
    if grid.crs is None:
        return ()
    body = body_name(grid)
    if body == "Earth":
        return (f"The DEM does not say what its heights count from: those given as {name} were taken as it counts.",)
    if name.lower() not in WORDS:
        raise RequestError(f"The DEM lies on {body}, where no altitude counts from {name}, which is of the Earth.")
    if name.lower() == "msl":
        return (f"{body} has no sea level: heights given as msl were taken as the DEM counts its own.",)
    if height_reference_of(grid) is HeightReference.ELLIPSOID:
        return ()
    return (f"The DEM does not say what its heights count from: those given as {name} were taken as it counts.",)


def _is_placed(part: InADatum) -> bool:
    return getattr(part, "lon_deg", None) is not None or getattr(part, "east_m", None) is not None


def _place(grid: ElevationGrid, part: Any) -> tuple[float, float]:
    return (part.east_m, part.north_m) if part.lon_deg is None else to_grid_frame(grid, part.lon_deg, part.lat_deg)


def _parts(thing: object) -> Iterator[InADatum]:
    if isinstance(thing, InADatum):
        yield thing
    if isinstance(thing, BaseModel):
        for name in type(thing).model_fields:
            yield from _parts(getattr(thing, name))
    elif isinstance(thing, (list, tuple)) and thing and isinstance(thing[0], (BaseModel, list, tuple)):
        for one in thing:
            yield from _parts(one)


def _replaced(thing: Any, step_m: Callable[[InADatum], float]) -> Any:
    """The same with the altitudes of every part that names a datum moved, and the datum's name taken out."""
    if isinstance(thing, list) and thing and isinstance(thing[0], (BaseModel, list)):
        return [_replaced(one, step_m) for one in thing]
    if not isinstance(thing, BaseModel):
        return thing
    old = {name: getattr(thing, name) for name in type(thing).model_fields}
    new = {name: _replaced(value, step_m) for name, value in old.items()}
    changed = {name: value for name, value in new.items() if value is not old[name]}
    if isinstance(thing, InADatum) and thing.altitude_datum is not None:
        changed |= {name: _moved(old[name], step_m(thing)) for name in thing.altitudes()}
        changed["altitude_datum"] = None
    return thing.model_copy(update=changed) if changed else thing


def _moved(altitude_m: Any, metres: float) -> Any:
    return [one + metres for one in altitude_m] if isinstance(altitude_m, list) else altitude_m + metres
