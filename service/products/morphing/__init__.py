"""Morphing maps as a product: above which altitude positioning is good enough."""

from __future__ import annotations

from pydantic import ConfigDict, JsonValue

from service.estimates import refuse_frames, refuse_map
from service.parts.map_area import map_area
from service.parts.map_facts import DemId
from service.parts.positioning import POSITIONING_EXAMPLE, MorphingMapParameters
from service.parts.ranging_sources import check_moving_sources, check_sources, moving_sources, ranging_sources
from service.products import Product
from service.settings import Settings
from terrain import ElevationGrid
from visibility.air.morphing_maps import check_ceiling

from .calculate import FinishedMorphingMap, MorphingMapSummary, calculate_morphing_map
from .files import LAYERS

__all__ = ["MORPHING_MAP", "REQUEST", "MorphingMapIn"]

REQUEST: dict[str, JsonValue] = {**POSITIONING_EXAMPLE, "dop_limit": 5.0, "ceiling_altitude_m": 2500.0}


class MorphingMapIn(MorphingMapParameters):
    """A DEM, anchors or satellites, and how good positioning must be up to which ceiling."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId


def _check(grid: ElevationGrid, parameters: MorphingMapParameters, settings: Settings) -> None:
    cells, mode, frames = grid.heights_m.size, parameters.mode, parameters.frames
    refuse_map(cells, len(parameters.anchors), mode, settings)
    check_ceiling(map_area(grid, parameters.area).box, *parameters.ceiling())
    if frames is None:
        sources = ranging_sources(grid, parameters).all
        check_sources(grid, sources, parameters)
        refuse_map(cells, len(sources), mode, settings)
        return
    most = max(len(here) for here in check_moving_sources(grid, parameters, frames))
    refuse_map(cells, most, mode, settings)
    moving = moving_sources(grid, parameters, frames).moving
    refuse_frames(cells, len(frames.times_s()), moving, mode, settings)


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
    check=_check,
    calculate=calculate_morphing_map,
    layers=LAYERS,
    finished=FinishedMorphingMap,
    arrays=(
        *("altitude_m", "safe_above_m", "state", "no_flight_intervals", "dop", "no_go"),
        *("frame_altitude_m", "frame_state", "available"),
    ),
)
