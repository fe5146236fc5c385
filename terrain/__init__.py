"""The ground: one frozen grid type, reading it, frames, sampling, synthetic terrains, the mesh of the same surface."""

from .areas import DEGREES, GRID_METRES, Area, Box, Circle, Outline, area_in, area_in_degrees, area_window, grown_area
from .crs.frames import Body, body_of, grid_north, to_grid_frame, to_lon_lat, true_offsets
from .crs.parts import same_map
from .crs.texts import parse_crs
from .datums.conversion import altitude_step, with_vertical_datum
from .datums.geoid import egm96_height_m
from .datums.references import (
    HeightReference,
    VerticalDatum,
    height_reference_of,
    parse_vertical_datum,
    vertical_datum_of,
)
from .errors import (
    AreaError,
    DemFormatError,
    DemReadError,
    DemTooLargeError,
    DemUnsupportedError,
    ElevationGridError,
    FrameError,
    GroundChangedError,
    GroundSourceError,
    NoGroundError,
    SampleError,
    TerrainError,
    VerticalDatumError,
)
from .files.arrays import write_npz
from .files.large_dem import LargeDem, open_dem
from .files.reading import read_dem
from .grid import ElevationGrid, Provenance, RasterFile
from .limits import DEFAULT_MAX_CELLS
from .mesh import TriangleMesh, grid_mesh
from .nearest_surface import NearestSurface, nearest_surface
from .sampling import height_at
from .standing import SkyDepths, Standing, Trees
from .synthetic import cone, fractal, horizon_distance_m, plane, ridge, wedge
from .tiles.library import GroundLibrary, index_ground, read_library
from .tiles.mosaic import read_mosaic
from .tiles.plan import MosaicPlan, plan_mosaic
from .tiles.tile import Tile, read_tile
from .told_places import places_told, told_place

__all__ = [
    "DEFAULT_MAX_CELLS",
    "DEGREES",
    "GRID_METRES",
    "Area",
    "AreaError",
    "Body",
    "Box",
    "Circle",
    "DemFormatError",
    "DemReadError",
    "DemTooLargeError",
    "DemUnsupportedError",
    "ElevationGrid",
    "ElevationGridError",
    "FrameError",
    "GroundChangedError",
    "GroundLibrary",
    "GroundSourceError",
    "HeightReference",
    "LargeDem",
    "MosaicPlan",
    "NearestSurface",
    "NoGroundError",
    "Outline",
    "Provenance",
    "RasterFile",
    "SampleError",
    "SkyDepths",
    "Standing",
    "TerrainError",
    "Tile",
    "Trees",
    "TriangleMesh",
    "VerticalDatum",
    "VerticalDatumError",
    "altitude_step",
    "area_in",
    "area_in_degrees",
    "area_window",
    "body_of",
    "cone",
    "egm96_height_m",
    "fractal",
    "grid_mesh",
    "grid_north",
    "grown_area",
    "height_at",
    "height_reference_of",
    "horizon_distance_m",
    "index_ground",
    "nearest_surface",
    "open_dem",
    "parse_crs",
    "parse_vertical_datum",
    "places_told",
    "plan_mosaic",
    "plane",
    "read_dem",
    "read_library",
    "read_mosaic",
    "read_tile",
    "ridge",
    "same_map",
    "to_grid_frame",
    "to_lon_lat",
    "told_place",
    "true_offsets",
    "vertical_datum_of",
    "wedge",
    "with_vertical_datum",
    "write_npz",
]
