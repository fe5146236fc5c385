"""The map of sites: what each post would see, from where each is seen, and the best posts by name."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from service.parts.map_area import map_area
from service.parts.map_facts import MapSummary, curvature_of, preamble
from service.parts.sentences import told_as_asked
from service.products import UNWATCHED, Work
from service.products.in_common import QUANTILES
from terrain import ElevationGrid
from visibility.sites import SiteMap, best_sites, site_map

from .request import SiteMapParameters

__all__ = ["FinishedSiteMap", "SiteMapSummary", "SiteOut", "calculate_site_map"]

Floats = npt.NDArray[np.float32]


class SiteOut(BaseModel):
    """A named site."""

    id: str = Field(description="S1 sees most.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height of its antenna in the DEM's vertical datum, metres.")
    seen_m2: float = Field(description="Target ground that it surely sees, square metres.")
    seen_share: float = Field(description="The same as part of all target ground, 0..1.")


class SiteMapSummary(MapSummary):
    """What the map says in numbers, and the best sites."""

    target_m2: float = Field(description="All target ground, square metres.")
    min_separation_m: float = Field(description="So far apart are the named sites, metres.")
    seen_share_quantiles: dict[str, float | None] = Field(
        description="Part of the target ground that sites see, 0..1: p05, p50, p95, most."
    )
    sites: list[SiteOut] = Field(description="The best sites, most first.")


@dataclass(frozen=True, eq=False)
class FinishedSiteMap:
    """A finished map over the ground or its area; shares 0..1, float32 (rows, cols), NaN over unknown ground.

    seen, seen_undecided: of the target ground that a site over the post surely sees, and sees if unknown ground hides
    nothing. seen_from, from_undecided: of the ground where sites may stand, that from which a receiver over the post
    is seen.
    """

    grid: ElevationGrid
    anchors: tuple[()]
    parameters: SiteMapParameters
    answer: SiteMapSummary
    seen: Floats
    seen_undecided: Floats
    seen_from: Floats
    from_undecided: Floats


@told_as_asked
def calculate_site_map(grid: ElevationGrid, parameters: SiteMapParameters, work: Work = UNWATCHED) -> FinishedSiteMap:
    """The map that the parameters ask for on this grid. Raises VisibilityInputError, AreaError, FrameError."""
    area, target = map_area(grid, parameters.area), map_area(grid, parameters.target_area)
    reach_m = math.inf if parameters.max_range_m is None else parameters.max_range_m
    curvature = curvature_of(parameters)
    heights_m = (parameters.site_above_ground_m, parameters.receiver_above_ground_m)

    def looked(heights_m: tuple[float, float], targets: npt.NDArray[np.bool_], begin: float) -> SiteMap:
        return site_map(
            grid,
            *heights_m,
            targets=targets,
            max_range_m=reach_m,
            directions=parameters.directions,
            curvature=curvature,
            progress=work.part(begin, begin + 0.5),
        )

    sees, seen = looked(heights_m, target.over_all(), 0.0), looked(heights_m[::-1], area.over_all(), 0.5)
    sees, seen = sees.window(*area.window), seen.window(*area.window)
    box = sees.grid
    apart_m = parameters.min_separation_m
    if apart_m is None:
        apart_m = 0.1 * min(box.rows * box.cell_north_m, box.cols * box.cell_east_m)
    known = area.known()
    named = best_sites(sees, parameters.sites, apart_m, known) if parameters.sites else ()
    sites = [
        SiteOut(
            id=f"S{number}",
            east_m=site.east_m,
            north_m=site.north_m,
            altitude_m=site.ground_m + parameters.site_above_ground_m,
            seen_m2=site.seen_m2,
            seen_share=site.seen_share,
        )
        for number, site in enumerate(named, start=1)
    ]
    share = sees.seen_share
    quantiles = {**QUANTILES, "most": 1.0}
    answer = SiteMapSummary(
        **preamble(
            *(box, parameters, sees, (*area.sentences(), *_fewer(parameters.sites, len(sites), apart_m))),
            mode="rays",
            unknown="unknown",
        ),
        timing={"calculation_s": sees.elapsed_s + seen.elapsed_s},
        target_m2=sees.target_m2,
        min_separation_m=apart_m,
        seen_share_quantiles={
            name: float(np.quantile(share[known], part)) if known.any() else None for name, part in quantiles.items()
        },
        sites=sites,
    )
    work.progress(1.0)
    return FinishedSiteMap(
        box,
        (),
        parameters,
        answer,
        share,
        sees.undecided_share,
        seen.seen_share,
        seen.undecided_share,
    )


def _fewer(asked: int, found: int, apart_m: float) -> tuple[str, ...]:
    if found == asked:
        return ()
    return (f"Only {found} of {asked} sites stand {apart_m:g} m apart on ground that sees any of the target.",)
