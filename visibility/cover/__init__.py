"""What stands on the ground: buildings, and ray-triangle engines for meshes."""

from visibility.cover.building_distance import NearestBuilding, nearest_building
from visibility.cover.building_sight import clear_of_buildings, visible_with_buildings
from visibility.cover.buildings import BuildingHeights, Buildings, parse_buildings, read_buildings
from visibility.cover.ray_triangle import Engine, MeshHits, grid_surface_mesh, lowered_m, mesh_blocks

__all__ = [
    "BuildingHeights",
    "Buildings",
    "Engine",
    "MeshHits",
    "NearestBuilding",
    "clear_of_buildings",
    "grid_surface_mesh",
    "lowered_m",
    "mesh_blocks",
    "nearest_building",
    "parse_buildings",
    "read_buildings",
    "visible_with_buildings",
]
