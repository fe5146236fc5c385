"""Maps of sites as a product: how much of the ground each post would see, and the posts that see most."""

from __future__ import annotations

from service.estimates import refuse_site_map
from service.parts.map_area import map_area
from service.products import Product
from service.settings import Settings
from terrain import ElevationGrid

from .calculate import FinishedSiteMap, SiteMapSummary, calculate_site_map
from .files import LAYERS
from .request import REQUEST, SiteMapIn, SiteMapParameters

__all__ = ["SITE_MAP"]


def _check(grid: ElevationGrid, parameters: SiteMapParameters, settings: Settings) -> None:
    steps = max(grid.shape)
    if parameters.max_range_m is not None:
        steps = min(steps, int(parameters.max_range_m / min(grid.cell_east_m, grid.cell_north_m)) + 1)
    refuse_site_map(grid.heights_m.size, parameters.directions, steps, settings)
    map_area(grid, parameters.area)
    map_area(grid, parameters.target_area)


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
    check=_check,
    calculate=calculate_site_map,
    layers=LAYERS,
    finished=FinishedSiteMap,
    arrays=("seen", "seen_undecided", "seen_from", "from_undecided"),
)
