"""The ray-triangle engine: does a mesh stand between two points? An oracle, and the way in for buildings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Protocol, get_args

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from embreex.rtcore_scene import EmbreeScene

from terrain import ElevationGrid, TriangleMesh, grid_mesh
from visibility.cover.kernels.triangles import first_hits
from visibility.errors import VisibilityInputError
from visibility.sight.curvature import Curvature
from visibility.sight.kernels.crossings import GRAZING_TOLERANCE_M

__all__ = ["Engine", "MeshHits", "Triangles", "grid_surface_mesh", "lowered_m", "mesh_blocks"]

Engine = Literal["embree", "moller_trumbore"]

# Embree works in float32, so a coordinate is off by 2^-24 of the scene's half width; a few roundings meet in one hit.
EMBREE_ROUNDINGS = 8.0 * 2.0**-24


class Triangles(Protocol):
    """Anything with vertices_m (n, 3), east, north, up, and faces (m, 3) that number them."""

    @property
    def vertices_m(self) -> npt.NDArray[np.float64]:
        """(n, 3) east, north, up, metres."""

    @property
    def faces(self) -> npt.NDArray[np.integer]:
        """(m, 3) vertex numbers."""


@dataclass(frozen=True, eq=False)
class MeshHits:
    """What n segments met.

    blocked: (n,) bool. share: (n,) the way from the first point to the first hit as a share of the segment, 0..1; +inf
        where there is none. distance_m: (n,) the same in metres.
    tolerance_m: a segment that passes less than this below the top of a surface counts as touching it, which is clear.
    """

    blocked: npt.NDArray[np.bool_]
    share: npt.NDArray[np.float64]
    distance_m: npt.NDArray[np.float64]
    tolerance_m: float


def mesh_blocks(
    mesh: Triangles, from_points_m: npt.ArrayLike, to_points_m: npt.ArrayLike, engine: Engine = "embree"
) -> MeshHits:
    """Whether a mesh stands between n pairs of points, (n, 3) each, in the mesh's own straight frame.

    engine: "moller_trumbore" tries every triangle in float64 (the oracle; tolerance 1e-5 m); "embree" is fast, works in
        float32 about the middle of the scene and has a tolerance of 2^-21 of its half width (9 mm on 36 km).
    A mesh is a surface, not a solid: a segment that stays below it all the way is not blocked.
    Raises VisibilityInputError.
    """
    if engine not in get_args(Engine):
        raise VisibilityInputError(f"engine must be one of {', '.join(get_args(Engine))}, not {engine!r}.")
    start_m, end_m = (np.array(points, np.float64, ndmin=2).reshape(-1, 3) for points in (from_points_m, to_points_m))
    if start_m.shape != end_m.shape:
        raise VisibilityInputError(f"Each segment needs two points, not {len(start_m)} and {len(end_m)}.")
    if not (np.isfinite(start_m).all() and np.isfinite(end_m).all()):
        raise VisibilityInputError("Segments need finite coordinates.")
    used_m = mesh.vertices_m[np.unique(mesh.faces)]
    if len(start_m) == 0 or len(used_m) == 0:
        return _hits(start_m, end_m, GRAZING_TOLERANCE_M, np.full(len(start_m), np.inf))
    if engine == "moller_trumbore":
        return _hits(start_m, end_m, GRAZING_TOLERANCE_M, _first_of_all(mesh, start_m, end_m))
    everything_m = np.vstack([used_m, start_m, end_m])
    low_m, high_m = everything_m.min(axis=0), everything_m.max(axis=0)
    tolerance_m = max(GRAZING_TOLERANCE_M, EMBREE_ROUNDINGS * float((high_m - low_m).max()) / 2.0)
    return _hits(
        start_m, end_m, tolerance_m, _first_by_embree(mesh, start_m, end_m, (low_m + high_m) / 2.0, tolerance_m)
    )


def grid_surface_mesh(grid: ElevationGrid, curvature: Curvature, origin_m: tuple[float, float]) -> TriangleMesh:
    """The grid's surface lowered by curvature about origin_m (east, north): in this frame sight lines are straight.

    Points must be lowered alike, by ``lowered_m(curvature, origin_m, points)``. Any origin serves every line: another
    one only tilts the frame.
    """
    east_m, north_m = (grid.origin_east_m, grid.origin_north_m)
    posts_m = np.stack(
        np.broadcast_arrays(
            (east_m + np.arange(grid.cols) * grid.cell_east_m)[None, :],
            (north_m - np.arange(grid.rows) * grid.cell_north_m)[:, None],
        ),
        axis=-1,
    )
    return grid_mesh(grid, lowered_m(curvature, origin_m, posts_m))


def lowered_m(
    curvature: Curvature, origin_m: tuple[float, float], points_m: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """How far curvature lowers points (..., 2 or 3), east and north first, about origin_m; metres, shape (...).

    Raises VisibilityInputError.
    """
    offset_m = points_m[..., :2] - np.asarray(origin_m)
    drop_m: npt.NDArray[np.float64] = Curvature.given(curvature).drop_per_m2 * (offset_m**2).sum(axis=-1)
    return drop_m


def _first_of_all(
    mesh: Triangles, start_m: npt.NDArray[np.float64], end_m: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    corners_m = mesh.vertices_m[mesh.faces]
    lift_m = np.array([0.0, 0.0, GRAZING_TOLERANCE_M])
    corner, edge_1, edge_2 = corners_m[:, 0], corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    share = np.empty(len(start_m))
    first_hits(start_m + lift_m, end_m + lift_m, corner.copy(), edge_1, edge_2, share)
    return share


def _first_by_embree(
    mesh: Triangles,
    start_m: npt.NDArray[np.float64],
    end_m: npt.NDArray[np.float64],
    middle_m: npt.NDArray[np.float64],
    tolerance_m: float,
) -> npt.NDArray[np.float64]:
    scene: Any = EmbreeScene(robust=True)
    known_m = np.where(np.isnan(mesh.vertices_m), 0.0, mesh.vertices_m - middle_m)
    EmbreeMesh(scene, known_m.astype(np.float32), np.ascontiguousarray(mesh.faces, np.int32))
    lift_m = np.array([0.0, 0.0, tolerance_m])
    origin = (start_m - middle_m + lift_m).astype(np.float32)
    share = scene.run(
        origin,
        (end_m - middle_m + lift_m).astype(np.float32) - origin,
        dists=np.ones(len(start_m), np.float32),
        query="DISTANCE",
    )
    return np.where(share < 1.0, share, np.inf).astype(np.float64)


def _hits(
    start_m: npt.NDArray[np.float64],
    end_m: npt.NDArray[np.float64],
    tolerance_m: float,
    share: npt.NDArray[np.float64],
) -> MeshHits:
    blocked = np.isfinite(share)
    length_m = np.sqrt(((end_m - start_m) ** 2).sum(axis=1))
    return MeshHits(
        blocked, share, np.multiply(share, length_m, out=np.full(len(share), np.inf), where=blocked), tolerance_m
    )
