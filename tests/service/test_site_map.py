"""Maps of sites as a product: what the library tells, sites by name, areas, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from service.errors import LimitError
from service.products.sites import SITE_MAP
from service.products.sites.calculate import FinishedSiteMap, calculate_site_map
from service.products.sites.request import SiteMapParameters
from service.settings import Settings
from terrain import AreaError
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from visibility.sites import best_sites, site_map

AREA = {"west_m": WEST_M + 100.0, "south_m": NORTH_M - 300.0, "east_m": WEST_M + 500.0, "north_m": NORTH_M - 100.0}


def asked(**fields: object) -> FinishedSiteMap:
    return calculate_site_map(small_grid(), SiteMapParameters.model_validate({"directions": 32, **fields}))


def test_it_tells_what_the_library_tells() -> None:
    finished = asked(site_above_ground_m=30.0, max_range_m=400.0, sites=4, min_separation_m=120.0)
    grid = small_grid()
    sees = site_map(grid, 30.0, 1.5, max_range_m=400.0, directions=32)
    seen = site_map(grid, 1.5, 30.0, max_range_m=400.0, directions=32)
    assert np.array_equal(finished.seen, sees.seen_share, equal_nan=True)
    assert np.array_equal(finished.seen_from, seen.seen_share, equal_nan=True)
    assert np.isnan(finished.seen).sum() == grid.unknown_posts > 0
    assert float(np.nanmax(finished.seen_undecided)) > 0.0
    named = [(site.east_m, site.north_m, site.seen_m2) for site in finished.answer.sites]
    assert named == [(site.east_m, site.north_m, site.seen_m2) for site in best_sites(sees, 4, 120.0)]
    assert [site.id for site in finished.answer.sites] == ["S1", "S2", "S3", "S4"]
    assert finished.answer.seen_share_quantiles["most"] == pytest.approx(float(np.nanmax(sees.seen_share)))


def test_in_an_area_the_same_is_told_and_sites_stand_there() -> None:
    whole, part = asked(sites=3), asked(sites=3, area=AREA)
    rows, cols = part.grid.shape
    row = round((whole.grid.origin_north_m - part.grid.origin_north_m) / whole.grid.cell_north_m)
    col = round((part.grid.origin_east_m - whole.grid.origin_east_m) / whole.grid.cell_east_m)
    same = whole.seen[row : row + rows, col : col + cols]
    assert part.seen.shape == (rows, cols) != whole.seen.shape
    assert np.array_equal(part.seen, same, equal_nan=True)
    assert all(
        AREA["west_m"] <= site.east_m <= AREA["east_m"] and AREA["south_m"] <= site.north_m <= AREA["north_m"]
        for site in part.answer.sites
    )
    assert any("is for an area of" in warning for warning in part.answer.warnings)


def test_only_the_target_area_counts() -> None:
    finished = asked(target_area=AREA, sites=1)
    cell_m2 = finished.grid.cell_east_m * finished.grid.cell_north_m
    within = site_map(small_grid(), 10.0, 1.5, directions=32)
    assert finished.answer.target_m2 < within.target_m2
    assert finished.answer.target_m2 % cell_m2 == 0.0
    assert finished.answer.sites[0].seen_m2 <= finished.answer.target_m2


def test_fewer_sites_than_asked_are_told() -> None:
    finished = asked(sites=50, min_separation_m=600.0)
    told = len(finished.answer.sites)
    assert told < 50
    assert (
        f"Only {told} of 50 sites stand 600 m apart on ground that sees any of the target." in finished.answer.warnings
    )
    apart = finished.answer.sites
    assert all(
        math.hypot(a.east_m - b.east_m, a.north_m - b.north_m) >= 600.0 for n, a in enumerate(apart) for b in apart[:n]
    )


def test_what_would_take_too_long_or_lies_elsewhere_is_refused() -> None:
    with pytest.raises(LimitError, match=r"directions of .* steps over .* cells would take about"):
        SITE_MAP.refuse(small_grid(), SiteMapParameters(directions=7200), Settings(max_job_s=0.1))
    far = {name: value + 1e6 for name, value in AREA.items()}
    with pytest.raises(AreaError):
        SITE_MAP.refuse(small_grid(), SiteMapParameters.model_validate({"target_area": far}), Settings())
