"""Protection levels as a product."""

from __future__ import annotations

from navigation.monitor import ProtectionRisk
from planning.driving import protection_over_map
from service.estimates import Demand, calculation
from service.products import Product, WarmUp
from service.settings import Settings
from terrain import ElevationGrid
from visibility import Anchor

from .calculate import FinishedProtection, ProtectionSummary, calculate_protection, spaced
from .files import LAYERS
from .request import REQUEST, ProtectionLevelsIn, ProtectionParameters, check_protection

__all__ = ["PROTECTION_LEVELS"]

# lines, levels and what is told of both; a sight line, and all hypotheses of a point
BYTES_PER_CELL, SECONDS_PER_LINE, SECONDS_PER_POINT = 60, 2e-5, 2e-5


def _estimate(grid: ElevationGrid, parameters: ProtectionParameters) -> list[Demand]:
    box = spaced(grid, parameters.spacing_m)
    points, anchors = box.heights_m.size + len(parameters.path), len(parameters.anchors)
    seconds = points * (anchors * SECONDS_PER_LINE + SECONDS_PER_POINT)
    told = calculation(f"{points:,} points x {anchors} anchors", points * BYTES_PER_CELL, seconds, "a larger spacing_m")
    return [Demand("max_anchors", anchors, f"{anchors} anchors are"), *told]


def _check(grid: ElevationGrid, parameters: ProtectionParameters, settings: Settings) -> None:
    check_protection(grid, parameters)


def _few_points(grid: ElevationGrid) -> None:
    anchors = [Anchor(name, *at) for name, at in (("A", (100.0, -200.0, 90.0)), ("B", (0.0, -20.0, 90.0)))]
    for clock in (False, True):
        protection_over_map(grid, [[10.0, -10.0, 60.0]] * 2, anchors, risk=ProtectionRisk(), clock=clock)


PROTECTION_LEVELS = Product(
    name="protection-levels",
    title="map of protection levels",
    plural="protection_levels",
    model="ProtectionLevels",
    tag="Protection levels",
    summary="How far off a position may be though nothing is noticed.",
    about="Horizontal and vertical protection levels over a DEM and along a route before it is driven, from the "
    "anchors that will be in sight with some probability, and from every set of ranges that may be wrong.",
    asked=ProtectionLevelsIn,
    parameters=ProtectionParameters,
    answer=ProtectionSummary,
    example=REQUEST,
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_few_points),),
    calculate=calculate_protection,
    layers=LAYERS,
    finished=FinishedProtection,
    arrays=("horizontal", "vertical", "unwatched", "path_numbers"),
)
