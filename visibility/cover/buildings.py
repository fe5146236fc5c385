"""Buildings: triangle meshes that stand on the DEM."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, height_at, told_place
from visibility.cover.mesh_files import MAX_FACES, MAX_FILE_BYTES, read_mesh_bytes, triangles_of
from visibility.errors import MeshError

__all__ = ["BuildingHeights", "Buildings", "parse_buildings", "read_buildings"]

BuildingHeights = Literal["above_ground", "absolute"]

# Vertices closer than this are one: formats without shared vertices repeat them, rounded.
SAME_VERTEX_M = 1e-4


@dataclass(frozen=True, eq=False)
class Buildings:
    """Triangles in the grid's frame, altitudes in its vertical datum.

    vertices_m: (n, 3) float64 east, north, altitude. faces: (m, 3) int32 vertex numbers; either winding blocks.
    Raises MeshError.
    """

    vertices_m: npt.NDArray[np.float64]
    faces: npt.NDArray[np.integer]
    source: str = ""

    def __post_init__(self) -> None:
        what = f"The building mesh {self.source}".rstrip()
        vertices_m = np.array(self.vertices_m, np.float64)
        faces = np.array(self.faces, np.int64)
        if faces.size == 0 or vertices_m.size == 0:
            raise MeshError(f"{what} holds no triangles.")
        if vertices_m.ndim != 2 or vertices_m.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
            raise MeshError(
                f"{what} must be vertices (n, 3) and faces (m, 3), not {vertices_m.shape} and {faces.shape}."
            )
        if faces.min() < 0 or faces.max() >= len(vertices_m):
            raise MeshError(f"{what} has faces that number vertices which are not there ({len(vertices_m)} vertices).")
        broken = int(np.count_nonzero(~np.isfinite(vertices_m).all(axis=1)))
        if broken:
            raise MeshError(f"{what} has {broken} vertices that are not finite numbers; repair the file.")
        vertices_m.setflags(write=False)
        object.__setattr__(self, "vertices_m", vertices_m)
        object.__setattr__(self, "faces", faces.astype(np.int32))
        self.faces.setflags(write=False)

    @property
    def count(self) -> int:
        """How many separate bodies there are."""
        return int(self.bodies().max()) + 1

    def bodies(self) -> npt.NDArray[np.int32]:
        """(m,) number of the body that each face belongs to: faces that share a vertex position are one body."""
        # here, because few questions have buildings and importing this takes a third of a second
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        corners = self.merged_corners()
        ends = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]]])
        size = int(corners.max()) + 1
        _, label = connected_components(coo_array((np.ones(len(ends), np.int8), ends.T), shape=(size, size)), False)
        _, body = np.unique(label[corners[:, 0]], return_inverse=True)
        return body.reshape(-1).astype(np.int32)

    def merged_corners(self) -> npt.NDArray[np.intp]:
        """(m, 3) vertex numbers of the faces, equal where vertices have the same position."""
        places = np.round(self.vertices_m / SAME_VERTEX_M)
        _, merged = np.unique(places, axis=0, return_inverse=True)
        corners: npt.NDArray[np.intp] = merged.reshape(-1)[self.faces]
        return corners


def read_buildings(
    path: str | Path,
    grid: ElevationGrid,
    *,
    heights: BuildingHeights = "above_ground",
    up: Literal["y", "z"] | None = None,
    origin_east_m: float = 0.0,
    origin_north_m: float = 0.0,
    max_bytes: int = MAX_FILE_BYTES,
    max_faces: int = MAX_FACES,
) -> Buildings:
    """Buildings from a .stl, .obj, .ply or .glb file, in metres, placed on the grid.

    heights: "above_ground" stands each separate body on the ground under the middle of its footprint; "absolute" takes
        the file's heights as altitudes.
    up: the file's upward axis; None takes "y" for .glb, as that format says (east = x, north = -z), and "z" for the
        others (east = x, north = y).
    origin_east_m, origin_north_m: where the file's own origin lies in the grid's frame.
    Nothing but the file itself is opened: materials, textures and other references are not followed. Raises MeshError.
    """
    path = Path(path)
    _check_words(heights, up)
    return parse_buildings(
        read_mesh_bytes(path, max_bytes),
        path.name,
        grid,
        heights=heights,
        up=up,
        origin_east_m=origin_east_m,
        origin_north_m=origin_north_m,
        max_faces=max_faces,
    )


def parse_buildings(
    data: bytes,
    name: str,
    grid: ElevationGrid,
    *,
    heights: BuildingHeights = "above_ground",
    up: Literal["y", "z"] | None = None,
    origin_east_m: float = 0.0,
    origin_north_m: float = 0.0,
    max_faces: int = MAX_FACES,
) -> Buildings:
    """The same from the bytes of such a file; the ending of its name tells the format. Raises MeshError."""
    _check_words(heights, up)
    vertices_m, faces = triangles_of(data, name, max_faces=max_faces)
    if up == "y" or (up is None and name.lower().endswith(".glb")):
        vertices_m = np.column_stack([vertices_m[:, 0], -vertices_m[:, 2], vertices_m[:, 1]])
    buildings = Buildings(vertices_m + np.array([origin_east_m, origin_north_m, 0.0]), faces, name)
    return buildings if heights == "absolute" else _on_ground(grid, buildings)


def _check_words(heights: object, up: object) -> None:
    if heights not in get_args(BuildingHeights):
        raise MeshError(f"heights must be one of {', '.join(get_args(BuildingHeights))}, not {heights!r}.")
    if up not in ("y", "z", None):
        raise MeshError(f"up must be y or z, not {up!r}.")


def _on_ground(grid: ElevationGrid, buildings: Buildings) -> Buildings:
    """Each body raised by the ground's height under the middle of its footprint."""
    body = buildings.bodies()
    corners_m = buildings.vertices_m[buildings.faces]
    bodies = int(body.max()) + 1
    low_m, high_m = np.full((bodies, 2), np.inf), np.full((bodies, 2), -np.inf)
    np.minimum.at(low_m, body, corners_m[..., :2].min(axis=1))
    np.maximum.at(high_m, body, corners_m[..., :2].max(axis=1))
    middle_m = (low_m + high_m) / 2.0
    ground_m = height_at(grid, middle_m[:, 0], middle_m[:, 1])
    nowhere = np.isnan(ground_m)
    if nowhere.any():
        east_m, north_m = middle_m[int(np.argmax(nowhere))]
        raise MeshError(
            f"{int(nowhere.sum())} of {bodies} buildings in {buildings.source} have no known ground below, "
            f"one at {told_place(grid, east_m, north_m, 0.1)}; set the file's origin, or give absolute heights."
        )
    # a vertex that two bodies share, though not its neighbours, must not be raised twice: one vertex per face corner
    raised_m = corners_m + np.stack([np.zeros(len(body)), np.zeros(len(body)), ground_m[body]], axis=-1)[:, None, :]
    return Buildings(raised_m.reshape(-1, 3), np.arange(3 * len(body)).reshape(-1, 3), buildings.source)
