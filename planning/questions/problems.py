"""The question: from where to where, with which rover, over which ground, under which limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import shapely

from planning.errors import AreaError, PathProblemError
from terrain import ElevationGrid, FrameError, parse_crs, same_map
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude, MovingAnchor
from visibility.air import MorphingMap
from visibility.dilution import DopMap

from .models import CostWeights, NavigationModel, PathLimits, PlanBudget, RoverModel

__all__ = ["FlightProblem", "Goal", "PathProblem", "Place", "check_ground"]

Place = tuple[float, float]
Area: TypeAlias = shapely.Polygon | shapely.MultiPolygon
Goal: TypeAlias = Place | Area
Point = tuple[float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class PathProblem:
    """A path problem; places are (east_m, north_m) in the grid's frame.

    goals: places or areas, any of which will do; one place or area may be given as it is.
    way_points: places to be passed in order. start_heading_rad: clockwise from grid north, for a rover that cannot turn
        on the spot; None = any.
    anchors: what the rover ranges to. maps: what was calculated for them before, which saves its time: minimum visible
        altitudes, a dilution map of them, or a morphing map; None = calculated here, in exact mode.
    navigation: how the rover will estimate where it is. departure_s: when it leaves, in the anchors' time.
    frame_s: with moving anchors, a place has the map of the time at which the rover gets there, to so many seconds.
    no_go, keep_in: polygons to stay out of and within, with the whole footprint; no_go gets the buildings that stand on
        the grid besides. areas_crs: their CRS, which must be
        the grid's; None = the grid's.
    Raises PathProblemError, AreaError.
    """

    grid: ElevationGrid
    start: Place
    goals: tuple[Goal, ...]
    way_points: tuple[Place, ...] = ()
    rover: RoverModel = field(default_factory=RoverModel)
    limits: PathLimits = field(default_factory=PathLimits)
    weights: CostWeights = field(default_factory=CostWeights)
    anchors: tuple[Anchor | DistantAnchor | MovingAnchor, ...] = ()
    maps: MinimumVisibleAltitude | DopMap | MorphingMap | None = None
    no_go: tuple[Area, ...] = ()
    keep_in: tuple[Area, ...] = ()
    areas_crs: Any = None
    start_heading_rad: float | None = None
    navigation: NavigationModel = field(default_factory=NavigationModel)
    departure_s: float = 0.0
    frame_s: float = 60.0
    seed: int = 0
    budget: PlanBudget = field(default_factory=PlanBudget)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "start", _place("start", self.start))
        goals = self.goals if _is_several(self.goals) else (self.goals,)
        if not goals:
            raise PathProblemError("A path needs at least one goal.")
        put(self, "goals", tuple(_area("goal", g) if _is_area(g) else _place("goal", g) for g in goals))
        put(self, "way_points", tuple(_place(f"way-point {n}", at) for n, at in enumerate(self.way_points, 1)))
        put(self, "anchors", tuple(self.anchors))
        put(self, "no_go", tuple(_area("no-go area", area) for area in _as_tuple(self.no_go)))
        put(self, "keep_in", tuple(_area("keep-in area", area) for area in _as_tuple(self.keep_in)))
        if self.no_go or self.keep_in:
            _check_crs(self.grid, self.areas_crs)
        if self.grid.standing is not None:
            buildings = self.grid.standing.outlines
            others = (area for area in self.no_go if not any(area is building for building in buildings))
            put(self, "no_go", (*others, *buildings))
        if not 0 <= self.seed < 2**32:
            raise PathProblemError(f"seed must be a whole number from 0 to {2**32 - 1}, not {self.seed}.")
        heading = self.start_heading_rad
        if heading is not None and not math.isfinite(heading):
            raise PathProblemError(f"start_heading_rad must be a finite angle, not {heading}.")
        if not (math.isfinite(self.departure_s) and math.isfinite(self.frame_s) and self.frame_s > 0.0):
            raise PathProblemError("departure_s must be a finite time, and frame_s more than 0 s.")
        if self.moves and self.way_points:
            raise PathProblemError(
                "With moving anchors each leg is a plan of its own: plan to the first way-point, then on from there "
                "with the time of arrival as departure_s."
            )
        _check_room(self.grid, self.rover)
        minimum = self.minimum
        of_grid = self.maps.grid if isinstance(self.maps, MorphingMap) else minimum.grid if minimum else self.grid
        if of_grid is not self.grid and of_grid.digest != self.grid.digest:
            raise PathProblemError("The maps belong to another grid; calculate them for this one.")
        if self.limits.on_positioning and not self.anchors and self.maps is None:
            raise PathProblemError("Limits on anchors in sight or dilution need anchors, or maps of them.")
        if minimum is not None:
            if self.anchors and self.anchors != minimum.anchors:
                raise PathProblemError("anchors are not those that the maps were calculated for; give either.")
            put(self, "anchors", minimum.anchors)
        if self.anchors and self.limits.min_anchors > len(self.anchors):
            raise PathProblemError(
                f"{self.limits.min_anchors} anchors in sight are asked for, and there "
                f"{'is' if len(self.anchors) == 1 else 'are'} only {len(self.anchors)}."
            )

    @property
    def counted(self) -> str:
        """What an anchor is called that counts: usable where the signals of all decide."""
        heard = all(getattr(anchor, "radio", None) is not None for anchor in self.anchors)
        return "usable" if heard and self.anchors else "in sight"

    @property
    def moves(self) -> bool:
        """Whether any anchor moves."""
        return any(not isinstance(anchor, Anchor | DistantAnchor) for anchor in self.anchors)

    @property
    def minimum(self) -> MinimumVisibleAltitude | None:
        """The minimum visible altitudes among the maps."""
        if isinstance(self.maps, DopMap):
            return self.maps.minimum
        return self.maps if isinstance(self.maps, MinimumVisibleAltitude) else None


def check_ground(grid: ElevationGrid) -> None:
    """Raises PathProblemError for a DEM without squares, which plans go over."""
    if min(grid.rows, grid.cols) < 2:
        raise PathProblemError(
            f"A DEM of {grid.rows} × {grid.cols} posts has no ground between them; a plan needs at least 2 × 2 posts."
        )


def _check_room(grid: ElevationGrid, rover: RoverModel) -> None:
    check_ground(grid)
    east_m, north_m = (grid.cols - 1) * grid.cell_east_m, (grid.rows - 1) * grid.cell_north_m
    if 2.0 * rover.footprint_radius_m > min(east_m, north_m):
        raise PathProblemError(
            f"A footprint of {rover.footprint_radius_m:g} m radius has no room on a DEM of {east_m:g} by {north_m:g} m."
        )


def _as_tuple(areas: Any) -> tuple[Any, ...]:
    return (areas,) if _is_area(areas) else tuple(areas)


def _is_area(thing: Any) -> bool:
    return isinstance(thing, shapely.Geometry)


def _is_several(goals: Any) -> bool:
    """Whether these are goals, and not one place or one area."""
    if _is_area(goals):
        return False
    return len(goals) == 0 or _is_area(goals[0]) or not isinstance(goals[0], float | int)


def _place(name: str, place: Any) -> Place:
    try:
        east_m, north_m = (float(number) for number in place)
    except (TypeError, ValueError) as error:
        raise PathProblemError(f"The {name} must be (east_m, north_m), not {place!r}.") from error
    if not (math.isfinite(east_m) and math.isfinite(north_m)):
        raise PathProblemError(f"The {name} must be finite metres, not ({east_m}, {north_m}).")
    return east_m, north_m


def _area(name: str, area: Any) -> Area:
    if not isinstance(area, Area):
        raise AreaError(f"A {name} must be a polygon, not {getattr(area, 'geom_type', type(area).__name__)}.")
    if area.is_empty:
        raise AreaError(f"A {name} is empty.")
    if not area.is_valid:
        raise AreaError(f"A {name} is no proper polygon: {shapely.is_valid_reason(area)}.")
    return area


def _check_crs(grid: ElevationGrid, crs: Any) -> None:
    if crs is None:
        return
    try:
        given = parse_crs(crs)
    except FrameError as error:
        raise AreaError(f"The CRS of the areas, {str(crs)[:80]!r}, is not known.") from error
    if grid.crs is None or not same_map(given, grid.crs):
        frame = "a local frame" if grid.crs is None else f"{grid.crs.name!r}"
        raise AreaError(f"The areas are in {given.name!r} and the grid is in {frame}; transform them first.")


@dataclass(frozen=True, eq=False, slots=True)
class FlightProblem:
    """From where to where, (east_m, north_m, altitude_m), above what.

    above: a morphing map whose safe_above_m is the floor and whose ceiling is the ceiling; None = the ground alone.
    ceiling_m: an altitude, or with ceiling_above_ground a height over each place; inf = none but the map's.
    bubble_m: distance that is kept from all ground, d >= r of eq. 25. climb_weight: what a metre of climb costs besides
        a metre of way. keep_in: polygons over which the drone stays; none = the whole grid.
    Raises PathProblemError, AreaError.
    """

    grid: ElevationGrid
    start: Point
    goal: Point
    above: MorphingMap | None = None
    ceiling_m: float = math.inf
    ceiling_above_ground: bool = False
    bubble_m: float = 20.0
    climb_weight: float = 1.0
    keep_in: tuple[Area, ...] = ()
    seed: int = 0
    budget: PlanBudget = field(default_factory=lambda: PlanBudget(iterations=20_000))

    def __post_init__(self) -> None:
        check_ground(self.grid)
        object.__setattr__(self, "keep_in", tuple(_area("keep-in area", area) for area in _as_tuple(self.keep_in)))
        for name in ("start", "goal"):
            if len(getattr(self, name)) != 3 or not all(math.isfinite(number) for number in getattr(self, name)):
                raise PathProblemError(f"The {name} of a flight must be east_m, north_m and altitude_m, finite.")
        if tuple(self.start) == tuple(self.goal):
            raise PathProblemError("The start and the goal are the same place, so there is no flight to plan.")
        for name in ("bubble_m", "climb_weight"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise PathProblemError(f"{name} must be a number >= 0, not {getattr(self, name)}.")
        if not self.ceiling_m > -math.inf:
            raise PathProblemError(f"ceiling_m must be a number of metres, not {self.ceiling_m}.")
        if not 0 <= self.seed < 2**32:
            raise PathProblemError(f"seed must be a whole number from 0 to {2**32 - 1}, not {self.seed}.")
        if self.above is not None and self.above.grid.digest != self.grid.digest:
            raise PathProblemError("The morphing map belongs to another grid; calculate it for this one.")
