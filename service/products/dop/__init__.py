"""DOP maps as a product: how good positioning is at one antenna height, and where it is not good enough."""

from __future__ import annotations

from service.estimates import refuse_map, refuse_volume
from service.parts.map_area import map_area
from service.products import Product
from service.settings import Settings
from terrain import ElevationGrid

from .calculate import DopMapSummary, FinishedDopMap, calculate_dop_map, check_dop_map, path_points
from .files import LAYERS
from .request import REQUEST, DopMapIn, DopMapParameters
from .volumes import check_air

__all__ = ["DOP_MAP"]


def _check(grid: ElevationGrid, parameters: DopMapParameters, settings: Settings) -> None:
    cells = grid.heights_m.size
    refuse_map(cells, len(parameters.anchors), parameters.mode, settings)
    path_points(grid, parameters)
    refuse_map(cells, len(check_dop_map(grid, parameters).all), parameters.mode, settings)
    refuse_volume(check_air(map_area(grid, parameters.area).box, parameters), settings)


DOP_MAP = Product(
    name="dop-map",
    title="DOP map",
    plural="dop_maps",
    model="DopMap",
    tag="DOP maps",
    summary="How good positioning is for a rover, and where it is not good enough.",
    about="How good positioning is for a rover at one antenna height, and where it is not good enough.",
    asked=DopMapIn,
    parameters=DopMapParameters,
    answer=DopMapSummary,
    example=REQUEST,
    check=_check,
    calculate=calculate_dop_map,
    layers=LAYERS,
    finished=FinishedDopMap,
    arrays=(
        *("dop", "reasons", "count", "no_go", "sigmas_m", "path_numbers", "path_sets"),
        *("min_altitude_m", "hidden_below_m"),
    ),
)
