"""What is asked about safety bubbles, brought into the grid's frame and checked before anything is calculated."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import navigation
from navigation import BubbleError, MeasurementError
from planning.bubbles import surroundings, way_m
from service.parts.positions import points_in_grid
from service.parts.ranging_sources import RangingSources, ranging_sources
from service.parts.sentences import told_as_asked
from service.products.safety_bubbles.request import BubbleParameters, BuildingsIn
from terrain import ElevationGrid
from visibility import Buildings, check_anchors, parse_buildings
from visibility.sight.sight_points import check_points

__all__ = ["bubble_sources", "buildings_of", "check_bubble_question", "given_covariances", "points_and_times"]

Array = npt.NDArray[np.float64]


def points_and_times(grid: ElevationGrid, parameters: BubbleParameters) -> tuple[Array, Array]:
    """(points (n, 3) in the grid's frame, times (n,)); raises FrameError, VisibilityInputError."""
    if parameters.points is not None:
        points_m = points_in_grid(grid, parameters.points, "Point {}")
    else:
        points_m = np.array(parameters.points_m, np.float64)
    points_m = check_points(grid, "points_m", points_m)
    if parameters.times_s is not None:
        return points_m, np.array(parameters.times_s, np.float64)
    return points_m, way_m(points_m) / (parameters.speed_m_per_s or 1.0)


@told_as_asked
def check_bubble_question(grid: ElevationGrid, parameters: BubbleParameters) -> tuple[int, Array, Array]:
    """(number of anchors and satellites, points, times); refuses what cannot be answered before anything is calculated.

    Raises AnchorError, AlmanacError, FrameError, MeshError, VisibilityInputError, BubbleError, MeasurementError,
    TimeOrderError, StateError.
    """
    points_m, times_s = points_and_times(grid, parameters)
    refused = parameters.under_ground == "refuse"
    around = surroundings(grid, points_m, buildings_of(grid, parameters.buildings), inside_is_refused=refused)
    zeros = np.zeros(len(points_m))
    navigation.check_bubbles(points_m, zeros, around.distance_m, around.nearest_m, under_ground=parameters.under_ground)
    if parameters.covariances_m2 is not None:
        given_covariances(parameters)
    back = np.diff(times_s) < 0.0
    if back.any():
        first = int(np.argmax(back)) + 1
        raise navigation.TimeOrderError(
            f"times_s must not go backwards: {times_s[first]:g} s follows {times_s[first - 1]:g} s at point {first}.",
            index=first,
        )
    return len(bubble_sources(grid, parameters).all), points_m, times_s


def buildings_of(grid: ElevationGrid, asked: BuildingsIn | None) -> Buildings | None:
    """The buildings of a request, stood on the grid. Raises MeshError."""
    if asked is None:
        return None
    return parse_buildings(
        asked.base64,
        asked.name,
        grid,
        heights=asked.heights,
        up=asked.up,
        origin_east_m=asked.origin_east_m,
        origin_north_m=asked.origin_north_m,
    )


def bubble_sources(grid: ElevationGrid, parameters: BubbleParameters) -> RangingSources:
    """What is ranged to; nothing for a history of poses without anchors.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError, MeasurementError.
    """
    if parameters.covariances_m2 is not None and not parameters.anchors and parameters.satellites is None:
        return RangingSources(())
    sources = ranging_sources(grid, parameters)
    check_anchors(grid, sources.all)
    for source in sources.all:
        if not source.ranging_sigma_m > 0.0 and parameters.covariances_m2 is None:
            raise MeasurementError(f"Anchor {source.id} needs a ranging_sigma_m above zero: its µ is missing.")
    return sources


def given_covariances(parameters: BubbleParameters) -> Array:
    """(n, 3, 3) from the upper triangles; raises BubbleError that names the one that is none."""
    ee, en, eu, nn, nu, uu = np.array(parameters.covariances_m2, np.float64).T
    covariances = np.stack([ee, en, eu, en, nn, nu, eu, nu, uu], axis=-1).reshape(-1, 3, 3)
    least = np.linalg.eigvalsh(covariances)[:, 0]
    bad = least < -1e-9 * np.abs(covariances).max(axis=(1, 2))
    if bad.any():
        first = int(np.argmax(bad))
        raise BubbleError(
            f"covariances_m2[{first}] is not positive: some direction has a negative variance.", index=first
        )
    return covariances
