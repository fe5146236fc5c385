"""What of a request changes nothing: radios and trees where sight decides; and what a canopy's model cannot tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pydantic import BaseModel

from service.parts.anchors import AntennaIn
from service.parts.radios import RadioIn, SightChoice
from terrain import ElevationGrid
from visibility.signal import foliage_of

__all__ = ["notes_on_unused"]

NAMED = 5
BECAUSE = "this answer is of what is in sight, not of what is usable"


def notes_on_unused(grid: ElevationGrid, asked: BaseModel) -> list[str]:
    """Sentences on radios and canopy of a request that are not looked at, and on what the canopy's model cannot tell.

    grid: the request's ground with what stands on it. A part of a request that asks for what is usable (a morphing map
    below a path) looks at the radios of its own anchors, and at the canopy.
    """
    parts = tuple(_parts(asked))
    usable = [isinstance(part, SightChoice) and part.usable for part in parts]
    unheard = [antenna for part, heard in zip(parts, usable, strict=True) if not heard for antenna in _antennas(part)]
    silent = [antenna.id for antenna in unheard if antenna.radio is not None]
    told = []
    if silent:
        more = f" and {len(silent) - NAMED} more" if len(silent) > NAMED else ""
        told.append(f"Not looked at: the radio of {', '.join(silent[:NAMED])}{more}, since {BECAUSE}.")
    # a link to a base has a radio of its own, and is heard or not whatever decides of ranges
    linked = any(isinstance(part, RadioIn) for part in parts)
    if grid.trees is not None and not any(usable) and not linked:
        told.append(f"Not looked at: the canopy, since {BECAUSE}; trees hide nothing.")
    heard = [antenna for part, used in zip(parts, usable, strict=True) if used for antenna in _antennas(part)]
    # of anchors that are placed and of links the radio is a part of its own
    radios = [*(one.radio for one in heard), *(part for part in parts if isinstance(part, RadioIn))]
    return [*told, *_beyond_the_model(grid, [radio.radio().frequency_hz for radio in radios if radio is not None])]


def _beyond_the_model(grid: ElevationGrid, frequencies_hz: Sequence[float]) -> list[str]:
    """What the canopy's model says of its own range at frequencies: nothing is extended beyond it."""
    foliage = foliage_of(grid)
    if foliage is None:
        return []
    notes = [foliage.loss([1.0], one, [1.0]).notes for one in dict.fromkeys(frequencies_hz)]
    return list(dict.fromkeys(note for some in notes for note in some))


def _parts(asked: BaseModel) -> Iterator[BaseModel]:
    """The request and what it has within, but for the long lists."""
    yield asked
    for name in type(asked).model_fields:
        part = getattr(asked, name)
        if isinstance(part, BaseModel):
            yield from _parts(part)


def _antennas(part: BaseModel) -> Iterator[AntennaIn]:
    for name in type(part).model_fields:
        things = getattr(part, name)
        if isinstance(things, (list, tuple)) and things and isinstance(things[0], AntennaIn):
            yield from things
