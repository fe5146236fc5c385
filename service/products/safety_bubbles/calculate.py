"""Safety bubbles along a path or for a history of poses, as the service answers them."""

from __future__ import annotations

import functools
import importlib.metadata
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from navigation import BubbleVerdict, MotionNoise
from planning.bubbles import BubbleFilter, PathBubbles, bubbles_along, way_m
from service.parts.map_facts import curvature_of, ground_of
from service.parts.positioning_answers import placed_anchors, placed_satellites
from service.parts.ranging_sources import Source
from service.parts.sentences import told_as_asked
from service.products.safety_bubbles.answer import BuildingFacts, FirstViolation, SafetyBubblesSummary
from service.products.safety_bubbles.question import (
    bubble_sources,
    buildings_of,
    check_bubble_question,
    given_covariances,
)
from service.products.safety_bubbles.request import BubbleParameters
from terrain import ElevationGrid
from visibility import Buildings

__all__ = ["FinishedBubbles", "calculate_bubbles"]

Array = npt.NDArray[np.float64]
Point = dict[str, Any]  # as BubbleOut has it: a hundred thousand models would take seconds
Verdict = Literal["ok", "violated", "unknown"]
WORDS: dict[BubbleVerdict, Verdict] = {
    BubbleVerdict.OK: "ok",
    BubbleVerdict.VIOLATED: "violated",
    BubbleVerdict.UNKNOWN: "unknown",
}
DECIMALS = 6
QUANTILES = {"p05": 0.05, "p50": 0.5, "p95": 0.95}


@dataclass(frozen=True, eq=False)
class FinishedBubbles:
    """Bubbles at n points; bubbles: what was found at each of them."""

    grid: ElevationGrid
    anchors: tuple[Source, ...]
    parameters: BubbleParameters
    answer: SafetyBubblesSummary
    points_m: Array
    times_s: Array
    bubbles: PathBubbles

    @property
    def distance_m(self) -> Array:
        """(n,) way along the path."""
        return way_m(self.points_m)

    def numbers(self) -> dict[str, Array]:
        """What is told of each point in one number, (n,) each."""
        east_m, north_m, altitude_m = self.points_m.T
        return {
            "time_s": self.times_s,
            "distance_m": self.distance_m,
            "east_m": east_m,
            "north_m": north_m,
            "altitude_m": altitude_m,
            "radius_m": self.bubbles.radius_m,
            "promise": self.bubbles.promise,
            "clearance_m": self.bubbles.around.distance_m,
            "margin_m": self.bubbles.check.margin_m,
        }

    @functools.cached_property
    def points(self) -> list[Point]:
        """One entry per point, as ``BubbleOut`` has it; made column by column, because there may be 100 000."""
        check = self.bubbles.check
        columns: dict[str, list[Any]] = {name: _rounded(values) for name, values in self.numbers().items()}
        columns["nearest"] = list(self.bubbles.around.words())
        columns["verdict"] = [WORDS[BubbleVerdict(int(verdict))] for verdict in check.verdict]
        columns["push"], columns["push_m"] = _rounded(check.push), _rounded(check.push_m)
        columns["in_sight"] = [_in_sight(self.anchors, self.bubbles, point) for point in range(len(self.points_m))]
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


@told_as_asked
def calculate_bubbles(
    grid: ElevationGrid, parameters: BubbleParameters, progress: Callable[[float], None] | None = None
) -> FinishedBubbles:
    """The bubbles that are asked for; progress is called with the finished share. Raises as check_bubble_question."""
    started_s = time.perf_counter()
    _, points_m, times_s = check_bubble_question(grid, parameters)
    sources = bubble_sources(grid, parameters)
    buildings = buildings_of(grid, parameters.buildings)
    motion = parameters.motion
    found = bubbles_along(
        grid,
        points_m,
        times_s,
        sources.all,
        epsilon=parameters.epsilon,
        dem_sigma_m=parameters.dem_sigma_m,
        filter=BubbleFilter(
            kind=parameters.kind,
            motion=MotionNoise(
                motion.horizontal_m2_per_s3, motion.horizontal_m2_per_s3, motion.up_m2_per_s3, motion.clock_m2_per_s3
            ),
            position_sigma_m=parameters.initial_position_sigma_m,
            velocity_sigma_m_per_s=parameters.initial_velocity_sigma_m_per_s,
            interval_s=parameters.ranging_interval_s,
            dop_scaled=parameters.dop_scaled,
            on_ground=parameters.on_ground,
            ground_sigma_m=parameters.ground_sigma_m,
        ),
        covariance_m2=None if parameters.covariances_m2 is None else given_covariances(parameters),
        buildings=buildings,
        under_ground=parameters.under_ground,
        mode=parameters.mode,
        curvature=curvature_of(parameters),
        unknown=parameters.unknown,
        progress=progress,
    )
    check, sight = found.check, found.sight
    answer = SafetyBubblesSummary(
        points=len(points_m),
        ok=check.count(BubbleVerdict.OK),
        violated=check.count(BubbleVerdict.VIOLATED),
        unknown=check.count(BubbleVerdict.UNKNOWN),
        first_violation=_first_violation(points_m, times_s, sources.all, found),
        least_margin_m=float(check.margin_m.min()),
        radius_quantiles_m={name: float(np.quantile(found.radius_m, share)) for name, share in QUANTILES.items()},
        epsilon=parameters.epsilon,
        least_promise=float(found.promise.min()),
        error_statement=None if sight is None else sight.error_statement,
        curvature=None if sight is None else sight.curvature.sentence(),
        dem=ground_of(grid),
        buildings=_building_facts(buildings, found),
        anchors=placed_anchors(grid, sources.all),
        satellites=placed_satellites(sources.all),
        warnings=[*grid.provenance.warnings, *sources.warnings, *found.warnings],
        timing={"calculation_s": time.perf_counter() - started_s},
        version=importlib.metadata.version("sightline"),
    )
    return FinishedBubbles(grid, sources.all, parameters, answer, points_m, times_s, found)


def _building_facts(buildings: Buildings | None, found: PathBubbles) -> BuildingFacts | None:
    if buildings is None:
        return None
    return BuildingFacts(
        name=buildings.source,
        bodies=buildings.count,
        triangles=len(buildings.faces),
        points_nearest=int(np.count_nonzero(found.around.at_building)),
    )


def _first_violation(
    points_m: Array, times_s: Array, anchors: tuple[Source, ...], found: PathBubbles
) -> FirstViolation | None:
    first = found.check.first_violation
    if first is None:
        return None
    return FirstViolation(
        point=first,
        time_s=float(times_s[first]),
        distance_m=float(way_m(points_m)[first]),
        radius_m=float(found.radius_m[first]),
        clearance_m=float(found.around.distance_m[first]),
        margin_m=float(found.check.margin_m[first]),
        nearest=found.around.words()[first],
        in_sight=_in_sight(anchors, found, first),
    )


def _in_sight(anchors: tuple[Source, ...], found: PathBubbles, point: int) -> list[str] | None:
    """Ids of the anchors in sight of a point."""
    if found.visible is None:
        return None
    return [anchors[number].id for number in np.flatnonzero(found.visible[point])]


def _rounded(values: Array) -> list[Any]:
    rounded: list[Any] = np.round(values, DECIMALS).tolist()
    return rounded
