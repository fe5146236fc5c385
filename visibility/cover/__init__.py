"""What stands on the ground: buildings, canopy and what it costs a signal, and ray-triangle engines for meshes."""

from visibility.cover.building_distance import NearestBuilding, nearest_building
from visibility.cover.building_sight import clear_of_buildings, visible_with_buildings
from visibility.cover.buildings import BuildingHeights, Buildings, parse_buildings, read_buildings
from visibility.cover.canopy import Canopy, canopy_between, canopy_depths, canopy_paths, raster_over, resampled_canopy
from visibility.cover.footprints import (
    Footprint,
    FootprintHeights,
    OneFootprint,
    footprints_of,
    parse_footprints,
    read_footprints,
)
from visibility.cover.ray_triangle import Engine, MeshHits, grid_surface_mesh, lowered_m, mesh_blocks
from visibility.cover.standing import standing_footprints, standing_mesh, standing_solids, with_standing
from visibility.cover.vegetation import (
    DensityFit,
    VegetationLoss,
    density_loss,
    early_itu_loss,
    fit_density,
    p833_slant_loss,
    p833_woodland_loss,
    weissberger_loss,
)

__all__ = [
    "BuildingHeights",
    "Buildings",
    "Canopy",
    "DensityFit",
    "Engine",
    "Footprint",
    "FootprintHeights",
    "MeshHits",
    "NearestBuilding",
    "OneFootprint",
    "VegetationLoss",
    "canopy_between",
    "canopy_depths",
    "canopy_paths",
    "clear_of_buildings",
    "density_loss",
    "early_itu_loss",
    "fit_density",
    "footprints_of",
    "grid_surface_mesh",
    "lowered_m",
    "mesh_blocks",
    "nearest_building",
    "p833_slant_loss",
    "p833_woodland_loss",
    "parse_buildings",
    "parse_footprints",
    "raster_over",
    "read_buildings",
    "read_footprints",
    "resampled_canopy",
    "standing_footprints",
    "standing_mesh",
    "standing_solids",
    "visible_with_buildings",
    "weissberger_loss",
    "with_standing",
]
