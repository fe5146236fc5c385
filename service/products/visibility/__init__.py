"""Visibility maps as a product: which anchors are seen from where."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from dem_samples import load_sample
from service.estimates import Demand, sight_lines
from service.parts.doubts import doubted_anchors
from service.parts.map_area import map_area
from service.parts.shapes_in_grid import anchors_in_grid
from service.products import Product, WarmUp
from service.products.in_common import signals_demand
from service.settings import Settings
from terrain import ElevationGrid, height_at
from visibility import FLAT, Anchor, AntennaLimits, Curvature, min_visible_altitude
from visibility.sight import check_anchors

from .calculate import VisibilityMap, VisibilityMapSummary, calculate_visibility_map
from .files import LAYERS
from .request import REQUEST, VisibilityMapIn, VisibilityMapParameters

__all__ = ["VISIBILITY_MAP"]


def _estimate(grid: ElevationGrid, parameters: VisibilityMapParameters) -> Iterator[Demand]:
    yield from sight_lines(grid.heights_m.size, len(parameters.anchors), parameters.mode)
    yield from signals_demand(grid, parameters)


def _check(grid: ElevationGrid, parameters: VisibilityMapParameters, settings: Settings) -> None:
    map_area(grid, parameters.area)
    check_anchors(grid, doubted_anchors(grid, anchors_in_grid(grid, parameters), parameters.doubts)[0])


def _fast_maps(grid: ElevationGrid) -> None:
    load_sample("jacksboro")  # in degrees, so it is warped
    height_at(grid, [10.0, 20.0], [-30.0, -40.0])
    _minimum_altitudes(grid, "fast")


def _exact_maps(grid: ElevationGrid) -> None:
    _minimum_altitudes(grid, "exact")


def _minimum_altitudes(grid: ElevationGrid, mode: Literal["fast", "exact"]) -> None:
    anchors = (
        # from four on the fast sweep turns the whole grid
        *(Anchor(f"inside {n}", 101.0, -77.0 - n, 60.0) for n in range(3)),
        Anchor("outside", -400.0, 90.0, 300.0, limits=AntennaLimits(max_range_m=5_000.0)),
    )
    for curvature in (FLAT, Curvature(6_371_000.0, 4.0 / 3.0)):
        answer = min_visible_altitude(grid, anchors, mode, curvature)
        answer.visible(above_ground_m=1.5)
        answer.margin_m(altitude_m=50.0)


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
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_fast_maps, "maps"), WarmUp(_exact_maps, "beside")),
    calculate=calculate_visibility_map,
    layers=LAYERS,
    finished=VisibilityMap,
    arrays=("visible", "altitude_m", "count", "unknown_count", "margin_db"),
)
