"""A canopy's density out of what was heard through it: one number, or a map by azimuth and elevation, with errors."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, SkyDepths
from visibility.cover.canopy import Canopy, canopy_paths
from visibility.cover.vegetation import DB_PER_DEPTH, density_loss, fit_density
from visibility.errors import CoverError
from visibility.sight.anchors import Anchor
from visibility.sight.curvature import Curvature
from visibility.sight.sight_points import check_points
from visibility.signal.links import signals

__all__ = ["CanopyFit", "FittedSky", "HeardThrough", "fit_canopy", "heard_from", "ways_upwards"]

Reals = npt.NDArray[np.float64]

LEAST_IN_CELL = 20  # losses without which a direction has the density of all
CLEAR_M = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class HeardThrough:
    """n losses through a canopy: loss_db on top of free space and diffraction; way_m through trees; the direction in
    which each way leads up, azimuth_rad clockwise from grid north and elevation_rad; all (n,), NaN = not known."""

    loss_db: Reals
    way_m: Reals
    azimuth_rad: Reals
    elevation_rad: Reals


@dataclass(frozen=True, slots=True, eq=False)
class FittedSky:
    """depths by direction; sigma_per_m, count: (rings, sectors) of each, NaN where the density of all stands in.

    rms_db, held_out_rms_db: as in ``CanopyFit``.
    """

    depths: SkyDepths
    sigma_per_m: Reals
    count: npt.NDArray[np.int64]
    rms_db: float
    held_out_rms_db: float


@dataclass(frozen=True, slots=True, eq=False)
class CanopyFit:
    """The answer to ``fit_canopy``.

    depth_per_m: optical depth per metre of way; sigma_per_m: its error, from how much groups of losses differ.
    rms_db: of what is left of the losses; held_out_rms_db: of each half, in the order of the log, with the density that
    was fitted to the other. count, groups: of losses used, and what they came from. sky: where it was asked for.
    """

    depth_per_m: float
    sigma_per_m: float
    rms_db: float
    held_out_rms_db: float
    count: int
    groups: int
    sky: FittedSky | None
    notes: tuple[str, ...]


def heard_from(
    grid: ElevationGrid, canopy: Canopy, anchor: Anchor, points_m: npt.ArrayLike, power_dbm: npt.ArrayLike
) -> HeardThrough:
    """What powers (n,) that arrived at points (n, 3) from an anchor with a radio tell of a canopy over the grid.

    The loss is what the radio's budget promises without trees, less the power. Raises CoverError, SignalError,
    VisibilityInputError.
    """
    if anchor.radio is None:
        raise CoverError(f"What anchor {anchor.id} sends is not known without a radio.")
    at_m = check_points(grid, "points_m", points_m)
    from_m = np.broadcast_to((anchor.east_m, anchor.north_m, anchor.altitude_m), at_m.shape)
    bare = signals(replace(grid, trees=None), from_m, at_m, anchor.radio)
    up_m = np.where((at_m - from_m)[:, 2:] < 0.0, from_m - at_m, at_m - from_m)
    return HeardThrough(
        np.where(np.isfinite(bare.received_dbm), bare.received_dbm, np.nan) - np.asarray(power_dbm, np.float64),
        canopy_paths(canopy, at_m, from_m),
        np.arctan2(up_m[:, 0], up_m[:, 1]),
        np.arctan2(up_m[:, 2], np.hypot(up_m[:, 0], up_m[:, 1])),
    )


def ways_upwards(
    canopy: Canopy, points_m: npt.ArrayLike, azimuth_rad: npt.ArrayLike, elevation_rad: npt.ArrayLike
) -> Reals:
    """(n,) metres that ways from points (n, 3) up to the sky run through a canopy; NaN where they do not lead up.

    Raises VisibilityInputError.
    """
    grid = canopy.grid
    at_m = check_points(grid, "points_m", points_m)
    azimuth, elevation = np.asarray(azimuth_rad, np.float64), np.asarray(elevation_rad, np.float64)
    known = np.isfinite(azimuth) & (elevation > 0.0)
    top_m = float(np.nanmax(grid.heights_m + canopy.top_m))
    rise_m = np.maximum(top_m - at_m[:, 2], 0.0) + 1.0
    west_m, south_m, east_m, north_m = grid.bounds_m
    # no further than where the grid ends, beyond which there are no trees
    across_m = math.hypot(east_m - west_m, north_m - south_m) + 1.0
    tan = np.tan(np.where(known, np.minimum(elevation, math.pi / 2.0 - 1e-9), 1.0))
    flat_m = np.minimum(rise_m / tan, across_m)
    towards = np.stack([np.sin(azimuth), np.cos(azimuth), tan], axis=1)
    end_m = at_m + flat_m[:, None] * np.where(known[:, None], towards, 0.0)
    return np.where(known, canopy_paths(canopy, at_m, end_m, Curvature.over(grid, None)), np.nan)


def fit_canopy(
    heard: HeardThrough,
    groups: npt.ArrayLike | None = None,
    *,
    rings_rad: Sequence[float] = (),
    sectors: int = 0,
) -> CanopyFit:
    """The density of a canopy that explains what was heard through it best; ways clear of trees tell nothing of it.

    groups: (n,) what each loss came from, a satellite or an anchor: losses of one err alike, which widens the error.
    Order of the losses: that of the log. rings_rad, sectors: ask for a map by direction as well, of rings between these
    elevations and so many sectors; a cell with fewer than 20 losses has the density of all. Raises CoverError.
    """
    if bool(rings_rad) != bool(sectors) or sectors < 0:
        raise CoverError("A map by direction needs both rings and sectors.")
    loss_db, way_m = heard.loss_db, heard.way_m
    used = np.isfinite(loss_db) & (way_m > CLEAR_M)
    names = np.arange(len(loss_db)) if groups is None else np.unique(np.asarray(groups), return_inverse=True)[1]
    loss_db, way_m, group = loss_db[used], way_m[used], names[used]
    fit = fit_density(loss_db, way_m)
    notes = []
    left = len(used) - int(used.sum())
    if left:
        notes.append(f"{left} of {len(used)} losses are not known, or of ways clear of trees, and were left out.")
    first = np.arange(len(loss_db)) < len(loss_db) // 2
    sky = None
    if sectors:
        edges = _edges(rings_rad)
        if not np.isfinite(heard.azimuth_rad[used]).all():
            raise CoverError("A map by direction needs the azimuth of every loss.")
        cell = _cells(heard.azimuth_rad[used], heard.elevation_rad[used], edges, sectors)
        sky = _sky((loss_db, way_m, group), cell, edges, sectors, first)
        few = int((sky.count < LEAST_IN_CELL).sum())
        if few:
            cells = f"{few} of {sky.count.size} cells of the map by direction"
            notes.append(f"{cells} have fewer than {LEAST_IN_CELL} losses, and the density of all.")
    return CanopyFit(
        depth_per_m=fit.depth_per_m,
        sigma_per_m=_sigma(loss_db, way_m, fit.depth_per_m, group),
        rms_db=fit.rms_db,
        held_out_rms_db=_held_out(loss_db, way_m, first),
        count=fit.count,
        groups=len(np.unique(group)),
        sky=sky,
        notes=tuple(notes),
    )


def _sigma(loss_db: Reals, way_m: Reals, depth_per_m: float, group: npt.NDArray[np.integer]) -> float:
    """One sigma of a density whose losses err alike within a group (Liang and Zeger, 1986); NaN of one group."""
    left_db = loss_db - density_loss(way_m, depth_per_m)
    score = np.bincount(group, weights=left_db * way_m)[np.unique(group)]
    if len(score) < 2:
        return math.nan
    spread = math.sqrt(len(score) / (len(score) - 1) * float((score**2).sum()))
    return spread / float((way_m**2).sum()) / DB_PER_DEPTH


def _held_out(loss_db: Reals, way_m: Reals, first: npt.NDArray[np.bool_]) -> float:
    if min(int(first.sum()), int((~first).sum())) < 2:
        return math.nan
    depth = np.where(first, *(fit_density(loss_db[half], way_m[half]).depth_per_m for half in (~first, first)))
    return _rms(loss_db - DB_PER_DEPTH * depth * way_m)


def _sky(
    losses: tuple[Reals, Reals, npt.NDArray[np.integer]],
    cell: npt.NDArray[np.intp],
    edges: tuple[float, ...],
    sectors: int,
    first: npt.NDArray[np.bool_],
) -> FittedSky:
    loss_db, way_m, group = losses
    cells = (len(edges) - 1) * sectors
    depth = _by_cell(loss_db, way_m, cell, cells)
    sigma = np.full(cells, np.nan)
    for number in np.flatnonzero(np.bincount(cell, minlength=cells) >= LEAST_IN_CELL):
        here = cell == number
        sigma[number] = _sigma(loss_db[here], way_m[here], float(depth[number]), group[here])
    held_out_db = math.nan
    if min(int(first.sum()), int((~first).sum())) >= 2:
        others = [_by_cell(loss_db[half], way_m[half], cell[half], cells) for half in (~first, first)]
        held_out_db = _rms(loss_db - DB_PER_DEPTH * np.where(first, others[0][cell], others[1][cell]) * way_m)
    rows = tuple(tuple(row) for row in depth.reshape(-1, sectors).tolist())
    return FittedSky(
        SkyDepths(edges, rows),
        sigma.reshape(-1, sectors),
        np.bincount(cell, minlength=cells).reshape(-1, sectors),
        _rms(loss_db - DB_PER_DEPTH * depth[cell] * way_m),
        held_out_db,
    )


def _by_cell(loss_db: Reals, way_m: Reals, cell: npt.NDArray[np.intp], cells: int) -> Reals:
    """(cells,) densities; of all where a cell has too few losses."""
    depth = np.full(cells, fit_density(loss_db, way_m).depth_per_m)
    for number in np.flatnonzero(np.bincount(cell, minlength=cells) >= LEAST_IN_CELL):
        here = cell == number
        depth[number] = fit_density(loss_db[here], way_m[here]).depth_per_m
    return depth


def _edges(rings_rad: Sequence[float]) -> tuple[float, ...]:
    edges = tuple(float(edge) for edge in rings_rad)
    if len(edges) < 2 or any(low >= high for low, high in itertools.pairwise(edges)):
        raise CoverError("Rings need two ascending elevations or more.")
    return edges


def _cells(azimuth_rad: Reals, elevation_rad: Reals, edges: tuple[float, ...], sectors: int) -> npt.NDArray[np.intp]:
    """(n,) number of the cell of each direction: rings one after the other."""
    numbers = np.arange((len(edges) - 1) * sectors, dtype=np.float64).reshape(-1, sectors)
    found = SkyDepths(edges, tuple(tuple(row) for row in numbers.tolist())).at(azimuth_rad, elevation_rad)
    cells: npt.NDArray[np.intp] = found.astype(np.intp)
    return cells


def _rms(values: Reals) -> float:
    return float(np.sqrt((values**2).mean())) if len(values) else math.nan
