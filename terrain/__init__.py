"""The ground: one frozen grid type, reading it, frames, sampling, synthetic terrains, the mesh of the same surface."""

from .array_files import write_npz
from .errors import (
    DemFormatError,
    DemReadError,
    DemTooLargeError,
    DemUnsupportedError,
    ElevationGridError,
    FrameError,
    SampleError,
    TerrainError,
)
from .frames import Body, body_of, to_grid_frame, to_lon_lat
from .grid import ElevationGrid, Provenance
from .limits import DEFAULT_MAX_CELLS
from .mesh import TriangleMesh, grid_mesh
from .nearest_surface import NearestSurface, nearest_surface
from .read_only import read_only
from .reading import read_dem
from .sampling import height_at
from .synthetic import cone, fractal, horizon_distance_m, plane, ridge, wedge
from .told_places import places_told, told_place

__all__ = [
    "DEFAULT_MAX_CELLS",
    "Body",
    "DemFormatError",
    "DemReadError",
    "DemTooLargeError",
    "DemUnsupportedError",
    "ElevationGrid",
    "ElevationGridError",
    "FrameError",
    "NearestSurface",
    "Provenance",
    "SampleError",
    "TerrainError",
    "TriangleMesh",
    "body_of",
    "cone",
    "fractal",
    "grid_mesh",
    "height_at",
    "horizon_distance_m",
    "nearest_surface",
    "places_told",
    "plane",
    "read_dem",
    "read_only",
    "ridge",
    "to_grid_frame",
    "to_lon_lat",
    "told_place",
    "wedge",
    "write_npz",
]
