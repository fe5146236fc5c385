"""What of a request changes nothing, or means nothing: radios and trees, and what a canopy's model cannot tell."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from pydantic import BaseModel

from service.parts.anchors import AntennaIn
from service.parts.radios import RadioIn, SightChoice
from terrain import ElevationGrid
from visibility.sight import ALL_ROUND
from visibility.signal import foliage_of

__all__ = ["notes_on_ranging_anchors", "notes_on_satellite_radios", "notes_on_unused"]

NAMED = 5
BECAUSE = "this answer is of what is in sight, not of what is usable"
SATELLITE = "gnss-l1"
# nothing that stands or flies over ground is so high
LOWEST_SATELLITE_M = 100_000.0


def notes_on_unused(grid: ElevationGrid, asked: BaseModel) -> list[str]:
    """Sentences on radios and canopy of a request that are not looked at, on radios of satellites near the ground, and
    on what the canopy's model cannot tell.

    grid: the request's ground with what stands on it. A part of a request that asks for what is usable (a morphing map
    below a path) looks at the radios of its own anchors, and at the canopy.
    """
    parts = tuple(_parts(asked))
    usable = [isinstance(part, SightChoice) and part.usable for part in parts]
    unheard = [antenna for part, heard in zip(parts, usable, strict=True) if not heard for antenna in _antennas(part)]
    silent = [antenna.id for antenna in unheard if antenna.radio is not None]
    told = []
    if silent:
        told.append(f"Not looked at: the radio of {_named(silent)}, since {BECAUSE}.")
    # a link to a base has a radio of its own, and is heard or not whatever decides of ranges
    linked = any(isinstance(part, RadioIn) for part in parts)
    if grid.trees is not None and not any(usable) and not linked:
        told.append(f"Not looked at: the canopy, since {BECAUSE}; trees hide nothing.")
    heard = [antenna for part, used in zip(parts, usable, strict=True) if used for antenna in _antennas(part)]
    # of anchors that are placed and of links the radio is a part of its own
    radios = [*(one.radio for one in heard), *(part for part in parts if isinstance(part, RadioIn))]
    told += notes_on_satellite_radios(heard)
    return [*told, *_beyond_the_model(grid, [radio.radio().frequency_hz for radio in radios if radio is not None])]


def _beyond_the_model(grid: ElevationGrid, frequencies_hz: Sequence[float]) -> list[str]:
    """What the canopy's model says of its own range at frequencies: nothing is extended beyond it."""
    foliage = foliage_of(grid)
    if foliage is None or foliage.model == "density":
        return []
    notes = [foliage.loss([1.0], one, [1.0]).notes for one in dict.fromkeys(frequencies_hz)]
    return list(dict.fromkeys(note for some in notes for note in some))


def notes_on_satellite_radios(antennas: Iterable[AntennaIn]) -> list[str]:
    """A sentence on the anchors near the ground whose radio is that of a satellite, at a power that none may send."""
    low = [
        antenna.id
        for antenna in antennas
        if antenna.radio is not None
        and antenna.radio.preset == SATELLITE
        and antenna.radio.transmit_power_dbm is None
        and (getattr(antenna, "altitude_m", None) or 0.0) < LOWEST_SATELLITE_M
    ]
    if not low:
        return []
    return [
        f"Radio of {_named(low)}: {SATELLITE} is the budget of a satellite 20,000 km away, 390 W that nothing near the "
        "ground sends, so its margins mean nothing there; take another radio, or give transmit_power_dbm."
    ]


def notes_on_ranging_anchors(anchors: Sequence[AntennaIn], range_sigma_m: float, *, over_map: bool) -> list[str]:
    """Sentences on what a detector does not look at of anchors that were described as maps take them.

    range_sigma_m: of its settings. over_map: whether it looks at a DEM, over which radios count.
    """
    limited = [one.id for one in anchors if one.antenna_limits() != ALL_ROUND]
    radios = [] if over_map else [one.id for one in anchors if one.radio is not None]
    # files of our own name the default of every anchor; only another number was somebody's choice
    chosen = (range_sigma_m, AntennaIn.model_fields["ranging_sigma_m"].default)
    sigmas = [one.id for one in anchors if one.ranging_sigma_m not in chosen]
    covariances = [one.id for one in anchors if one.pose_covariance_m2 is not None]
    # quoted: a command line says its option in place of a field's bare name
    found = (
        ("the antenna limits", limited, "every range that comes is judged"),
        ("the radio", radios, "there is no --dem"),
        (
            "'ranging_sigma_m'",
            sigmas,
            f"ranges without a sigma of their own have {range_sigma_m:g} m, the settings'",
        ),
        ("'pose_covariance_m2'", covariances, "a detector takes 'pose_sigma_m' alone"),
    )
    return [f"Not looked at: {what} of {_named(ids)}, since {why}." for what, ids, why in found if ids]


def _named(ids: list[str]) -> str:
    more = f" and {len(ids) - NAMED} more" if len(ids) > NAMED else ""
    return f"{', '.join(ids[:NAMED])}{more}"


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
