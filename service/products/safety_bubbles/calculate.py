"""Safety bubbles along a path or for a history of poses, as the service answers them."""

from __future__ import annotations

import functools
import importlib.metadata
import time
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field, JsonValue

from navigation import BubbleVerdict, MotionNoise
from planning.bubbles import BubbleFilter, PathBubbles, bubbles_along, way_m
from service.parts.cover import buildings_of
from service.parts.map_area import map_area
from service.parts.map_facts import Ground, curvature_of, ground_of
from service.parts.positioning_answers import (
    PlacedAnchor,
    PlacedSatellite,
    placed_anchors,
    placed_satellites,
    range_sigmas_told,
)
from service.parts.radios import Sight
from service.parts.ranging_sources import Source
from service.parts.sentences import told_as_asked
from service.products import UNWATCHED, Work
from service.products.in_common import QUANTILES
from terrain import ElevationGrid
from visibility import Buildings
from visibility.cover import standing_mesh, with_standing

from .request import BubbleParameters, bubble_sources, check_bubble_question, given_covariances

__all__ = [
    "BubbleOut",
    "BuildingFacts",
    "FinishedBubbles",
    "FirstViolation",
    "SafetyBubblesSummary",
    "calculate_bubbles",
]

Array = npt.NDArray[np.float64]
Verdict = Literal["ok", "violated", "unknown"]
WORDS: dict[BubbleVerdict, Verdict] = {
    BubbleVerdict.OK: "ok",
    BubbleVerdict.VIOLATED: "violated",
    BubbleVerdict.UNKNOWN: "unknown",
}
DECIMALS = 6


class BubbleOut(BaseModel):
    """The bubble at one point."""

    time_s: float = Field(description="When, seconds.")
    distance_m: float = Field(description="Way along the path up to here, metres.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Altitude in the DEM's vertical datum, metres.")
    radius_m: float = Field(description="Radius of the bubble, metres.")
    promise: float = Field(
        description="Probability that a bubble of this covariance, without dem_sigma_m, holds it, 0..1."
    )
    clearance_m: float = Field(
        description="Distance to the nearest ground or building in space, metres; negative: below or inside."
    )
    margin_m: float = Field(description="Clearance less radius, metres.")
    nearest: Literal["ground", "building"] = Field("ground", description="What that nearest place belongs to.")
    verdict: Literal["ok", "violated", "unknown"] = Field(
        description="unknown: unknown ground may be nearer than the radius."
    )
    push: tuple[float, float, float] = Field(
        description="Unit vector away from that place, or out through it: east, north, up."
    )
    push_m: float = Field(description="How far to go that way, metres; 0 where all is well.")
    in_sight: list[str] | None = Field(description="Anchors surely in sight; null in a history of poses.")


class FirstViolation(BaseModel):
    """The first point whose bubble touches the ground or a building."""

    point: int = Field(description="Its number, 0 the first.")
    time_s: float = Field(description="When, seconds.")
    distance_m: float = Field(description="Way along the path up to there, metres.")
    radius_m: float = Field(description="Radius, metres.")
    clearance_m: float = Field(description="Clearance, metres.")
    margin_m: float = Field(description="Clearance less radius, metres.")
    nearest: Literal["ground", "building"] = Field("ground", description="What it touches.")
    in_sight: list[str] | None = Field(description="Anchors surely in sight there; null in a history of poses.")


class BuildingFacts(BaseModel):
    """A building mesh."""

    name: str = Field(description="Name of its file.")
    bodies: int = Field(description="Number of bodies.")
    triangles: int = Field(description="Number of triangles.")
    points_nearest: int = Field(description="Number of points that it is nearest to.")


class SafetyBubblesSummary(BaseModel):
    """All bubbles in numbers, and how far to trust them."""

    points: int = Field(description="Number of points.")
    ok: int = Field(description="Number of points whose bubble is clear of ground and buildings.")
    violated: int = Field(description="Number of points whose bubble is not.")
    unknown: int = Field(description="Number of points near unknown ground.")
    first_violation: FirstViolation | None = Field(description="The first violated point; null where there is none.")
    least_margin_m: float = Field(description="Smallest margin, metres.")
    radius_quantiles_m: dict[str, float] = Field(description="p05, p50 and p95 of the radius, metres.")
    epsilon: float = Field(description="How many sigmas the radius is, no unit.")
    sight: Sight = "visible"
    sigmas: str = Field("", description="One-sigma errors of ranges, and of anchors' places, behind it, in words.")
    least_promise: float = Field(description="Smallest promise of all points, 0..1.")
    error_statement: str | None = Field(description="Error of the sight lines; null in a history of poses.")
    curvature: str | None = Field(description="Curvature and refraction that were used; null in a history of poses.")
    dem: Ground
    buildings: BuildingFacts | None = Field(None, description="The building mesh; null without one.")
    anchors: list[PlacedAnchor]
    satellites: list[PlacedSatellite]
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    version: str = Field(description="Version of Sightline that calculated it.")


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
    def columns(self) -> dict[str, list[Any]]:
        """The fields of ``BubbleOut``, each with a value per point; models would take seconds for 100 000 points."""
        check = self.bubbles.check
        columns: dict[str, list[Any]] = {name: _rounded(values) for name, values in self.numbers().items()}
        columns["nearest"] = list(self.bubbles.around.words())
        columns["verdict"] = [WORDS[BubbleVerdict(int(verdict))] for verdict in check.verdict]
        columns["push"], columns["push_m"] = _rounded(check.push), _rounded(check.push_m)
        columns["in_sight"] = [_in_sight(self.anchors, self.bubbles, point) for point in range(len(self.points_m))]
        return columns

    @functools.cached_property
    def points(self) -> list[dict[str, JsonValue]]:
        """One entry per point, as ``BubbleOut`` has it."""
        return [dict(zip(self.columns, row, strict=True)) for row in zip(*self.columns.values(), strict=True)]


@told_as_asked
def calculate_bubbles(grid: ElevationGrid, parameters: BubbleParameters, work: Work = UNWATCHED) -> FinishedBubbles:
    """The bubbles that are asked for. Raises as check_bubble_question."""
    started_s = time.perf_counter()
    area = map_area(grid, parameters.area)
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
        progress=work.progress,
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
        sight=parameters.sight,
        sigmas="" if parameters.covariances_m2 is not None else range_sigmas_told(sources.all),
        least_promise=float(found.promise.min()),
        error_statement=None if sight is None else sight.error_statement,
        curvature=None if sight is None else sight.curvature.sentence(),
        dem=ground_of(area.box),
        buildings=_building_facts(buildings, found),
        anchors=placed_anchors(grid, sources.all),
        satellites=placed_satellites(sources.all),
        warnings=[*grid.provenance.warnings, *sources.warnings, *area.sentences(), *found.warnings],
        timing={"calculation_s": time.perf_counter() - started_s},
        version=importlib.metadata.version("sightline"),
    )
    drawn = area.box if buildings is None else with_standing(area.box, [standing_mesh(buildings)])
    return FinishedBubbles(drawn, sources.all, parameters, answer, points_m, times_s, found)


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
