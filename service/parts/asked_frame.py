"""Answers and refusals name places in the frame in which the request does."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any, Concatenate, ParamSpec, TypeVar

from pydantic import BaseModel

from terrain import ElevationGrid, places_told

__all__ = ["told_as_asked"]

P = ParamSpec("P")
Asked = TypeVar("Asked", bound=BaseModel)
Answer = TypeVar("Answer")

# whoever ranges to anchors given in degrees may still ask about places in metres
BESIDES = frozenset({"anchors", "tracks", "morphing_map", "no_go", "keep_in"})


def told_as_asked(
    function: Callable[Concatenate[ElevationGrid, Asked, P], Answer],
) -> Callable[Concatenate[ElevationGrid, Asked, P], Answer]:
    """The function, within which sentences name places in metres, degrees or both, as its request does."""

    @functools.wraps(function)
    def told(grid: ElevationGrid, asked: Asked, /, *args: P.args, **kwargs: P.kwargs) -> Answer:
        frames = set(_frames(asked, BESIDES)) or set(_frames(asked, frozenset()))
        degrees = "degrees" in frames and grid.crs is not None
        with places_told(in_metres="metres" in frames or not degrees, in_degrees=degrees):
            return function(grid, asked, *args, **kwargs)

    return told


def _frames(thing: Any, besides: frozenset[str]) -> Iterator[str]:
    """In which frames the places of a request are given."""
    if isinstance(thing, BaseModel):
        names = type(thing).model_fields
        if getattr(thing, "lon_deg", None) is not None or "coordinates" in names:
            yield "degrees"
        elif getattr(thing, "east_m", None) is not None:
            yield "metres"
        else:
            for name in names:
                if name not in besides:
                    yield from _frames(getattr(thing, name), besides)
    elif isinstance(thing, list | tuple):
        for one in thing:
            yield from _frames(one, besides)
