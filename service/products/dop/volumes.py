"""The control volume of a DOP map and cuts through it: from what is asked to what the libraries take."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import air_layers, places_in_grid
from terrain import ElevationGrid, told_place
from visibility import (
    AltitudeLayers,
    ControlVolume,
    HorizontalSection,
    MinimumVisibleAltitude,
    VerticalSection,
    VisibilityInputError,
    control_volume,
    horizontal_section,
    vertical_section,
)
from visibility.air.control_volumes import posts_within

from .answer import VolumeFacts
from .request import CutIn, DopMapParameters

__all__ = ["asks_for_air", "check_air", "cut_line_m", "cut_of", "volume_facts", "volume_of"]

# air over the highest ground that cuts show where no volume is asked for: a part of the relief, and at least
AIR_OVER_RELIEF, LEAST_AIR_M = 0.25, 50.0
LAYERS_OF_A_PICTURE = 150
SLACK = 1e-6  # of a cell, as ElevationGrid.contains has it


def asks_for_air(parameters: DopMapParameters) -> bool:
    """Whether a volume or cuts are asked for."""
    return parameters.volume is not None or bool(parameters.cuts)


@told_as_asked
def check_air(grid: ElevationGrid, parameters: DopMapParameters) -> int:
    """Refuse volumes and cuts that cannot be; tells how many voxels the volume has, 0 without one.

    Raises VisibilityInputError, FrameError.
    """
    if not asks_for_air(parameters):
        return 0
    layers, (first_row, last_row, first_col, last_col) = _layers_and_posts(grid, parameters)
    for number, cut in enumerate(parameters.cuts):
        line_m = cut_line_m(grid, cut)
        if line_m is None:
            continue
        for east_m, north_m in line_m.tolist():
            row, col = grid.post_at(east_m, north_m)
            inside = first_row - SLACK <= row <= last_row + SLACK and first_col - SLACK <= col <= last_col + SLACK
            if not inside:
                raise VisibilityInputError(
                    f"cuts[{number}] leaves the volume at {told_place(grid, east_m, north_m)}; keep it between the "
                    "outermost posts."
                )
        if not np.ptp(line_m, axis=0).any():
            raise VisibilityInputError(f"cuts[{number}] is a single place; its line needs two different ones.")
    if parameters.volume is None:
        return 0
    return len(layers) * (last_row - first_row + 1) * (last_col - first_col + 1)


def volume_facts(grid: ElevationGrid, parameters: DopMapParameters) -> VolumeFacts | None:
    """The volume asked for in numbers; None without one."""
    if parameters.volume is None:
        return None
    layers, (first_row, last_row, first_col, last_col) = _layers_and_posts(grid, parameters)
    rows, cols = last_row - first_row + 1, last_col - first_col + 1
    return VolumeFacts(
        layers=len(layers),
        rows=rows,
        cols=cols,
        voxels=len(layers) * rows * cols,
        lowest_layer_m=float(layers.altitudes_m[0]),
        highest_layer_m=float(layers.altitudes_m[-1]),
        layers_above_ground=layers.above_ground,
    )


def volume_of(surfaces: MinimumVisibleAltitude, parameters: DopMapParameters) -> ControlVolume:
    """The volume that is asked for, or the one that cuts go through. Raises VisibilityInputError."""
    return control_volume(
        surfaces,
        _layers_and_posts(surfaces.grid, parameters)[0],
        bounds_m=_bounds_m(parameters),
        measure=parameters.measure,
        kind=parameters.kind,
        one_dop_per_set=parameters.one_dop_per_set,
    )


def cut_of(
    surfaces: MinimumVisibleAltitude, parameters: DopMapParameters, cut: CutIn
) -> VerticalSection | HorizontalSection:
    """One of the cuts asked for. Raises VisibilityInputError, FrameError."""
    volume = volume_of(surfaces, parameters)
    line_m = cut_line_m(surfaces.grid, cut)
    if line_m is not None:
        return vertical_section(volume, line_m)
    return horizontal_section(volume, altitude_m=cut.altitude_m, above_ground_m=cut.above_ground_m)


def cut_line_m(grid: ElevationGrid, cut: CutIn) -> npt.NDArray[np.float64] | None:
    """(n, 2) east, north of a vertical cut's line; None for a horizontal one. Raises FrameError."""
    return None if cut.line is None else places_in_grid(grid, cut.line)


def _layers_and_posts(
    grid: ElevationGrid, parameters: DopMapParameters
) -> tuple[AltitudeLayers, tuple[int, int, int, int]]:
    posts = posts_within(grid, _bounds_m(parameters))
    return _layers(grid.window(*posts), parameters), posts


def _layers(grid: ElevationGrid, parameters: DopMapParameters) -> AltitudeLayers:
    """Layers over the ground of the volume."""
    asked = parameters.volume
    if asked is None:
        if grid.unknown_posts == grid.rows * grid.cols:
            raise VisibilityInputError("No ground is known, so there is no air to cut.")
        lowest_m, highest_m = float(np.nanmin(grid.heights_m)), float(np.nanmax(grid.heights_m))
        air_m = max(AIR_OVER_RELIEF * (highest_m - lowest_m), LEAST_AIR_M)
        top_m = float(math.ceil(highest_m + air_m))
        return air_layers(grid, top_m, False, layer_m=(top_m - lowest_m) / LAYERS_OF_A_PICTURE)
    above_ground = asked.ceiling_above_ground_m is not None
    ceiling_m = asked.ceiling_above_ground_m if above_ground else asked.ceiling_altitude_m
    assert ceiling_m is not None, "the schema has seen to it"
    return air_layers(grid, ceiling_m, above_ground, floor_m=asked.floor_m, layer_m=asked.layer_m)


def _bounds_m(parameters: DopMapParameters) -> tuple[float, float, float, float] | None:
    if parameters.volume is None or parameters.volume.bounds_m is None:
        return None
    bounds = parameters.volume.bounds_m
    return bounds.west_m, bounds.south_m, bounds.east_m, bounds.north_m
