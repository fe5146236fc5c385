"""Line of sight between two points, the ground under it, and radio over it: Fresnel zone, loss over a knife edge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.cover.buildings import Buildings
from visibility.cover.ray_triangle import Engine
from visibility.sight.curvature import Curvature
from visibility.sight.kernels.crossings import GRAZING_TOLERANCE_M, GridPoint
from visibility.sight.kernels.profiles import ground_profile, profile_room
from visibility.sight.minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, UnknownGround
from visibility.sight.roofs import roof_edges_crossed, roofs_over
from visibility.sight.sight_lines import LinesOfSight, lines_of_sight
from visibility.sight.sight_points import check_point, in_posts

__all__ = [
    "GroundProfile",
    "LineOfSight",
    "Verdict",
    "fresnel_radius_m",
    "knife_edge_loss_db",
    "line_of_sight",
    "profile",
]

SAME_SHARE = 1e-12
WALL_M = 1e-3
Verdict = Literal["clear", "blocked", "unknown"]
_VERDICTS: dict[int, Verdict] = {int(VISIBLE): "clear", int(HIDDEN): "blocked", int(UNKNOWN): "unknown"}


@dataclass(frozen=True, eq=False)
class GroundProfile:
    """Ground and line wherever the line crosses an edge of the triangulation, and under its ends; m places in order.

    distance_m: (m,) horizontal distance from the first point. ground_m: (m,) altitude of the ground; NaN = unknown.
    line_m: (m,) altitude of the line; with curvature it sags between its ends, as the ground would otherwise bulge.
    clearance_m: (m,) line over ground. roof_m: (m,) altitude of the highest roof there; NaN where nothing stands. Where
    the line crosses an edge of a roof there is a place on either side of it, WALL_M away. Between two places each of
    them is straight. Parts outside the DEM have none.
    """

    distance_m: npt.NDArray[np.float64]
    ground_m: npt.NDArray[np.float64]
    line_m: npt.NDArray[np.float64]
    clearance_m: npt.NDArray[np.float64]
    roof_m: npt.NDArray[np.float64]
    curvature: Curvature


def profile(
    grid: ElevationGrid, from_point: npt.ArrayLike, to_point: npt.ArrayLike, *, curvature: Curvature | None = None
) -> GroundProfile:
    """The ground under the straight line between two points (east, north, altitude) in the grid's frame, metres.

    curvature: None takes what the grid's CRS implies (Curvature.of); FLAT switches it off. Raises VisibilityInputError.
    """
    start_m, end_m = check_point(grid, "from_point", from_point), check_point(grid, "to_point", to_point)
    curvature = Curvature.over(grid, curvature)
    start, end = (GridPoint(*in_posts(grid, point[None])[0].tolist()) for point in (start_m, end_m))
    places = np.empty((profile_room(grid.rows, grid.cols), 3))
    cells_m = (grid.cell_east_m, grid.cell_north_m)
    count = ground_profile(grid.heights_m, cells_m, curvature.drop_per_m2, start, end, places)
    share, ground_m, clearance_m = places[:count].T
    # a post is met by a row, a column and a diagonal at once
    new = np.diff(share, prepend=-1.0) > SAME_SHARE
    share, ground_m, clearance_m = share[new], ground_m[new], clearance_m[new]
    reach_m = float(np.hypot(*(end_m - start_m)[:2]))
    if grid.standing is not None and len(share):
        crossed, beside = roof_edges_crossed(grid, start_m, end_m), WALL_M / max(reach_m, WALL_M)
        walls = np.clip(np.concatenate([crossed - beside, crossed + beside]), share[0], share[-1])
        met = share
        share = np.union1d(met, walls)
        ground_m, clearance_m = np.interp(share, met, ground_m), np.interp(share, met, clearance_m)
    roof_m = roofs_over(grid, *(start_m[axis] + share * (end_m - start_m)[axis] for axis in (0, 1)))
    roof_m = np.where(np.isfinite(roof_m), roof_m, np.nan)
    sag_m = curvature.drop_m(reach_m) * share * (1.0 - share)
    line_m = start_m[2] + share * (end_m[2] - start_m[2]) - sag_m
    return GroundProfile(share * reach_m, ground_m, line_m, clearance_m, roof_m, curvature)


@dataclass(frozen=True, slots=True)
class LineOfSight:
    """The answer to ``line_of_sight``.

    verdict: "clear" (touching the ground is clear), "blocked" or "unknown".
    clearance_m: least height of the line over the known ground and roofs under it, ends included; negative = blocked by
        that much; +inf where the line meets no known ground.
    blocked_by: what stands in the way when the verdict is "blocked".
    blocking_point_m: (east, north, altitude) of the ground where the clearance is least, or of the building where only
        that is in the way; None where there is neither. blocking_distance_m: horizontal distance to it.
    distance_m: straight distance between the points.
    fresnel_clearance: least clearance across the line in radii of the first Fresnel zone, 0.6 is free space.
        diffraction_loss_db: loss over that one point as a knife edge (ITU-R P.526). Both None without a wavelength.
    excess_path_m: how much longer the shortest way over the ground in the vertical plane is than the straight line, the
        bias a diffracted range would show; 0 when clear, +inf when an end lies below the ground.
    probability_clear: that the line is clear of the ground; None without dem_sigma_m.
    NaN: not known, because the line passes over unknown ground; its probability is known where known ground blocks it.
    """

    verdict: Verdict
    clearance_m: float
    blocked_by: Literal["ground", "unknown ground", "building"] | None
    blocking_point_m: tuple[float, float, float] | None
    blocking_distance_m: float | None
    distance_m: float
    fresnel_clearance: float | None
    diffraction_loss_db: float | None
    excess_path_m: float
    probability_clear: float | None
    curvature: Curvature
    error_statement: str
    warnings: tuple[str, ...]
    elapsed_s: float
    version: str


def line_of_sight(
    grid: ElevationGrid,
    from_point: npt.ArrayLike,
    to_point: npt.ArrayLike,
    *,
    curvature: Curvature | None = None,
    unknown: UnknownGround = "unknown",
    wavelength_m: float | None = None,
    dem_sigma_m: float | None = None,
    buildings: Buildings | None = None,
    engine: Engine = "embree",
) -> LineOfSight:
    """Whether two points see one another, and by how much.

    from_point, to_point: (east, north, altitude), metres in the grid's frame; options as in ``lines_of_sight``.
    Raises VisibilityInputError.
    """
    sight = lines_of_sight(
        grid,
        check_point(grid, "from_point", from_point)[None],
        check_point(grid, "to_point", to_point)[None],
        curvature=curvature,
        unknown=unknown,
        wavelength_m=wavelength_m,
        dem_sigma_m=dem_sigma_m,
        excess_path=True,
        buildings=buildings,
        engine=engine,
    )
    met = not np.isnan(sight.blocking_point_m[0, 0])
    east_m, north_m, altitude_m = sight.blocking_point_m[0].tolist()
    fresnel_clearance = _only(sight.fresnel_clearance)
    excess_path_m = _only(sight.excess_path_m)
    assert excess_path_m is not None, "asked for above"
    return LineOfSight(
        verdict=_VERDICTS[int(sight.verdict[0])],
        clearance_m=float(sight.clearance_m[0]),
        blocked_by=_blocked_by(sight),
        blocking_point_m=(east_m, north_m, altitude_m) if met else None,
        blocking_distance_m=float(sight.blocking_distance_m[0]) if met else None,
        distance_m=float(sight.distance_m[0]),
        fresnel_clearance=fresnel_clearance,
        diffraction_loss_db=None if fresnel_clearance is None else float(knife_edge_loss_db(fresnel_clearance)),
        excess_path_m=excess_path_m,
        probability_clear=_only(sight.probability_clear),
        curvature=sight.curvature,
        error_statement=sight.error_statement,
        warnings=sight.warnings,
        elapsed_s=sight.elapsed_s,
        version=sight.version,
    )


def _only(values: npt.NDArray[np.float64] | None) -> float | None:
    return None if values is None else float(values[0])


def _blocked_by(sight: LinesOfSight) -> Literal["ground", "unknown ground", "building"] | None:
    if sight.verdict[0] != HIDDEN:
        return None
    if sight.clearance_m[0] < -GRAZING_TOLERANCE_M:
        return "building" if sight.over_roof is not None and sight.over_roof[0] else "ground"
    if sight.hits_building is not None and sight.hits_building[0]:
        return "building"
    return "unknown ground"


def fresnel_radius_m(
    wavelength_m: npt.ArrayLike, near_m: npt.ArrayLike, far_m: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Radius of the first Fresnel zone, metres: sqrt(wavelength·d1·d2 / (d1 + d2)), d1 and d2 from its ends."""
    wavelength, near, far = (np.asarray(value, np.float64) for value in (wavelength_m, near_m, far_m))
    radius_m: npt.NDArray[np.float64] = np.sqrt(wavelength * near * far / (near + far))
    return radius_m


def knife_edge_loss_db(fresnel_clearance: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Diffraction loss over one knife edge, dB, from its clearance in first-zone radii (negative = in the way).

    ITU-R P.526: J(v) = 6.9 + 20 lg(sqrt((v - 0.1)² + 1) + v - 0.1) with v = -sqrt(2)·clearance, 0 dB for v <= -0.78.
    Terrain that is not one sharp edge loses more. NaN stays NaN; -inf (an end below the ground) loses everything: +inf.
    """
    v = -np.sqrt(2.0) * np.asarray(fresnel_clearance, np.float64)
    above = np.maximum(v, -0.78) - 0.1
    loss_db: npt.NDArray[np.float64] = 6.9 + 20.0 * np.log10(np.hypot(above, 1.0) + above)
    return np.where(v <= -0.78, 0.0, loss_db)
