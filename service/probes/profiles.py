"""Profiles: the ground under straight lines, the Fresnel zone round them, and where they are blocked."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from service.parts.cover import notes_on_cover
from service.parts.map_facts import curvature_of
from service.parts.shapes_in_grid import points_in_grid
from service.products.lines_of_sight.calculate import WORDS, BlockingPoint, refuse_lines_outside
from terrain import ElevationGrid, height_at
from visibility import HIDDEN, Curvature, lines_of_sight, profile
from visibility.sight import GroundProfile, LinesOfSight, fresnel_radius_m
from visibility.signal import foliage_of, signals

from .places import number
from .request import ProfileOut, ProfilesIn, ProfilesOut
from .signals import signal_told

__all__ = ["profiles"]

Floats = npt.NDArray[np.float64]
MILLIMETRES = 3
TINY_M = 1e-9


def profiles(grid: ElevationGrid, asked: ProfilesIn) -> ProfilesOut:
    """Answer about every line. Raises AreaError, FrameError, VisibilityInputError."""
    from_m = points_in_grid(grid, [pair.from_ for pair in asked.pairs], "pairs[{}].from")
    to_m = points_in_grid(grid, [pair.to for pair in asked.pairs], "pairs[{}].to")
    refuse_lines_outside(grid, asked.area, from_m, to_m)
    curvature = curvature_of(asked) or Curvature.of(grid)
    radio = None if asked.radio is None else asked.radio.radio()
    wavelength_m = radio.wavelength_m if asked.wavelength_m is None and radio is not None else asked.wavelength_m
    lines = lines_of_sight(grid, from_m, to_m, curvature=curvature, unknown=asked.unknown, wavelength_m=wavelength_m)
    heard = None if radio is None else signals(grid, from_m, to_m, radio, curvature=curvature, unknown=asked.unknown)
    found = []
    for line, (start, end) in enumerate(zip(from_m, to_m, strict=True)):
        ground = profile(grid, start, end, curvature=curvature)
        kept = _thinned(ground, asked.max_places)
        places_m = _places(start, end, ground.distance_m[kept])
        told = _profile(ground, kept, lines, line, math.dist(start[:2], end[:2]), wavelength_m)
        update = {**_crowns(grid, places_m, ground.ground_m[kept]), "signal": signal_told(heard, line)}
        update["roof_m"] = _column(ground.roof_m[kept]) if grid.standing is not None else None
        found.append(told.model_copy(update=update))
    warnings = [*notes_on_cover(grid), *lines.warnings, *(() if heard is None else heard.warnings)]
    return ProfilesOut.model_construct(profiles=found, curvature=curvature.sentence(), warnings=warnings)


def _places(start_m: Floats, end_m: Floats, distance_m: Floats) -> Floats:
    """(m, 2) east and north at distances along a line, metres."""
    step_m = end_m[:2] - start_m[:2]
    places_m: Floats = start_m[:2] + distance_m[:, None] * step_m / max(math.hypot(*step_m), TINY_M)
    return places_m


def _crowns(grid: ElevationGrid, places_m: Floats, ground_m: Floats) -> dict[str, object]:
    """Columns of the canopy at places (m, 2)."""
    east_m, north_m = places_m.T
    base_m = top_m = None
    foliage = foliage_of(grid)
    if foliage is not None:
        canopy = foliage.canopy
        over = [
            np.atleast_1d(height_at(replace(canopy.grid, heights_m=layer, standing=None), east_m, north_m))
            for layer in (canopy.base_m, canopy.top_m)
        ]
        base_m, top_m = (_column(np.where(over[1] > 0.0, ground_m + height_m, np.nan)) for height_m in over)
    return {"canopy_base_m": base_m, "canopy_top_m": top_m}


def _profile(
    ground: GroundProfile,
    kept: npt.NDArray[np.intp],
    lines: LinesOfSight,
    line: int,
    reach_m: float,
    wavelength_m: float | None,
) -> ProfileOut:
    """One line at the places kept of it; reach_m: the horizontal distance between its ends."""
    distance_m = ground.distance_m[kept]
    blocked = int(lines.verdict[line]) == HIDDEN and bool(np.isfinite(lines.blocking_point_m[line]).all())
    radius_m = None
    if wavelength_m is not None and len(distance_m):
        share = np.clip(distance_m / max(reach_m, TINY_M), 0.0, 1.0)
        along_m = max(float(lines.distance_m[line]), TINY_M)
        radius_m = fresnel_radius_m(wavelength_m, share * along_m, (1.0 - share) * along_m)
    east_m, north_m, altitude_m = lines.blocking_point_m[line].tolist()
    return ProfileOut.model_construct(
        verdict=WORDS[int(lines.verdict[line])],
        clearance_m=number(lines.clearance_m[line]),
        distance_m=np.round(distance_m, MILLIMETRES).tolist(),
        ground_m=_column(ground.ground_m[kept]),
        line_m=np.round(ground.line_m[kept], MILLIMETRES).tolist(),
        fresnel_radius_m=None if radius_m is None else np.round(radius_m, MILLIMETRES).tolist(),
        fresnel_clearance=None if lines.fresnel_clearance is None else number(lines.fresnel_clearance[line]),
        blocking_point=BlockingPoint.model_construct(east_m=east_m, north_m=north_m, altitude_m=altitude_m)
        if blocked
        else None,
        blocking_distance_m=float(lines.blocking_distance_m[line]) if blocked else None,
    )


def _thinned(ground: GroundProfile, most: int) -> npt.NDArray[np.intp]:
    """Which places stay: both ends, and of each stretch between the one of least clearance, unknown ones first."""
    places = len(ground.distance_m)
    if places <= most:
        return np.arange(places)
    edges = np.linspace(1, places - 1, most - 1).astype(np.intp)
    clearance_m = np.fmin(ground.clearance_m, ground.line_m - ground.roof_m)
    clearance_m = np.where(np.isnan(ground.clearance_m), -np.inf, clearance_m)
    inner = [start + int(np.argmin(clearance_m[start:end])) for start, end in pairwise(edges.tolist())]
    return np.array([0, *inner, places - 1], np.intp)


def _column(values: Floats) -> list[float | None]:
    rounded = np.round(values, MILLIMETRES)
    return [None if np.isnan(value) else value for value in rounded.tolist()]
