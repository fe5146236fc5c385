"""What a file's numbers are as heights: in which unit, above what, and whether they count from a body's centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyproj

from .crs.frames import body_of
from .crs.parts import vertical_part
from .errors import DemUnsupportedError
from .files.raw import RawDem
from .units import HEIGHT_UNITS, HeightUnit, counts_down, height_unit_of

__all__ = ["Heights", "heights_of"]

# heights so close to the radius of the body, as a share of it, are distances from its centre
LIKE_THE_RADIUS = 0.05
SAMPLE_POSTS = 10_000


@dataclass(frozen=True, slots=True)
class Heights:
    """Height in metres = value · factor + offset_m, above ``vertical_datum``; what there is to tell about it."""

    factor: float
    offset_m: float
    unit_known: bool
    vertical_datum: str | None
    conversions: tuple[str, ...]
    warnings: tuple[str, ...]


def heights_of(name: str, raw: RawDem, *, unit: str | None, given: pyproj.CRS | None) -> Heights:
    """How a file's numbers become heights.

    unit: the caller's, which goes before all; given: the caller's CRS, whose heights go before the file's.
    Raises DemUnsupportedError.
    """
    conversions, warnings = list[str](), list[str]()
    given_datum, given_unit = (None, None) if given is None else vertical_part(given)
    taken, above = _unit(raw, unit, given_unit, warnings)
    datum = given_datum or raw.vertical_datum or _datum_words(above)
    if given_datum is not None and raw.vertical_datum not in (None, given_datum):
        warnings.append(f"The file says that heights are {raw.vertical_datum}; {given_datum} of crs= was taken.")
    metres = 1.0 if taken is None else taken.metres
    if raw.scale != 1.0 or raw.offset != 0.0:
        conversions.append(f"Heights are the file's values × {raw.scale:.10g} + {raw.offset:.10g}, as the file says.")
    if taken is not None and taken.metres != 1.0:
        conversions.append(f"Heights converted from {taken.name} to metres (× {taken.metres:.10g}).")
    sign = 1.0
    if _counts_down(raw, given_unit, warnings):
        sign = -1.0
        conversions.append("The file's numbers count downward (depths); heights are these with the sign turned.")
    factor, offset_m = sign * raw.scale * metres, sign * raw.offset * metres + 0.0  # which makes 0 of -0
    radius_m = _radius_in(name, raw, raw.crs if given is None else given, factor, offset_m)
    if radius_m:
        warnings.append(
            f"Heights are distances from the centre of the body; its radius of {radius_m:,.10g} m was taken off."
        )
        datum = datum or f"sphere of radius {radius_m:,.10g} m"
    return Heights(factor, offset_m - radius_m, taken is not None, datum, tuple(conversions), tuple(warnings))


def _unit(
    raw: RawDem, asked: str | None, of_given: HeightUnit | None, warnings: list[str]
) -> tuple[HeightUnit | None, str | None]:
    """(the unit taken, what the words of the file's unit say that heights are above)."""
    if asked is not None or of_given is not None:
        taken = of_given if asked is None else HeightUnit(asked, HEIGHT_UNITS[asked])
        where = f"height_unit={asked}" if asked is not None else "that of crs="
        said: HeightUnit | str | None = raw.crs_height_unit
        if raw.height_unit is not None:
            try:
                said = height_unit_of(raw.height_unit)
            except DemUnsupportedError:  # which is why the caller gives it
                said = raw.height_unit
        if said is not None and (isinstance(said, str) or taken is None or said.metres != taken.metres):
            told = said if isinstance(said, str) else said.name
            warnings.append(f"The file says that heights are in {told[:40]}; {where} was taken.")
        return taken, said.above if isinstance(said, HeightUnit) else None
    of_band = height_unit_of(raw.height_unit)
    if of_band is None:
        return raw.crs_height_unit, None
    if raw.crs_height_unit is not None and raw.crs_height_unit.metres != of_band.metres:
        warnings.append(
            f"The file's band says that heights are in {of_band.name}, its CRS in {raw.crs_height_unit.name}: "
            f"{of_band.name} was taken. Give height_unit= if that is wrong."
        )
    return of_band, of_band.above


def _counts_down(raw: RawDem, of_given: HeightUnit | None, warnings: list[str]) -> bool:
    """Whether the file's numbers are depths, by the caller's CRS, else the words of the band's unit, else its CRS."""
    units = (of_given, raw.crs_height_unit)
    of_crss = [None if unit is None else unit.down for unit in units]
    said = [down for down in (of_crss[0], counts_down(raw.height_unit), of_crss[1]) if down is not None]
    if len(set(said)) > 1:
        taken = "downward, as depths do," if said[0] else "upward"
        warnings.append(
            f"CRS and unit do not agree on whether heights count up or down: {taken} was taken. Give crs= with the "
            "right vertical part if that is wrong."
        )
    return said[0] if said else False


def _datum_words(above: str | None) -> str | None:
    """A vertical datum as the words of a unit give it, an ellipsoid named first as in those that a CRS gives."""
    if above is not None and "ellips" in above.lower():
        return f"ellipsoid ({above})"
    return above


def _radius_in(name: str, raw: RawDem, crs: pyproj.CRS | None, factor: float, offset_m: float) -> float:
    """The radius of the body where heights count from its centre, else 0. Raises DemUnsupportedError for a spheroid."""
    if crs is None or crs.ellipsoid is None:
        return 0.0
    radius_m = crs.ellipsoid.semi_major_metre
    step = max(1, int((raw.values.size / SAMPLE_POSTS) ** 0.5))
    sample = raw.values[::step, ::step]
    known = np.isfinite(sample)
    if raw.declared_void is not None:
        known &= ~raw.declared_void[::step, ::step]
    with np.errstate(over="ignore", invalid="ignore"):
        like = np.abs(sample * np.float64(factor) + offset_m - radius_m) < LIKE_THE_RADIUS * radius_m
    if 2 * np.count_nonzero(like & known) <= np.count_nonzero(known):
        return 0.0
    if crs.ellipsoid.semi_minor_metre != radius_m:
        raise DemUnsupportedError(
            f"{name} holds distances from the centre of {body_of(crs).name}, which is no sphere; take off its "
            "ellipsoid first, so that heights are above that."
        )
    return float(radius_m)
