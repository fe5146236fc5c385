"""What stands on the ground: buildings, and ray-triangle engines for meshes."""

from visibility.cover.building_distance import NearestBuilding, nearest_building
from visibility.cover.building_sight import clear_of_buildings, visible_with_buildings
from visibility.cover.buildings import BuildingHeights, Buildings, parse_buildings, read_buildings
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

__all__ = [
    "BuildingHeights",
    "Buildings",
    "Engine",
    "Footprint",
    "FootprintHeights",
    "MeshHits",
    "NearestBuilding",
    "OneFootprint",
    "clear_of_buildings",
    "footprints_of",
    "grid_surface_mesh",
    "lowered_m",
    "mesh_blocks",
    "nearest_building",
    "parse_buildings",
    "parse_footprints",
    "read_buildings",
    "read_footprints",
    "standing_footprints",
    "standing_mesh",
    "standing_solids",
    "visible_with_buildings",
    "with_standing",
]
