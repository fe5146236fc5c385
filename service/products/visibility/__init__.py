"""Visibility maps as a product: which anchors are seen from where."""

from __future__ import annotations

from service.estimates import refuse_map
from service.parts.map_area import map_area
from service.parts.shapes_in_grid import resolve_anchor
from service.products import Product
from service.settings import Settings
from terrain import ElevationGrid
from visibility.sight import check_anchors

from .calculate import VisibilityMap, VisibilityMapSummary, calculate_visibility_map
from .files import LAYERS
from .request import REQUEST, VisibilityMapIn, VisibilityMapParameters

__all__ = ["VISIBILITY_MAP"]


def _check(grid: ElevationGrid, parameters: VisibilityMapParameters, settings: Settings) -> None:
    refuse_map(grid.heights_m.size, len(parameters.anchors), parameters.mode, settings)
    map_area(grid, parameters.area)
    check_anchors(grid, [resolve_anchor(grid, anchor) for anchor in parameters.anchors])


VISIBILITY_MAP = Product(
    name="visibility-map",
    title="visibility map",
    plural="visibility_maps",
    model="VisibilityMap",
    tag="Visibility maps",
    summary="Which anchors are seen from where, over a whole DEM.",
    about="Which anchors are in sight of a receiver at one height, over a whole DEM or an area of it.",
    asked=VisibilityMapIn,
    parameters=VisibilityMapParameters,
    answer=VisibilityMapSummary,
    example=REQUEST,
    check=_check,
    calculate=calculate_visibility_map,
    layers=LAYERS,
    finished=VisibilityMap,
    arrays=("visible", "altitude_m", "count", "unknown_count"),
)
