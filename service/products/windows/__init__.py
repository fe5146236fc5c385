"""Maps by windows as a product: visibility of anchors with a range limit, over rasters of any size."""

from __future__ import annotations

from collections.abc import Iterable

from service.estimates import SECONDS_PER_CELL_AND_ANCHOR, Demand, calculation, signals_over
from service.products import Product, WarmUp
from service.settings import Settings
from terrain import ElevationGrid
from visibility import Anchor, AntennaLimits
from visibility.sight import ReachOptions, in_reach, reach_of
from visibility.sight.in_reach import work_bytes

from .answer import WindowMapSummary
from .calculate import calculate_window_map, check_room, scheduler_of
from .files import LAYERS
from .ground import prepared, raster_of
from .request import REQUEST, WindowMapIn, WindowMapParameters

__all__ = ["WINDOW_MAP"]

# of an answer that lies on disk until its rows are written, mapped: float32 and uint8
MAPPED_BYTES_PER_POST = 5


def _estimate(grid: ElevationGrid, parameters: WindowMapParameters) -> Iterable[Demand]:
    yield Demand("max_anchors", len(parameters.anchors), f"{len(parameters.anchors)} anchors are")
    request = prepared(raster_of(grid), parameters)
    memory_bytes = work_bytes(request.largest[1]) + MAPPED_BYTES_PER_POST * request.posts_in_a_row
    seconds = request.posts * SECONDS_PER_CELL_AND_ANCHOR[parameters.mode]
    what = f"{request.posts:,} posts in reach of {len(request.reaches)} anchors"
    yield from calculation(what, memory_bytes, seconds, "shorter ranges, or fewer anchors at once")
    if parameters.usable:
        yield signals_over(request.largest[1], len(request.reaches), trees=False)


def _check(grid: ElevationGrid, parameters: WindowMapParameters, settings: Settings) -> None:
    dem = raster_of(grid)
    scheduler_of(parameters, dem, settings.dask_scheduler)
    check_room(prepared(dem, parameters), settings.data_folder)


def _one_anchor(grid: ElevationGrid) -> None:
    limits = AntennaLimits(max_range_m=5_000.0)
    anchor = Anchor("A", 101.0, -77.0, 60.0, limits=limits)
    reach = reach_of(grid, anchor)
    assert reach is not None, "it stands on the grid"
    in_reach(grid, anchor, reach, ReachOptions(above_ground_m=1.5, altitude_m=None))


WINDOW_MAP = Product(
    name="window-map",
    title="window map",
    plural="window_maps",
    model="WindowMap",
    tag="Window maps",
    summary="How many anchors are seen, over ground of any size that is read by windows.",
    about="How many anchors are in sight, and from how low, of anchors that all have a range limit: over a DEM larger "
    "than memory, of which only the ground in reach is read, an anchor at a time. `POST /dems` with a `tile` of the "
    "ground library names such a DEM; any other will do too. Without a range limit it is refused with what it would "
    "take.",
    asked=WindowMapIn,
    parameters=WindowMapParameters,
    answer=WindowMapSummary,
    example=REQUEST,
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_one_anchor),),
    calculate=calculate_window_map,
    layers=LAYERS,
)
