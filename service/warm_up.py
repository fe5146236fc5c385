"""Compiles every kernel into numba's on-disk cache, so that no request waits for a compiler."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Literal

import numpy as np

import detection
import navigation
import visibility
import visibility.sites
from dem_samples import load_sample
from planning import PathError, paths, placement
from service.settings import Rehearsal
from terrain import ElevationGrid, height_at, nearest_surface

__all__ = ["warm_up", "warm_up_on_all_cores"]


def warm_up(what: Rehearsal = "everything", *, own_processes: bool = True) -> None:
    """Call every public calculation once on a tiny grid with an unknown post; cheap when the cache is warm.

    The types of the arguments are those of real requests, since numba compiles per type. what: "maps" leaves it at
    what a fast visibility map calls. own_processes: also what starts processes that compile for themselves; they fill
    the cache for everybody, and leave nothing loaded here.
    """
    parts = (_fast_maps,) if what == "maps" else PARTS
    for part in parts:
        if own_processes or part is not _sampled_paths:
            _warm_up_part(PARTS.index(part))


def warm_up_on_all_cores() -> None:
    """The same with a process per core, for set-up, where everything has yet to be compiled."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=multiprocessing.get_context("spawn")) as pool:
        # most others make maps themselves: those that do not go beside, and the rest finds the maps' kernels compiled
        first = {number: pool.submit(_warm_up_part, number) for number in map(PARTS.index, (_fast_maps, *WITHOUT_MAPS))}
        first[PARTS.index(_fast_maps)].result()
        rest = [pool.submit(_warm_up_part, number) for number in range(len(PARTS)) if number not in first]
        for part in (*first.values(), *rest):
            part.result()
    warm_up()  # what two processes wrote into the cache at once, one of them may have to write again


def _warm_up_part(number: int) -> None:
    heights_m = np.zeros((12, 10), np.float32)
    heights_m[5, 5] = 40.0
    heights_m[2, 7] = np.nan
    PARTS[number](ElevationGrid(heights_m, 30.0, 25.0))


def _fast_maps(grid: ElevationGrid) -> None:
    load_sample("jacksboro")  # in degrees, so it is warped
    height_at(grid, [10.0, 20.0], [-30.0, -40.0])
    _minimum_altitudes(grid, "fast")


def _exact_maps(grid: ElevationGrid) -> None:
    _minimum_altitudes(grid, "exact")


def _minimum_altitudes(grid: ElevationGrid, mode: Literal["fast", "exact"]) -> None:
    anchors = (
        # from four on the fast sweep turns the whole grid
        *(visibility.Anchor(f"inside {n}", 101.0, -77.0 - n, 60.0) for n in range(3)),
        visibility.Anchor("outside", -400.0, 90.0, 300.0, limits=visibility.AntennaLimits(max_range_m=5_000.0)),
    )
    curved = visibility.Curvature(6_371_000.0, 4.0 / 3.0)
    for curvature in (visibility.FLAT, curved):
        answer = visibility.min_visible_altitude(grid, anchors, mode, curvature)
        answer.visible(above_ground_m=1.5)
        answer.margin_m(altitude_m=50.0)


def _lines(grid: ElevationGrid) -> None:
    starts_m, ends_m = [[10.0, -10.0, 60.0]] * 2, [[200.0, -150.0, 5.0], [-50.0, 20.0, 90.0]]
    visibility.lines_of_sight(grid, starts_m, ends_m, wavelength_m=0.1, dem_sigma_m=3.0, excess_path=True)
    visibility.line_of_sight(grid, starts_m[0], ends_m[0])
    visibility.profile(grid, starts_m[0], ends_m[0])
    visibility.dop([[0.0, 0.0, 90.0], [90.0, 0.0, 80.0], [0.0, -90.0, 70.0]], starts_m)
    visibility.dilution.position_error([[0.0, 0.0, 90.0], [90.0, 0.0, 80.0], [0.0, -90.0, 70.0]], starts_m, 0.1)


def _sites(grid: ElevationGrid) -> None:
    visibility.sites.site_map(grid, 10.0, 1.5, directions=16)


def _columns_of_air(grid: ElevationGrid) -> None:
    corners = ((10.0, -10.0, 90.0), (250.0, -20.0, 120.0), (20.0, -260.0, 70.0), (240.0, -240.0, 100.0))
    surfaces = visibility.min_visible_altitude(grid, [visibility.Anchor(f"A{n}", *at) for n, at in enumerate(corners)])
    visibility.morphing_map(surfaces, visibility.FlightLimit(3.0), ceiling_m=200.0)
    for on_surface in (False, True):
        visibility.dop_map(surfaces, 1.5, on_surface=on_surface)
        visibility.position_error_map(surfaces, 1.5, on_surface=on_surface)
        visibility.dilution.position_error_along(surfaces, [[100.0, -100.0, 90.0]], on_surface=on_surface)
    layers = visibility.altitude_layers(0.0, 40.0, 20.0, above_ground=True)
    visibility.air.whole_volume(visibility.control_volume(surfaces, layers))


def _navigation(grid: ElevationGrid) -> None:
    nearest_surface(grid, [[10.0, -10.0, 60.0]])
    corners_m = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)], float)
    tent = visibility.Buildings(corners_m, np.array([(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)]))
    visibility.cover.nearest_building(tent, [[1.0, 1.0, 1.0]])
    navigation.bubble_confidence(np.eye(3), 1.0)
    navigation.radius_of_confidence(np.eye(3), 0.9)
    points_m, anchors_m = [[10.0, -10.0, 60.0], [20.0, -20.0, 60.0]], [[100.0, -200.0, 90.0]]
    surfaces = visibility.min_visible_altitude(grid, [visibility.Anchor("A", 100.0, -200.0, 90.0)])
    visible = visibility.visible_sets(surfaces, points_m).visible()
    visibility.dilution.dop_at_points(points_m, anchors_m, visibility.dilution.pack_sets(visible))
    motion = navigation.MotionNoise()
    for clock_m in (None, (0.0, 0.0)):
        state = navigation.predict(navigation.initial_state(0.0, points_m[0], clock_m=clock_m), 1.0, motion)
        navigation.update_ranges(state, anchors_m, [200.0], 1.0)
        navigation.filter_ranges(state, motion, [2.0], [0], [200.0], 1.0, anchors_m)
        navigation.predict_bubble(
            points_m,
            [0.0, 1.0],
            anchors_m,
            [[True], [True]],
            1.0,
            clock=clock_m is not None,
            ground_slope=[[0.0, 0.0]] * 2,
        )


def _placements(grid: ElevationGrid) -> None:
    candidates = placement.candidate_grid(grid, 110.0, above_ground_m=[30.0])
    area, fixed = placement.area_targets(grid), visibility.Anchor("F", 101.0, -77.0, 60.0)
    weights = np.linspace(1.0, 2.0, grid.heights_m.size).reshape(grid.shape)
    weighted = placement.area_targets(grid, weight=weights)
    path = placement.path_targets(grid, [(40.0, -40.0), (200.0, -200.0)])
    rules = placement.PlacementRules(max_range_m=1000.0)
    for goal, targets in (
        (placement.Goal(), weighted),
        (placement.Goal("dop", spare=1), path),
        (placement.Goal("mean_error"), area),
    ):
        placed = placement.place_anchors(grid, candidates, targets, 4, goal, rules, fixed=[fixed])
        placement.check_placement(grid, placed)
    ahead = placement.straight_ahead(101.0, -100.0, 1.0, 60.0)
    placement.reposition(grid, [fixed], ahead, placement.Goal("dop"), above_ground_m=[30.0])


def _paths(grid: ElevationGrid) -> None:
    anchors = tuple(visibility.Anchor(f"A{n}", 60.0 * n, -50.0 * n, 90.0 + n) for n in range(4))
    rover = paths.RoverModel(max_slope_rad=1.2, max_step_m=80.0)
    by_grid = paths.PlanBudget(sampling=False)
    plan = partial(paths.PathProblem, budget=by_grid)
    for dop_limit, goal in ((1e6, (60.0, -225.0)), (1e6, (210.0, -225.0)), (0.1, (60.0, -225.0))):
        limits = paths.PathLimits(min_anchors=0, dop_limit=dop_limit)
        with contextlib.suppress(PathError):
            paths.plan_path(plan(grid, (60.0, -50.0), goal, rover=rover, anchors=anchors, limits=limits))
    cliff_m = np.zeros((12, 10), np.float32)
    cliff_m[6:] = 900.0
    paths.plan_path(plan(ElevationGrid(cliff_m, 30.0, 25.0), (60.0, -50.0), (60.0, -225.0)))
    track = visibility.sight.AnchorTrack(
        "T", np.array([0.0, 900.0]), np.array([[60.0, -50.0, 90.0], [90.0, -50.0, 90.0]])
    )
    paths.plan_path(plan(grid, (60.0, -50.0), (60.0, -225.0), anchors=(track,)))


def _sampled_paths(grid: ElevationGrid) -> None:
    few = paths.PlanBudget(iterations=200)
    plan = partial(paths.PathProblem, grid, (60.0, -50.0), (60.0, -225.0), budget=few)
    paths.plan_path(plan())
    paths.plan_path(plan(rover=paths.RoverModel(min_turning_radius_m=5.0)))
    paths.plan_flight(paths.FlightProblem(grid, (60.0, -50.0, 90.0), (60.0, -225.0, 90.0), budget=few))


def _detections(_grid: ElevationGrid) -> None:
    places = ((0.0, 0.0, 9.0), (90.0, 0.0, 3.0), (90.0, 80.0, 12.0), (0.0, 80.0, 1.0), (40.0, 30.0, 20.0))
    anchors = [detection.RangingAnchor(str(n), *place) for n, place in enumerate(places)]
    for dimension in (2, 3):
        settings = detection.DetectorSettings(dimension=dimension, search_limit=20)
        detector = detection.Detector(anchors, settings)
        for second in range(3):
            ranges_m = [
                np.linalg.norm(np.subtract(place[:dimension], (30.0, 40.0, 2.0)[:dimension])) for place in places
            ]
            ranges_m[2] += 5.0 * second
            measured = (detection.RangeMeasurement(str(n), float(range_m)) for n, range_m in enumerate(ranges_m))
            motion = detection.OdometryIncrement(1.0, (0.0, 0.0), heading_rad=0.0)
            detector.process(detection.RangeEpoch(float(second), tuple(measured), motion))
        # every range another time too long: a cause is looked for
        lies = [detection.RangeMeasurement(str(n), 40.0 + 30.0 * n) for n in range(len(places))]
        for second in range(3, 15):
            detector.process(detection.RangeEpoch(float(second), tuple(lies)))
        detector.suspicions()
    odd_m = np.linspace(40.0, 300.0, len(places))  # ranges that meet nowhere: the bounded search too
    detection.detect_3d(places, odd_m, 0.1, search_limit=2)
    detection.detect_3d(places, odd_m, 0.1, method="seed", search_limit=2)


# the longest first, so that all cores end together
PARTS = (
    _fast_maps,
    _columns_of_air,
    _paths,
    _sampled_paths,
    _exact_maps,
    _detections,
    _navigation,
    _lines,
    _placements,
    _sites,
)
WITHOUT_MAPS = (_exact_maps, _detections)  # about as long together as maps take
