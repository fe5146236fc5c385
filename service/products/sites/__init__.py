"""Maps of sites as a product: how much of the ground each post would see, and the posts that see most."""

from __future__ import annotations

from service.estimates import Demand, calculation
from service.parts.map_area import map_area
from service.products import Product, WarmUp
from service.settings import Settings
from terrain import ElevationGrid
from visibility.sites import site_map

from .calculate import FinishedSiteMap, SiteMapSummary, calculate_site_map
from .files import LAYERS
from .request import REQUEST, SiteMapIn, SiteMapParameters

__all__ = ["SITE_MAP"]


# what is seen of each post and from it, with and without unknown ground, turned four ways; one step of a ray
BYTES_PER_CELL, SECONDS_PER_STEP = 80, 1e-9


def _estimate(grid: ElevationGrid, parameters: SiteMapParameters) -> tuple[Demand, Demand]:
    cells, directions = grid.heights_m.size, parameters.directions
    steps = max(grid.shape)
    if parameters.max_range_m is not None:
        steps = min(steps, int(parameters.max_range_m / min(grid.cell_east_m, grid.cell_north_m)) + 1)
    what = f"{directions} directions of {steps:,} steps over {cells:,} cells"
    seconds = cells * directions * steps * SECONDS_PER_STEP
    return calculation(what, cells * BYTES_PER_CELL, seconds, "fewer directions, a shorter range, or a smaller DEM")


def _check(grid: ElevationGrid, parameters: SiteMapParameters, settings: Settings) -> None:
    map_area(grid, parameters.area)
    map_area(grid, parameters.target_area)


def _few_directions(grid: ElevationGrid) -> None:
    site_map(grid, 10.0, 1.5, directions=16)


SITE_MAP = Product(
    name="site-map",
    title="map of sites",
    plural="site_maps",
    model="SiteMap",
    tag="Maps of sites",
    summary="How much of the ground each post would see as a site.",
    about="How much of the ground every post of a DEM would see as a site, all at once, and which posts see most: "
    "where to look before anchors are placed.",
    asked=SiteMapIn,
    parameters=SiteMapParameters,
    answer=SiteMapSummary,
    example=REQUEST,
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_few_directions),),
    calculate=calculate_site_map,
    layers=LAYERS,
    finished=FinishedSiteMap,
    arrays=("seen", "seen_undecided", "seen_from", "from_undecided"),
)
