"""DOP maps as a product: how good positioning is at one antenna height, and where it is not good enough."""

from __future__ import annotations

from collections.abc import Iterator

from service.estimates import Demand, sight_lines
from service.parts.map_area import map_area
from service.products import Product, WarmUp
from service.products.in_common import signals_demand
from service.settings import Settings
from terrain import ElevationGrid
from visibility import (
    Anchor,
    altitude_layers,
    control_volume,
    dop,
    dop_map,
    min_visible_altitude,
    position_error_map,
)
from visibility.air import whole_volume
from visibility.dilution import position_error, position_error_along

from .calculate import DopMapSummary, FinishedDopMap, calculate_dop_map, check_dop_map, path_points
from .files import LAYERS
from .request import REQUEST, DopMapIn, DopMapParameters
from .volumes import check_air

__all__ = ["DOP_MAP"]


def _estimate(grid: ElevationGrid, parameters: DopMapParameters) -> Iterator[Demand]:
    cells = grid.heights_m.size
    yield from sight_lines(cells, len(parameters.anchors), parameters.mode)
    yield from sight_lines(cells, len(check_dop_map(grid, parameters).all), parameters.mode)
    yield from signals_demand(grid, parameters)
    voxels = check_air(map_area(grid, parameters.area).box, parameters)
    remedy = "; ask for thicker layers, a lower ceiling or smaller bounds"
    yield Demand("max_voxels", voxels, f"The volume has {voxels:,} voxels,", remedy)


def _check(grid: ElevationGrid, parameters: DopMapParameters, settings: Settings) -> None:
    path_points(grid, parameters)


def _maps_and_air(grid: ElevationGrid) -> None:
    corners = ((10.0, -10.0, 90.0), (250.0, -20.0, 120.0), (20.0, -260.0, 70.0), (240.0, -240.0, 100.0))
    surfaces = min_visible_altitude(grid, [Anchor(f"A{n}", *at) for n, at in enumerate(corners)])
    for on_surface in (False, True):
        dop_map(surfaces, 1.5, on_surface=on_surface)
        position_error_map(surfaces, 1.5, on_surface=on_surface)
        position_error_along(surfaces, [[100.0, -100.0, 90.0]], on_surface=on_surface)
    whole_volume(control_volume(surfaces, altitude_layers(0.0, 40.0, 20.0, above_ground=True)))


def _points(grid: ElevationGrid) -> None:
    anchors_m, places_m = [[0.0, 0.0, 90.0], [90.0, 0.0, 80.0], [0.0, -90.0, 70.0]], [[10.0, -10.0, 60.0]] * 2
    dop(anchors_m, places_m)
    position_error(anchors_m, places_m, 0.1)


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
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_maps_and_air), WarmUp(_points)),
    calculate=calculate_dop_map,
    layers=LAYERS,
    finished=FinishedDopMap,
    arrays=(
        *("dop", "reasons", "count", "no_go", "sigmas_m", "path_numbers", "path_sets"),
        *("min_altitude_m", "hidden_below_m"),
    ),
)
