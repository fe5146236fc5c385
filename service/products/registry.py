"""The kinds of maps: what each is asked for, how it is checked and calculated, and what it is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, Protocol

from service.estimates import refuse_frames, refuse_map, refuse_placement, refuse_volume
from service.parts.map_facts import Calculation
from service.parts.moving_sources import check_moving_sources, moving_sources
from service.parts.positioning import DopMapParameters, MorphingMapParameters, PositioningParameters
from service.parts.positions import resolve_anchor
from service.parts.ranging_sources import check_sources, ranging_sources
from service.parts.sight import SightParameters
from service.products.dop.calculate import FinishedDopMap, calculate_dop_map
from service.products.dop.paths import path_points
from service.products.dop.volumes import check_air
from service.products.flights.calculate import FinishedFlight, calculate_flight, check_flight_request, refuse_flight
from service.products.flights.request import FlightParameters
from service.products.morphing.calculate import FinishedMorphingMap, calculate_morphing_map
from service.products.paths.calculate import FinishedPath, calculate_path, check_path_request, refuse_path
from service.products.paths.request import PathParameters
from service.products.placements.calculate import FinishedPlacement, calculate_placement, check_placement_request
from service.products.placements.request import PlacementParameters
from service.products.repositionings.calculate import (
    FinishedRepositioning,
    calculate_repositioning,
    check_repositioning_request,
    refuse_repositioning,
)
from service.products.repositionings.request import RepositioningParameters
from service.products.visibility.calculate import VisibilityMap, calculate
from service.products.visibility.request import VisibilityMapParameters
from service.settings import Settings
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor, check_anchors
from visibility.air.morphing_maps import check_ceiling

__all__ = [
    "DOP_MAP",
    "FLIGHT",
    "MORPHING_MAP",
    "PATH",
    "PLACEMENT",
    "PRODUCTS",
    "REPOSITIONING",
    "VISIBILITY_MAP",
    "FinishedMap",
    "Product",
    "product_of",
]


class FinishedMap(Protocol):
    """What all finished maps have in common; their arrays are attributes of their own."""

    @property
    def grid(self) -> ElevationGrid:
        """The ground it lies on."""
        ...

    @property
    def anchors(self) -> tuple[Anchor | DistantAnchor, ...]:
        """In the grid's frame."""
        ...

    @property
    def parameters(self) -> SightParameters:
        """What was asked."""
        ...

    @property
    def calculation(self) -> Calculation:
        """How it came about."""
        ...

    def summary(self) -> dict[str, Any]:
        """What the map says in numbers, ready for JSON."""
        ...


@dataclass(frozen=True, slots=True)
class Product:
    """One kind of map.

    name: as jobs are called. check: refuses what cannot be calculated, before anything big is allocated, and tells
    how many anchors and satellites (or candidates) there are. refuse: whether so many of them over so many cells are
    beyond the limits; refuse_more: the same for what only maps of this kind are asked for. finished: the type of its
    maps, made from grid, anchors, parameters, calculation and, by name, the arrays and what is plain: values that are
    JSON as they are. searches: it can end early with the best so far: ``calculate`` also takes ``stop``; spreads: it
    can be spread over a cluster, and takes ``scheduler``.
    """

    name: str
    parameters: type[SightParameters]
    check: Callable[[ElevationGrid, Any], int]
    calculate: Callable[..., FinishedMap]
    finished: Callable[..., FinishedMap]
    arrays: tuple[str, ...]
    refuse: Callable[[int, int, Literal["fast", "exact"], Settings], None] = refuse_map
    plain: tuple[str, ...] = ()
    refuse_more: Callable[[ElevationGrid, Any, Settings], None] | None = None
    searches: bool = False
    spreads: bool = False


def _check_visibility_map(grid: ElevationGrid, parameters: VisibilityMapParameters) -> int:
    check_anchors(grid, [resolve_anchor(grid, anchor) for anchor in parameters.anchors])
    return len(parameters.anchors)


def _check_positioning(grid: ElevationGrid, parameters: PositioningParameters) -> int:
    sources = ranging_sources(grid, parameters).all
    check_sources(grid, sources, parameters)
    return len(sources)


def _check_dop_map(grid: ElevationGrid, parameters: DopMapParameters) -> int:
    path_points(grid, parameters)
    return _check_positioning(grid, parameters)


def _check_morphing_map(grid: ElevationGrid, parameters: MorphingMapParameters) -> int:
    if parameters.frames is None:
        return _check_positioning(grid, parameters)
    check_ceiling(grid, *parameters.ceiling())
    return max(len(here) for here in check_moving_sources(grid, parameters, parameters.frames))


def _refuse_frames(grid: ElevationGrid, parameters: MorphingMapParameters, settings: Settings) -> None:
    if parameters.frames is not None:
        sources = moving_sources(grid, parameters, parameters.frames)
        frames = len(parameters.frames.times_s())
        refuse_frames(grid.heights_m.size, frames, sources.moving, parameters.mode, settings)


def _refuse_air(grid: ElevationGrid, parameters: DopMapParameters, settings: Settings) -> None:
    refuse_volume(check_air(grid, parameters), settings)


VISIBILITY_MAP = Product(
    "visibility-map",
    VisibilityMapParameters,
    _check_visibility_map,
    calculate,
    VisibilityMap,
    ("visible", "altitude_m", "count", "unknown_count"),
)
DOP_MAP = Product(
    "dop-map",
    DopMapParameters,
    _check_dop_map,
    calculate_dop_map,
    FinishedDopMap,
    ("dop", "reasons", "count", "no_go", "sigmas_m", "path_numbers", "path_sets", "min_altitude_m", "hidden_below_m"),
    refuse_more=_refuse_air,
)
MORPHING_MAP = Product(
    "morphing-map",
    MorphingMapParameters,
    _check_morphing_map,
    calculate_morphing_map,
    FinishedMorphingMap,
    (
        *("altitude_m", "safe_above_m", "state", "no_flight_intervals", "dop", "no_go"),
        *("frame_altitude_m", "frame_state", "available"),
    ),
    plain=("frame_sources",),
    refuse_more=_refuse_frames,
)
PLACEMENT = Product(
    "placement",
    PlacementParameters,
    check_placement_request,
    calculate_placement,
    FinishedPlacement,
    ("count_before", "count_after", "dop_before", "dop_after", "is_target"),
    refuse_placement,
    ("answer",),
    searches=True,
    spreads=True,
)
PATH = Product(
    "path",
    PathParameters,
    check_path_request,
    calculate_path,
    FinishedPath,
    ("vertices", "visible", "corners", "dop", "count", "reasons"),
    plain=("answer",),
    refuse_more=refuse_path,
    searches=True,
)
FLIGHT = Product(
    "flight",
    FlightParameters,
    check_flight_request,
    calculate_flight,
    FinishedFlight,
    ("corners_m", "air"),
    plain=("answer",),
    refuse_more=refuse_flight,
    searches=True,
)
REPOSITIONING = Product(
    "repositioning",
    RepositioningParameters,
    check_repositioning_request,
    calculate_repositioning,
    FinishedRepositioning,
    ("point_m", "good"),
    plain=("answer",),
    refuse_more=refuse_repositioning,
)
PRODUCTS: Mapping[str, Product] = MappingProxyType(
    {p.name: p for p in (VISIBILITY_MAP, DOP_MAP, MORPHING_MAP, PLACEMENT, PATH, FLIGHT, REPOSITIONING)}
)


def product_of(finished: FinishedMap) -> Product:
    """Which kind a map is of."""
    return next(product for product in PRODUCTS.values() if product.finished is type(finished))
