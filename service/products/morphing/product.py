"""Morphing maps as a product."""

from __future__ import annotations

from service.estimates import refuse_frames, refuse_map
from service.parts.map_area import map_area
from service.parts.moving_sources import check_moving_sources, moving_sources
from service.parts.positioning import MorphingMapParameters
from service.parts.ranging_sources import check_sources, ranging_sources
from service.products.product import Product, Work
from service.settings import Settings
from terrain import ElevationGrid
from visibility.air.morphing_maps import check_ceiling

from .answer import MorphingMapSummary
from .calculate import FinishedMorphingMap, calculate_morphing_map
from .files import LAYERS
from .request import REQUEST, MorphingMapIn

__all__ = ["MORPHING_MAP"]


def _check(grid: ElevationGrid, parameters: MorphingMapParameters, settings: Settings) -> None:
    cells, mode, frames = grid.heights_m.size, parameters.mode, parameters.frames
    refuse_map(cells, len(parameters.anchors), mode, settings)
    map_area(grid, parameters.area)
    if frames is None:
        sources = ranging_sources(grid, parameters).all
        check_sources(grid, sources, parameters)
        refuse_map(cells, len(sources), mode, settings)
        return
    check_ceiling(grid, *parameters.ceiling())
    most = max(len(here) for here in check_moving_sources(grid, parameters, frames))
    refuse_map(cells, most, mode, settings)
    moving = moving_sources(grid, parameters, frames).moving
    refuse_frames(cells, len(frames.times_s()), moving, mode, settings)


def _calculate(grid: ElevationGrid, parameters: MorphingMapParameters, work: Work) -> FinishedMorphingMap:
    return calculate_morphing_map(grid, parameters, work.progress)


MORPHING_MAP = Product(
    name="morphing-map",
    title="morphing map",
    plural="morphing_maps",
    model="MorphingMap",
    tag="Morphing maps",
    summary="Above which altitude positioning is good enough.",
    about="Above which altitude positioning is good enough up to a ceiling, over a whole DEM.",
    asked=MorphingMapIn,
    parameters=MorphingMapParameters,
    answer=MorphingMapSummary,
    example=REQUEST,
    check=_check,
    calculate=_calculate,
    layers=LAYERS,
    finished=FinishedMorphingMap,
    arrays=(
        *("altitude_m", "safe_above_m", "state", "no_flight_intervals", "dop", "no_go"),
        *("frame_altitude_m", "frame_state", "available"),
    ),
)
