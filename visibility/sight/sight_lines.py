"""Line of sight between many pairs of points at once."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from terrain.version import VERSION
from visibility.cover.building_sight import building_hits
from visibility.cover.buildings import Buildings
from visibility.cover.ray_triangle import Engine
from visibility.errors import VisibilityInputError
from visibility.sight.curvature import Curvature
from visibility.sight.kernels.crossings import GRAZING_TOLERANCE_M
from visibility.sight.kernels.profiles import DETOUR, ZONE, over_profiles
from visibility.sight.kernels.sight_line import LEAVES_GRID, OVER_UNKNOWN, scan_few, scan_lines
from visibility.sight.minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, UnknownGround
from visibility.sight.roofs import roofs_over_lines
from visibility.sight.sight_points import check_points, in_posts

__all__ = ["ERROR_STATEMENT", "LeastClearances", "LinesOfSight", "least_clearances", "lines_of_sight"]

ERROR_STATEMENT = "every edge of the triangulated surface, in float64: clearance within 1e-6 m of exact arithmetic"

FEW_LINES = 256  # so many are done before a second thread would have begun

_erfc = np.vectorize(math.erfc, otypes=[np.float64])


@dataclass(frozen=True, eq=False)
class LinesOfSight:
    """The answer to ``lines_of_sight``; every array has one entry per line, n of them.

    clearance_m: (n,) least height of the line over the known ground and roofs under it, ends included; negative =
        blocked by that much; +inf where the line meets no known ground.
    verdict: (n,) uint8, VISIBLE 1, HIDDEN 0, UNKNOWN 255.
    blocking_point_m: (n, 3) east, north and altitude of the ground where the clearance is least, or of the building
        where only that is in the way; NaN where there is neither. blocking_distance_m: (n,) horizontal distance to it.
    distance_m: (n,) straight distance between the points.
    over_unknown, leaves_dem, ends_below: (n,) bool, the line passes over unknown ground; has a part outside the DEM;
        has its least clearance at an end below the ground.
    hits_building: (n,) bool; None without buildings. over_roof: (n,) bool, the least clearance is over a building that
        stands on the grid, and the blocking point is on its roof; None where nothing stands there.
    fresnel_clearance: (n,) least clearance across the line in radii of the first Fresnel zone; 0 where an end stands on
        the ground, -inf where one lies below it, NaN over unknown ground; None without a wavelength.
    excess_path_m: (n,) how much longer the shortest way over the ground in the vertical plane is than the line itself;
        0 where clear, +inf where an end lies below the ground, NaN over unknown ground; None unless asked for.
    probability_clear: (n,) that the line is clear of the ground; over unknown ground NaN, unless known ground blocks:
        then of that alone, which unknown ground can only lower; None without dem_sigma_m.
    """

    clearance_m: npt.NDArray[np.float64]
    verdict: npt.NDArray[np.uint8]
    blocking_point_m: npt.NDArray[np.float64]
    blocking_distance_m: npt.NDArray[np.float64]
    distance_m: npt.NDArray[np.float64]
    over_unknown: npt.NDArray[np.bool_]
    leaves_dem: npt.NDArray[np.bool_]
    ends_below: npt.NDArray[np.bool_]
    hits_building: npt.NDArray[np.bool_] | None
    over_roof: npt.NDArray[np.bool_] | None
    fresnel_clearance: npt.NDArray[np.float64] | None
    excess_path_m: npt.NDArray[np.float64] | None
    probability_clear: npt.NDArray[np.float64] | None
    unknown: UnknownGround
    curvature: Curvature
    error_statement: str
    warnings: tuple[str, ...]
    elapsed_s: float
    version: str


def lines_of_sight(
    grid: ElevationGrid,
    from_points_m: npt.ArrayLike,
    to_points_m: npt.ArrayLike,
    *,
    curvature: Curvature | None = None,
    unknown: UnknownGround = "unknown",
    wavelength_m: float | None = None,
    dem_sigma_m: float | None = None,
    excess_path: bool = False,
    buildings: Buildings | None = None,
    engine: Engine = "embree",
) -> LinesOfSight:
    """Clearance and verdict of the straight lines between n pairs of points.

    from_points_m, to_points_m: (n, 3) east, north, altitude, metres in the grid's frame; they may lie outside the grid,
        and ground outside it is taken as not blocking.
    curvature: None takes what the grid's CRS implies (Curvature.of); FLAT switches it off.
    unknown: verdict of a line over unknown ground that known ground does not block: "unknown", "open" or "blocked".
    wavelength_m: asks for fresnel_clearance. excess_path: asks for excess_path_m.
    dem_sigma_m: asks for probability_clear, Phi(clearance / sigma): one vertical error of that sigma is shared by the
        ground around the point of least clearance, and the altitudes of both points are exact. Errors elsewhere along
        the line that are independent of it can only lower the probability.
    buildings: what else may stand in the way, as a mesh that lines may pass below, where what stands on the grid itself
        is solid down to the ground; a line that meets one is hidden. Clearance, Fresnel clearance, excess path and
        probability remain those without it. engine: see ``mesh_blocks``.
    Raises VisibilityInputError.
    """
    started_s = time.perf_counter()
    start_m, end_m = check_points(grid, "from_points_m", from_points_m), check_points(grid, "to_points_m", to_points_m)
    if len(start_m) != len(end_m):
        raise VisibilityInputError(
            f"Each line needs two points, not {len(start_m)} from_points_m and {len(end_m)} to_points_m."
        )
    if unknown not in get_args(UnknownGround):
        raise VisibilityInputError(f"unknown must be one of {', '.join(get_args(UnknownGround))}, not {unknown!r}.")
    for name, value in (("wavelength_m", wavelength_m), ("dem_sigma_m", dem_sigma_m)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise VisibilityInputError(f"{name} must be a positive number of metres, not {value}.")
    curvature = Curvature.over(grid, curvature)

    sight = _scan(grid, start_m, end_m, curvature, unknown)
    if wavelength_m is not None or excess_path:
        sight = _with_profiles(sight, grid, start_m, end_m, wavelength_m, excess_path)
    if dem_sigma_m is not None:
        sight = replace(sight, probability_clear=_probability_clear(sight, dem_sigma_m))
    if buildings is not None:
        sight = _with_buildings(sight, grid, start_m, end_m, buildings, engine)
    return replace(sight, warnings=_warnings(sight), elapsed_s=time.perf_counter() - started_s)


@dataclass(frozen=True, eq=False, slots=True)
class LeastClearances:
    """Of n lines, as in ``LinesOfSight``: clearance_m, and share (n,) of the way to where it is, altitude_m there.

    over_unknown, leaves_dem: (n,) bool. hits_building, over_roof: (n,) bool; None where nothing stands on the grid.
    """

    clearance_m: npt.NDArray[np.float64]
    share: npt.NDArray[np.float64]
    altitude_m: npt.NDArray[np.float64]
    over_unknown: npt.NDArray[np.bool_]
    leaves_dem: npt.NDArray[np.bool_]
    hits_building: npt.NDArray[np.bool_] | None
    over_roof: npt.NDArray[np.bool_] | None


def least_clearances(
    grid: ElevationGrid, start_m: npt.NDArray[np.float64], end_m: npt.NDArray[np.float64], curvature: Curvature
) -> LeastClearances:
    """What decides n lines, without the rest of ``lines_of_sight``; points (n, 3) are finite: the caller sees to it."""
    least, bits = np.empty((len(start_m), 3)), np.empty(len(start_m), np.uint8)
    cells_m = (grid.cell_east_m, grid.cell_north_m)
    start, end = in_posts(grid, start_m), in_posts(grid, end_m)
    scan = scan_few if len(start_m) <= FEW_LINES else scan_lines
    scan(grid.heights_m, cells_m, curvature.drop_per_m2, start, end, least, bits)
    clearance_m, share, ground_m = least.T.copy()
    hits_building = lower = None
    if grid.standing is not None:
        roofs = roofs_over_lines(grid, start, end, curvature.drop_per_m2)
        hits_building = roofs.clearance_m < -GRAZING_TOLERANCE_M
        lower = roofs.clearance_m < clearance_m
        clearance_m[lower], share[lower], ground_m[lower] = (
            roofs.clearance_m[lower],
            roofs.share[lower],
            roofs.roof_m[lower],
        )
    over_unknown, leaves_dem = (bits & OVER_UNKNOWN) > 0, (bits & LEAVES_GRID) > 0
    return LeastClearances(clearance_m, share, ground_m, over_unknown, leaves_dem, hits_building, lower)


def _scan(
    grid: ElevationGrid,
    start_m: npt.NDArray[np.float64],
    end_m: npt.NDArray[np.float64],
    curvature: Curvature,
    unknown: UnknownGround,
) -> LinesOfSight:
    """Clearance, verdict and blocking point; the rest is left out."""
    least = least_clearances(grid, start_m, end_m, curvature)
    clearance_m, share = least.clearance_m, least.share
    blocked = clearance_m < -GRAZING_TOLERANCE_M
    verdict = np.full(len(start_m), VISIBLE)
    if unknown != "open":
        verdict[least.over_unknown] = UNKNOWN if unknown == "unknown" else HIDDEN
    verdict[blocked] = HIDDEN
    step_m = end_m - start_m
    return LinesOfSight(
        clearance_m=clearance_m,
        verdict=verdict,
        blocking_point_m=np.column_stack([start_m[:, :2] + share[:, None] * step_m[:, :2], least.altitude_m]),
        blocking_distance_m=share * np.hypot(step_m[:, 0], step_m[:, 1]),
        distance_m=np.sqrt((step_m**2).sum(axis=1)),
        over_unknown=least.over_unknown,
        leaves_dem=least.leaves_dem,
        ends_below=blocked & ((share == 0.0) | (share == 1.0)),
        hits_building=least.hits_building,
        over_roof=least.over_roof,
        fresnel_clearance=None,
        excess_path_m=None,
        probability_clear=None,
        unknown=unknown,
        curvature=curvature,
        error_statement=ERROR_STATEMENT,
        warnings=(),
        elapsed_s=0.0,
        version=VERSION,
    )


def _with_profiles(
    sight: LinesOfSight,
    grid: ElevationGrid,
    start_m: npt.NDArray[np.float64],
    end_m: npt.NDArray[np.float64],
    wavelength_m: float | None,
    excess_path: bool,
) -> LinesOfSight:
    """Add what needs the ground in order along each line: Fresnel clearance and excess path."""
    n = len(start_m)
    zone_m, detour_m = np.full(n, np.inf), np.zeros(n)
    wanted = np.full(n, ZONE if wavelength_m is not None else 0, np.uint8)
    if excess_path:
        wanted[sight.clearance_m < -GRAZING_TOLERANCE_M] |= DETOUR
    cells_m = (grid.cell_east_m, grid.cell_north_m)
    start, end = in_posts(grid, start_m), in_posts(grid, end_m)
    over_profiles(grid.heights_m, cells_m, sight.curvature.drop_per_m2, start, end, wanted, zone_m, detour_m)
    untold = sight.over_unknown & (sight.unknown != "open")
    zone_m[untold] = detour_m[untold] = np.nan
    fresnel_clearance = None
    if wavelength_m is not None:
        # vertical clearance stands aslant on a steep line: the distance across it is shorter by reach / distance
        reach_m = np.hypot(*(end_m - start_m)[:, :2].T)
        across = np.divide(reach_m, sight.distance_m, out=np.ones(n), where=reach_m > 0.0)
        fresnel_clearance = zone_m * across / np.sqrt(wavelength_m * np.maximum(sight.distance_m, np.finfo(float).tiny))
    return replace(sight, fresnel_clearance=fresnel_clearance, excess_path_m=detour_m if excess_path else None)


def _with_buildings(
    sight: LinesOfSight,
    grid: ElevationGrid,
    start_m: npt.NDArray[np.float64],
    end_m: npt.NDArray[np.float64],
    buildings: Buildings,
    engine: Engine,
) -> LinesOfSight:
    """Hide lines that meet a building; where only that is in the way, it is the blocking point."""
    hits = building_hits(grid, buildings, sight.curvature, start_m, end_m, engine)
    step_m = end_m - start_m
    newly = hits.blocked & ~(sight.clearance_m < -GRAZING_TOLERANCE_M)
    share = hits.share[newly]
    point_m = start_m[newly] + share[:, None] * step_m[newly]
    reach_m = np.hypot(step_m[newly, 0], step_m[newly, 1])
    point_m[:, 2] -= sight.curvature.drop_per_m2 * reach_m**2 * share * (1.0 - share)
    blocking_point_m, blocking_distance_m = sight.blocking_point_m.copy(), sight.blocking_distance_m.copy()
    blocking_point_m[newly], blocking_distance_m[newly] = point_m, share * reach_m
    return replace(
        sight,
        verdict=np.where(hits.blocked, HIDDEN, sight.verdict),
        hits_building=hits.blocked if sight.hits_building is None else hits.blocked | sight.hits_building,
        blocking_point_m=blocking_point_m,
        blocking_distance_m=blocking_distance_m,
    )


def _probability_clear(sight: LinesOfSight, dem_sigma_m: float) -> npt.NDArray[np.float64]:
    # Phi(x) = erfc(-x / sqrt 2) / 2; scipy's would cost a third of a second at import
    probability: npt.NDArray[np.float64] = _erfc(-sight.clearance_m / (dem_sigma_m * math.sqrt(2.0))) / 2.0
    if sight.unknown == "blocked":
        probability[sight.over_unknown] = 0.0
    elif sight.unknown == "unknown":
        probability[sight.over_unknown & (sight.verdict != HIDDEN)] = np.nan
    return probability


def _warnings(sight: LinesOfSight) -> tuple[str, ...]:
    n = len(sight.verdict)
    taken = {
        "unknown": "so what depends on the ground there is not known",
        "open": "which was taken as not blocking, as asked",
        "blocked": "which was taken as blocking, as asked",
    }
    found = [
        (
            sight.leaves_dem,
            "lies",
            "partly or wholly outside the DEM; ground there is unknown and taken as not blocking",
        ),
        (sight.ends_below, "ends", "below the ground and is blocked there"),
        (sight.over_unknown, "passes", f"over unknown ground, {taken[sight.unknown]}"),
    ]
    subject = "The line" if n == 1 else "{count} of {n} lines: each"
    return tuple(
        f"{subject.format(count=int(lines.sum()), n=n)} {verb} {where}." for lines, verb, where in found if lines.any()
    )
