"""Who should be in sight from a place that is only roughly known, over ground that is only roughly known.

The place is drawn as a few points that stand for its Gaussian, each with the rover on the ground there; of each point's
sight lines the clearance is known exactly, and the error of the ground is folded in analytically.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from detection import GroundHeight, RangingAnchor
from planning.errors import WatchError
from planning.kernels.forecasts import DIRECT, IN_SIGHT, line_odds
from terrain import ElevationGrid, height_at
from visibility import Anchor, AnchorError, Curvature
from visibility.sight import SightDoubt, check_anchors, weighed_sight
from visibility.sight.sight_lines import least_clearances
from visibility.sight.sight_points import check_points
from visibility.signal import Radio

from .arrivals import arrivals

__all__ = [
    "GroundErrors",
    "SightForecast",
    "check_antenna",
    "forecast_sight",
    "ground_amid",
    "mixed_with_doubts",
    "sight_probability",
    "strange_anchors",
    "warnings_over",
]

Floats = npt.NDArray[np.float64]

POINTS = 19
# A place that is less sure than so many cells in every direction says nothing about the ground it stands on.
FURTHEST_CELLS = 50.0
FURTHEST_M = 5e5  # anchors that fly further from the map than this are left out
NEAREST_M = 1e-3  # and no place is surer than that


def _unit_points(pairs: int) -> Floats:
    """(1 + 2·pairs, 2) equally likely points of a standard Gaussian in the plane: 0 first, mean 0, covariance 1."""
    number = np.arange(pairs)
    radius = np.sqrt(-2.0 * np.log(1.0 - (number + 1.0) / (pairs + 0.5)))
    turn = number * math.pi * (math.sqrt(5.0) - 1.0) / 2.0  # golden shares of half a turn; the other half are opposites
    half = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    points = np.vstack([np.zeros((1, 2)), half, -half])
    whiten: Floats = np.linalg.inv(np.linalg.cholesky(points.T @ points / len(points)))
    return points @ whiten.T


UNIT_POINTS = _unit_points(POINTS // 2)
# a plane through numbers at the points by least squares: (mean, rise along each axis)
PLANE = np.linalg.pinv(np.column_stack([np.ones(POINTS), UNIT_POINTS]))


@dataclass(frozen=True, slots=True)
class GroundErrors:
    """How wrong a map may be.

    dem_sigma_m: one sigma of its heights. correlation_m: distance over which that error falls off, as exp(-d/L): ground
    close to the rover is wrong as its own is, which hides nothing. shift_sigma_m: one sigma, along east and along
    north, of the map as a whole against the anchors; None = half a cell. Raises WatchError.
    """

    dem_sigma_m: float = 3.0
    correlation_m: float = 100.0
    shift_sigma_m: float | None = None

    def __post_init__(self) -> None:
        for name in ("dem_sigma_m", "correlation_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise WatchError(f"{name} must be a number > 0 m, not {value}.")
        if self.shift_sigma_m is not None and not (math.isfinite(self.shift_sigma_m) and self.shift_sigma_m >= 0.0):
            raise WatchError(f"shift_sigma_m must be a number >= 0 m, not {self.shift_sigma_m}.")

    def shift_m(self, grid: ElevationGrid) -> float:
        """shift_sigma_m, or half a cell of the grid."""
        return 0.5 * max(grid.cell_east_m, grid.cell_north_m) if self.shift_sigma_m is None else self.shift_sigma_m


DEFAULT_ERRORS = GroundErrors()


@dataclass(frozen=True, slots=True, eq=False)
class SightForecast:
    """What a map says of k anchors at a place.

    p_sight: (k,) probability that the anchor is in sight. p_direct: (k,) that its range is too long by no more than was
    asked for: a grazing obstacle hides an anchor but hardly lengthens the way; with a radio it is that of a range that
    arrived (``Arrivals.straight``). clearance_m: (k,) of the sight line from the place itself, negative = blocked by
    that much. All NaN where the line passes over unknown ground.
    p_usable: (k,) probability that enough of its signal arrives. margin_db: (k,) of it, at the place itself. Both NaN
    without a radio too. ground: how high the antenna is there.
    """

    p_sight: Floats
    p_direct: Floats
    clearance_m: Floats
    p_usable: Floats
    margin_db: Floats
    ground: GroundHeight


def check_antenna(antenna_above_ground_m: float) -> None:
    """Raise WatchError where the rover's antenna cannot be so high."""
    if not (math.isfinite(antenna_above_ground_m) and antenna_above_ground_m >= 0.0):
        raise WatchError(f"antenna_above_ground_m must be a number >= 0 m, not {antenna_above_ground_m}.")


def forecast_sight(
    grid: ElevationGrid,
    place_m: npt.ArrayLike,
    covariance_m2: npt.ArrayLike,
    anchors_m: npt.ArrayLike,
    antenna_above_ground_m: float = 1.5,
    *,
    excess_m: float = 0.0,
    errors: GroundErrors = DEFAULT_ERRORS,
    curvature: Curvature | None = None,
    radios: Sequence[Radio | None] = (),
) -> SightForecast | None:
    """What the map says of anchors (k, 3) at a rover's place: probabilities of sight and the height of the ground.

    place_m: (2,) east, north, in the grid's frame, with its covariance (2, 2); longer ones lose what they say of
    height, since the rover stands on the ground. excess_m: for ``p_direct``, how much too long a range may be.
    radios: of each anchor, if any has one.
    None where the place, or most of what it may be, is outside the grid, on unknown ground, or unknown altogether.
    Raises WatchError, SignalError, and VisibilityInputError for anchors that are no places.
    """
    check_antenna(antenna_above_ground_m)
    centre_m, spread_m2 = np.asarray(place_m, np.float64)[:2], np.asarray(covariance_m2, np.float64)[:2, :2]
    shift_m = errors.shift_m(grid)
    drawn_m = _drawn(centre_m, spread_m2 + shift_m**2 * np.eye(2), grid)
    if drawn_m is None:
        return None
    points_m, root_m = drawn_m
    ground_m = height_at(grid, points_m[:, 0], points_m[:, 1])
    stands = np.isfinite(ground_m)
    if not stands[0] or 2 * np.count_nonzero(stands) <= POINTS:
        return None
    antennas_m = np.column_stack([points_m, ground_m + antenna_above_ground_m])[stands]
    ends_m, curvature = check_points(grid, "anchors_m", anchors_m), Curvature.over(grid, curvature)
    k, count = len(ends_m), len(antennas_m)
    seen = least_clearances(grid, np.repeat(antennas_m, k, axis=0), np.tile(ends_m, (count, 1)), curvature)
    clearance_m = np.where(seen.over_unknown, np.nan, seen.clearance_m)
    reach_m = np.hypot(*(ends_m[None, :, :2] - antennas_m[:, None, :2]).transpose(2, 0, 1)).ravel()
    odds = _odds(
        clearance_m, np.where(np.isnan(seen.share), 0.0, seen.share) * reach_m, reach_m, errors, excess_m
    ).reshape(count, k, 2)
    p_direct, unheard = odds[..., DIRECT], np.full(k, np.nan)
    p_usable, margin_db = unheard, unheard
    if any(radios):
        found = arrivals(grid, antennas_m, ends_m, radios, curvature)
        p_direct = found.straight(p_direct)
        p_usable, margin_db = found.p_usable.mean(axis=0), found.margin_db[0]
    return SightForecast(
        odds[..., IN_SIGHT].mean(axis=0),
        p_direct.mean(axis=0),
        clearance_m[:k].copy(),
        p_usable,
        margin_db,
        _ground_height(points_m, ground_m + antenna_above_ground_m, root_m, errors, shift_m),
    )


def _drawn(centre_m: Floats, spread_m2: Floats, grid: ElevationGrid) -> tuple[Floats, Floats] | None:
    """(points (POINTS, 2), root of the covariance (2, 2)), the place itself first; None where it is no place."""
    if not (np.isfinite(centre_m).all() and np.isfinite(spread_m2).all()):
        return None
    furthest_m = FURTHEST_CELLS * max(grid.cell_east_m, grid.cell_north_m)
    variances_m2, axes = np.linalg.eigh(spread_m2)
    if not 0.0 <= variances_m2[0] <= variances_m2[1] <= furthest_m**2:
        return None
    root_m = axes * np.sqrt(np.maximum(variances_m2, NEAREST_M**2))
    return centre_m + UNIT_POINTS @ root_m.T, root_m


def sight_probability(clearance_m: Floats, away_m: Floats, reach_m: Floats, errors: GroundErrors) -> Floats:
    """Probability that lines with these clearances are clear over ground that errs; any one shape, NaN stays NaN.

    away_m: how far from the rover the least clearance is; reach_m: how long each line is.
    """
    found: Floats = _odds(clearance_m.ravel(), away_m.ravel(), reach_m.ravel(), errors, 0.0)[:, IN_SIGHT]
    return found.reshape(clearance_m.shape)


def _odds(clearance_m: Floats, away_m: Floats, reach_m: Floats, errors: GroundErrors, excess_m: float) -> Floats:
    """(n, 2) IN_SIGHT and DIRECT of n lines: the ground in the way errs, and so does the rover's own, below it.

    A rise of the rover's ground by 1 m lifts the line by (1 - away/reach) at the obstacle; the nearer that is, the more
    alike both errors are.
    """
    found = np.empty((len(clearance_m), 2))
    told = (errors.dem_sigma_m, errors.correlation_m, float(excess_m))
    line_odds(clearance_m, away_m, reach_m, told, found)
    return found


def _ground_height(
    points_m: Floats, antenna_m: Floats, root_m: Floats, errors: GroundErrors, shift_m: float
) -> GroundHeight:
    """The plane that the antenna moves in as the place varies, and how far the ground departs from it."""
    known = np.isfinite(antenna_m)
    fit = PLANE if known.all() else np.linalg.pinv(np.column_stack([np.ones(POINTS), UNIT_POINTS])[known])
    level_m, *rise_m = (fit @ antenna_m[known]).tolist()
    off_m = antenna_m[known] - level_m - UNIT_POINTS[known] @ np.array(rise_m)
    slope_east, slope_north = np.linalg.solve(root_m.T, np.array(rise_m)).tolist()
    shifted_m = shift_m * math.hypot(slope_east, slope_north)
    sigma_m = math.sqrt(errors.dem_sigma_m**2 + float(np.mean(off_m**2)) + shifted_m**2)
    east_m, north_m = points_m[0].tolist()
    return GroundHeight(east_m, north_m, level_m, slope_east, slope_north, sigma_m)


def ground_amid(grid: ElevationGrid, anchors: Sequence[RangingAnchor], antenna_m: float) -> GroundHeight:
    """The antenna's height somewhere amid the anchors: good enough to tell below them from above."""
    at_m = np.array([(anchor.east_m, anchor.north_m) for anchor in anchors]).reshape(-1, 2)
    east_m, north_m = (np.linspace(low, high, 32) for low, high in zip(at_m.min(axis=0), at_m.max(axis=0), strict=True))
    heights_m = height_at(grid, east_m[:, None], north_m[None, :])
    if np.isnan(heights_m).all():
        heights_m = grid.heights_m.astype(np.float64)
    middle_east_m, middle_north_m = at_m.mean(axis=0).tolist()
    spread_m = float(np.nanstd(heights_m)) + 1.0
    level_m = float(np.nanmean(heights_m)) + antenna_m
    return GroundHeight(middle_east_m, middle_north_m, level_m, 0.0, 0.0, spread_m)


def strange_anchors(grid: ElevationGrid, anchors: Mapping[str, tuple[float, float, float]]) -> npt.NDArray[np.bool_]:
    """(k,) bool: anchors of which the map can say nothing, since they are far outside it or below its ground."""
    anchors_m = np.array(list(anchors.values())).reshape(-1, 3)
    west_m, south_m, east_m, north_m = grid.bounds_m
    off_m = np.maximum([west_m, south_m] - anchors_m[:, :2], anchors_m[:, :2] - [east_m, north_m]).max(axis=1)
    strange: npt.NDArray[np.bool_] = (off_m > FURTHEST_M) | (anchors_m[:, 2] < height_at(grid, *anchors_m.T[:2]))
    return strange


def mixed_with_doubts(
    p_sight: Floats, ids: Sequence[str], doubts: Mapping[str, tuple[SightDoubt, ...]], points_m: Floats
) -> Floats:
    """(m, k) probabilities of sight at points (m, 2 or more), mixed with the opposite by the doubts about each anchor.

    ids: of the k anchors.
    """
    mixed = p_sight.copy()
    for column, anchor_id in enumerate(ids):
        if anchor_id in doubts:
            mixed[:, column] = weighed_sight(p_sight[:, column], doubts[anchor_id], points_m)
    return mixed


def warnings_over(grid: ElevationGrid, anchors: Sequence[RangingAnchor]) -> tuple[str, ...]:
    """What is to be known of anchors over this map; raises WatchError where they are not of its frame."""
    warnings: list[str] = []
    for one in anchors:
        under_m = float(height_at(grid, one.east_m, one.north_m)) - one.altitude_m
        if under_m > 0.0:
            warnings.append(
                f"Anchor {one.id} is {under_m:.1f} m below the map's ground, so the map foretells no sight of it."
            )
            continue
        try:
            warnings += check_anchors(grid, [Anchor(one.id, one.east_m, one.north_m, one.altitude_m)])
        except AnchorError as error:
            raise WatchError(str(error)) from error
    return tuple(warnings)
