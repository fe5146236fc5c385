"""Morphing maps as a product: above which altitude positioning is good enough."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import ConfigDict, JsonValue

from service.estimates import Demand, sight_lines
from service.parts.map_area import map_area
from service.parts.map_facts import DemId
from service.parts.positioning import POSITIONING_EXAMPLE, MorphingMapParameters
from service.parts.ranging_sources import (
    check_moving_sources,
    check_sources,
    moving_sources,
    ranging_sources,
)
from service.products import Product, WarmUp
from service.products.in_common import signals_demand
from terrain import ElevationGrid
from visibility import Anchor, FlightLimit, min_visible_altitude, morphing_map
from visibility.air.morphing_maps import check_ceiling

from .calculate import FinishedMorphingMap, MorphingMapSummary, calculate_morphing_map
from .files import LAYERS
from .frames import frames_demand

__all__ = ["MORPHING_MAP", "REQUEST", "MorphingMapIn"]

REQUEST: dict[str, JsonValue] = {**POSITIONING_EXAMPLE, "dop_limit": 5.0, "ceiling_altitude_m": 2500.0}


class MorphingMapIn(MorphingMapParameters):
    """A DEM, anchors or satellites, and how good positioning must be up to which ceiling."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId


def _estimate(grid: ElevationGrid, parameters: MorphingMapParameters) -> Iterator[Demand]:
    cells, mode, frames = grid.heights_m.size, parameters.mode, parameters.frames
    yield from sight_lines(cells, len(parameters.anchors), mode)
    check_ceiling(map_area(grid, parameters.area).box, *parameters.ceiling())
    if frames is None:
        sources = ranging_sources(grid, parameters).all
        check_sources(grid, sources, parameters)
        yield from sight_lines(cells, len(sources), mode)
        yield from signals_demand(grid, parameters)
        return
    most = max(len(here) for here in check_moving_sources(grid, parameters, frames))
    yield from sight_lines(cells, most, mode)
    moving = moving_sources(grid, parameters, frames).moving
    yield from frames_demand(cells, len(frames.times_s()), moving, mode)
    yield from signals_demand(grid, parameters, len(parameters.anchors) + moving * len(frames.times_s()))


def _columns(grid: ElevationGrid) -> None:
    corners = ((10.0, -10.0, 90.0), (250.0, -20.0, 120.0), (20.0, -260.0, 70.0), (240.0, -240.0, 100.0))
    surfaces = min_visible_altitude(grid, [Anchor(f"A{n}", *at) for n, at in enumerate(corners)])
    morphing_map(surfaces, FlightLimit(3.0), ceiling_m=200.0)


MORPHING_MAP = Product(
    name="morphing-map",
    title="morphing map",
    plural="morphing_maps",
    model="MorphingMap",
    tag="Morphing maps",
    summary="Above which altitude positioning is good enough.",
    about="Above which altitude positioning is good enough up to a ceiling, over a DEM.",
    asked=MorphingMapIn,
    parameters=MorphingMapParameters,
    answer=MorphingMapSummary,
    example=REQUEST,
    calculate=calculate_morphing_map,
    layers=LAYERS,
    estimate=_estimate,
    warm_up=(WarmUp(_columns),),
    finished=FinishedMorphingMap,
    arrays=(
        *("altitude_m", "safe_above_m", "state", "no_flight_intervals", "dop", "no_go"),
        *("frame_altitude_m", "frame_state", "available"),
    ),
)
