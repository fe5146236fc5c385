"""De Vivo et al., IV-C, made up: round a building between buildings, position fixes, the linear filter of Table III.

The ground is a DSM that holds the buildings, the satellites are of a real almanac; the fixes are those of a receiver
that solves for place and clock from the pseudoranges of the satellites in sight of its true place. The vehicle measures
its own accelerations, as section III has it, and follows a planned way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

import numpy as np
import numpy.typing as npt
from pyproj import CRS

import navigation
from benchmarks.visibility.paper_case import mountain_almanac
from terrain import ElevationGrid, height_at
from visibility import DistantAnchor, MinimumVisibleAltitude, min_visible_altitude, satellites, visible_sets
from visibility.sight import reflections

__all__ = ["SETTLED", "Canyon", "Drives", "Noise", "canyon", "drive", "geometry", "within"]

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
# how the filter is told of a fix's error: from the geometry of the satellites, or by its dilution alone (eq. 26)
Noise = Literal["geometry", "dilution"]

# Turin, a block of 60 m, streets of 20 m, 30 m high as in the paper, buildings on two sides of it
WEST_M, NORTH_M, CELL_M, POSTS = 396_000.0, 4_991_000.0, 2.0, 141
BLOCK_M, STREET_M, HIGH_M, DEEP_M = 60.0, 20.0, 30.0, 40.0
NOON = datetime(2007, 12, 1, 12, tzinfo=UTC)
SPEED_M_PER_S, ROUNDS, ANTENNA_M = 1.5, 2, 1.5
PSEUDORANGE_SIGMA_M = 3.0
# a receiver hands out no fix beyond this PDOP; 25 is what common ones are set to
MOST_PDOP = 25.0
# an accelerometer's noise of 0.1 m/s in a second; it tells the filter how the vehicle turns, u of Table III
MOTION = navigation.MotionNoise(0.01, 0.01, 0.001)
# the first fixes show how a filter was started
SETTLED = 10
# farther away than the streets are wide a wall scatters too weakly
REFLECTION_REACH_M = 60.0


@dataclass(frozen=True, eq=False)
class Canyon:
    """n epochs of a drive, one a second, and k satellites that stand still meanwhile.

    points_m: (n, 3) the truth. in_sight: (n, k). excess_m: (n, k) how late a reflection comes, NaN: none.
    """

    surfaces: MinimumVisibleAltitude
    points_m: Array
    anchors_m: Array
    in_sight: Flags
    excess_m: Array

    @property
    def grid(self) -> ElevationGrid:
        return self.surfaces.grid


@dataclass(frozen=True, eq=False)
class Drives:
    """s drives of n epochs: error_m (s, n, 3) estimate less truth, covariance_m2 (s, n, 3, 3); has_fix (s, n)."""

    error_m: Array
    covariance_m2: Array
    has_fix: Flags

    @property
    def distance_m(self) -> Array:
        return np.asarray(np.linalg.norm(self.error_m, axis=-1))


def canyon() -> Canyon:
    """The streets, the way round the block, and who is in sight of it."""
    grid = _streets()
    points_m = _round_the_block(grid)
    eyes = satellites.satellite_eyes(grid, mountain_almanac(), [NOON])
    surfaces = min_visible_altitude(grid, eyes.distant_anchors(0), "exact", unknown="open")
    sky = [anchor for anchor in surfaces.anchors if isinstance(anchor, DistantAnchor)]
    seen = visible_sets(surfaces, points_m).visible()
    late = reflections(surfaces, points_m, ~seen, reach_m=REFLECTION_REACH_M)
    return Canyon(surfaces, points_m, np.array([anchor.position_m(grid) for anchor in sky]), seen, late.excess_m)


def drive(case: Canyon, noise: Noise, count: int, seed: int, *, reflect: bool = False) -> Drives:
    """``count`` drives, each with its own errors; reflect: whether the receiver takes reflections in as well."""
    generator = np.random.default_rng(seed)
    epochs, (_, many) = len(case.points_m), case.in_sight.shape
    stated = _stated(case, noise)
    states = [navigation.initial_state(0.0, case.points_m[0], position_sigma_m=10.0)] * count
    states = [_moved(state, _true_state(case, 0), generator) for state in states]
    drives = Drives(np.zeros((count, epochs, 3)), np.zeros((count, epochs, 3, 3)), np.zeros((count, epochs), bool))
    for epoch in range(epochs):
        heard = case.in_sight[epoch] | (np.isfinite(case.excess_m[epoch]) & reflect)
        error_m = generator.normal(0.0, PSEUDORANGE_SIGMA_M, (count, many))
        error_m += np.where(case.in_sight[epoch], 0.0, np.nan_to_num(case.excess_m[epoch]))
        fixes_m = _fix_errors(case, epoch, heard, error_m)
        if epoch:
            turns = _measured_turns(case, epoch, count, generator)
            states = [_predicted(state, epoch, turn) for state, turn in zip(states, turns, strict=True)]
        covariances_m2 = np.einsum("sn,nij->sij", _believed_weights(case, states), stated)
        for number in range(count):
            if fixes_m is not None:
                fix_m = case.points_m[epoch] + fixes_m[number]
                states[number] = navigation.update_fix(states[number], fix_m, covariances_m2[number]).state
                drives.has_fix[number, epoch] = True
            drives.error_m[number, epoch] = states[number].position_m - case.points_m[epoch]
            drives.covariance_m2[number, epoch] = states[number].covariance[:6:2, :6:2]
    return drives


def geometry(points_m: Array, anchors_m: Array, visible: Flags) -> Array:
    """(n, 3, 3) covariance of a fix per square metre of the pseudoranges' (eq. 16); NaN where there is no fix."""
    lines = points_m[:, None, :] - anchors_m
    lines /= np.linalg.norm(lines, axis=2, keepdims=True)
    rows = np.concatenate([lines, np.ones((*visible.shape, 1))], axis=2) * visible[..., None]
    normal = np.swapaxes(rows, 1, 2) @ rows
    solvable = (visible.sum(axis=1) >= 4) & (np.linalg.cond(normal) < 1e9)
    found = np.full((len(points_m), 3, 3), np.nan)
    found[solvable] = np.linalg.inv(normal[solvable])[:, :3, :3]
    found[np.trace(found, axis1=1, axis2=2) > MOST_PDOP**2] = np.nan
    return found


def _streets() -> ElevationGrid:
    """A block in the middle, a street all round, and beyond it buildings in the north and in the east."""
    away_m = (np.arange(POSTS) - POSTS // 2) * CELL_M
    east_m, north_m = np.meshgrid(away_m, -away_m)
    block, across = BLOCK_M / 2.0, BLOCK_M / 2.0 + STREET_M
    beyond = across + DEEP_M
    heights_m = np.zeros((POSTS, POSTS), np.float32)
    heights_m[(np.abs(east_m) <= block) & (np.abs(north_m) <= block)] = HIGH_M
    heights_m[(north_m >= across) & (north_m <= beyond) & (np.abs(east_m) <= beyond)] = HIGH_M
    heights_m[(east_m >= across) & (east_m <= beyond) & (np.abs(north_m) <= beyond)] = HIGH_M
    return ElevationGrid(heights_m, CELL_M, CELL_M, WEST_M, NORTH_M, CRS.from_epsg(32632))


def _round_the_block(grid: ElevationGrid) -> Array:
    half_m = (BLOCK_M + STREET_M) / 2.0
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * half_m
    around_m = 8.0 * half_m
    way_m = np.arange(0.0, ROUNDS * around_m, SPEED_M_PER_S) % around_m
    middle = grid.origin_east_m + POSTS // 2 * CELL_M, grid.origin_north_m - POSTS // 2 * CELL_M
    at = [np.interp(way_m, np.arange(5) * 2.0 * half_m, corners[:, axis]) + middle[axis] for axis in range(2)]
    return np.column_stack([*at, height_at(grid, *at) + ANTENNA_M])


def _true_state(case: Canyon, epoch: int) -> Array:
    """(6,) place and velocity, that of the second before."""
    state = np.zeros(6)
    state[0::2] = case.points_m[epoch]
    if epoch:
        state[1::2] = case.points_m[epoch] - case.points_m[epoch - 1]
    return state


def _moved(state: navigation.FilterState, truth: Array, generator: np.random.Generator) -> navigation.FilterState:
    """A belief that is off by as much as it says."""
    off = generator.normal(size=truth.size) * np.sqrt(np.diag(state.covariance))
    return navigation.FilterState(state.time_s, truth + off, state.covariance)


def _measured_turns(case: Canyon, epoch: int, count: int, generator: np.random.Generator) -> Array:
    """(s, 6) u of Table III: what the state changes by beyond a constant velocity, as accelerometers tell."""
    rest = navigation.FilterState(0.0, _true_state(case, epoch - 1), np.zeros((6, 6)))
    later = navigation.predict(rest, 1.0, MOTION)
    errors: Array = generator.multivariate_normal(np.zeros(6), later.covariance, count)
    return _true_state(case, epoch) - later.mean + errors


def _predicted(state: navigation.FilterState, epoch: int, turn: Array) -> navigation.FilterState:
    later = navigation.predict(state, float(epoch), MOTION)
    return navigation.FilterState(later.time_s, later.mean + turn, later.covariance)


def _stated(case: Canyon, noise: Noise) -> Array:
    """(n, 3, 3) R of a fix at each place of the planned way, from who is predicted in sight there.

    Where no fix is predicted, one that comes all the same counts as the worst that is. µ: the variances of a fix's axes
    at the median PDOP of the way (eq. 26).
    """
    found = geometry(case.points_m, case.anchors_m, case.in_sight)
    pdop = np.sqrt(np.trace(found, axis1=1, axis2=2))
    found[np.isnan(pdop)] = found[np.nanargmax(pdop)]
    if noise == "geometry":
        return PSEUDORANGE_SIGMA_M**2 * found
    usual = float(np.nanmedian(pdop))
    mu_m2 = PSEUDORANGE_SIGMA_M**2 * np.median(np.diagonal(found, axis1=1, axis2=2)[np.isfinite(pdop)], axis=0)
    stated: Array = (np.where(np.isfinite(pdop), pdop, np.nanmax(pdop)) / usual)[:, None, None] * np.diag(mu_m2)
    return stated


def _believed_weights(case: Canyon, states: list[navigation.FilterState]) -> Array:
    """(s, n) how likely the vehicle is at each place of the planned way, by its belief: where the map is asked."""
    mean_m = np.array([state.position_m[:2] for state in states])
    inverse = np.linalg.inv(np.array([state.covariance[:3:2, :3:2] for state in states]))
    away_m = case.points_m[None, :, :2] - mean_m[:, None]
    squares = np.einsum("sni,sij,snj->sn", away_m, inverse, away_m)
    likely = np.exp(-0.5 * (squares - squares.min(axis=1, keepdims=True)))
    weights: Array = likely / likely.sum(axis=1, keepdims=True)
    return weights


def _fix_errors(case: Canyon, epoch: int, heard: Flags, error_m: Array) -> Array | None:
    """(s, 3) how far the receiver's least-squares fixes are off, to first order; None where it has none."""
    if np.isnan(geometry(case.points_m[[epoch]], case.anchors_m, heard[None]))[0, 0, 0]:
        return None
    lines = case.points_m[epoch] - case.anchors_m[heard]
    rows = np.column_stack([lines / np.linalg.norm(lines, axis=1, keepdims=True), np.ones(len(lines))])
    solved: Array = np.linalg.lstsq(rows, error_m[:, heard].T, rcond=None)[0][:3].T
    return solved


def within(sigmas: float) -> float:
    """The probability that ±sigmas of one axis stand for: 68.3 % for 1, 95.4 % for 2."""
    return math.erf(sigmas / math.sqrt(2.0))
