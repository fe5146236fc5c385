"""Drives over real ground: who is hidden when, and how much too long a range over the ridge is, come from the DEM."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

import dem_samples
import terrain
import visibility
from detection import RangingAnchor
from detection.simulation import SimulatedDrive, drive_along

__all__ = ["Place", "ground_drives", "jacksboro", "over_ground"]

Floats = npt.NDArray[np.float64]

SPEED_M_PER_S = 2.0
ANTENNA_M = 1.5
# the map that predicts sight is a coarser one than the ground: every second post, with this error
MAP_STEP, MAP_SIGMA_M = 2, 10.0


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Ground with drones over it, and where among them a rover drives."""

    ground: terrain.ElevationGrid
    anchors: tuple[RangingAnchor, ...]
    middle_m: tuple[float, float]
    radius_m: float


def jacksboro() -> Place:
    """The ridge west of Jacksboro with eight drones 120 m above it, 2.5 km around its foot."""
    ground = dem_samples.load_sample("jacksboro")
    rows, cols = ground.heights_m.shape
    east_m = ground.origin_east_m + 0.55 * cols * ground.cell_east_m
    north_m = ground.origin_north_m - 0.5 * rows * ground.cell_north_m
    anchors = []
    for number in range(8):
        turn = 2.0 * math.pi * number / 8
        at_m = (east_m + 2500.0 * math.sin(turn), north_m + 2500.0 * math.cos(turn))
        drone = visibility.anchor_above_ground(ground, f"D{number + 1}", *at_m, above_ground_m=120.0)
        anchors.append(RangingAnchor(drone.id, drone.east_m, drone.north_m, drone.altitude_m))
    return Place(ground, tuple(anchors), (east_m, north_m), 2000.0)


def ground_drives(place: Place, count: int, length_m: float, generator: np.random.Generator) -> list[SimulatedDrive]:
    """Straight drives of random begin and direction, an epoch a second, with what the ground does to every range."""
    drives = []
    for _ in range(count):
        begin_m = np.array(place.middle_m) + generator.uniform(-1.0, 1.0, size=2) * (place.radius_m - length_m / 2.0)
        turn = float(generator.uniform(0.0, 2.0 * math.pi))
        end_m = begin_m + length_m * np.array([math.sin(turn), math.cos(turn)])
        drives.append(over_ground(place, np.array([begin_m, end_m])))
    return drives


def over_ground(place: Place, waypoints_m: Floats) -> SimulatedDrive:
    """The drive along waypoints (w, 2) on the ground, occluded as the ground has it, with a coarse map's prediction."""
    level = drive_along([replace(anchor, altitude_m=0.0) for anchor in place.anchors], waypoints_m, SPEED_M_PER_S)
    east_m, north_m = level.places_m.T
    places_m = np.column_stack([level.places_m, terrain.height_at(place.ground, east_m, north_m) + ANTENNA_M])
    anchors_m = np.array([(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in place.anchors])
    count, drones = len(places_m), len(anchors_m)
    starts_m, ends_m = np.repeat(places_m, drones, axis=0), np.tile(anchors_m, (count, 1))
    lines = visibility.lines_of_sight(place.ground, starts_m, ends_m, excess_path=True)
    assert lines.excess_path_m is not None  # it was asked for
    excess_m = lines.excess_path_m.reshape(count, drones)
    return SimulatedDrive(place.anchors, level.times_s, places_m, excess_m, _predicted(place, places_m, anchors_m))


def _predicted(place: Place, places_m: Floats, anchors_m: Floats) -> Floats:
    """(n, k) probability of sight by a coarser map, on whose own ground the rover stands."""
    grid = place.ground
    coarse = terrain.ElevationGrid(
        grid.heights_m[::MAP_STEP, ::MAP_STEP],
        grid.cell_east_m * MAP_STEP,
        grid.cell_north_m * MAP_STEP,
        grid.origin_east_m,
        grid.origin_north_m,
        grid.crs,
    )
    stands_m = places_m.copy()
    stands_m[:, 2] = terrain.height_at(coarse, places_m[:, 0], places_m[:, 1]) + ANTENNA_M
    count, drones = len(places_m), len(anchors_m)
    lines = visibility.lines_of_sight(
        coarse, np.repeat(stands_m, drones, axis=0), np.tile(anchors_m, (count, 1)), dem_sigma_m=MAP_SIGMA_M
    )
    assert lines.probability_clear is not None  # it was asked for
    return lines.probability_clear.reshape(count, drones)
