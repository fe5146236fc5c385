"""Heights of a grid, and altitudes of places on it, brought from one vertical datum to another."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ..crs.frames import body_of, to_lon_lat
from ..errors import VerticalDatumError
from ..grid import ElevationGrid
from .references import VerticalDatum, parse_vertical_datum, vertical_datum_of
from .surfaces import datum_step_m

__all__ = ["NODES_M", "altitude_step", "raised", "with_vertical_datum"]

Array = npt.NDArray[np.float64]

# geoids bend by less than 1.2e-8 per metre: straight between nodes so far apart is within 0.4 mm
NODES_M = 500.0


def altitude_step(
    grid: ElevationGrid, east_m: npt.ArrayLike, north_m: npt.ArrayLike, *, given: VerticalDatum, wanted: VerticalDatum
) -> tuple[Array, tuple[str, ...]]:
    """(metres to add to altitudes above ``given`` for altitudes above ``wanted`` at places, what there is to tell).

    east_m, north_m: (n,) metres in the grid's CRS. Raises VerticalDatumError: no model, or not a grid on Earth;
    FrameError: places that its CRS cannot express.
    """
    _check_on_earth(grid)
    east, north = np.broadcast_arrays(np.asarray(east_m, np.float64).ravel(), np.asarray(north_m, np.float64).ravel())
    lon, lat = to_lon_lat(grid, east, north)
    return datum_step_m(given, wanted, lon, lat)


def with_vertical_datum(grid: ElevationGrid, datum: str | VerticalDatum) -> ElevationGrid:
    """The grid with heights above another vertical datum; ``provenance`` tells how they got there.

    datum: as ``parse_vertical_datum`` takes it. Where nobody knows what the heights count from, they are taken to count
    from there, which is told. There and back is the same to 1 mm.
    Raises VerticalDatumError: the datum is not known, its geoid model is not here, or the grid is not on Earth.
    """
    _check_on_earth(grid)
    wanted = parse_vertical_datum(datum) if isinstance(datum, str) else datum
    own = vertical_datum_of(grid)
    told = grid.provenance
    if own == wanted:
        return grid
    if own is None:
        said = "does not say" if grid.vertical_datum is None else f"({grid.vertical_datum}) does not tell"
        sentence = f"The file {said} what its heights count from; vertical_datum= says: {wanted.name}."
        return _named(grid, wanted, sentence)
    nodes_m, warnings = _nodes(grid, own, wanted)
    if not nodes_m.any():
        return _named(grid, wanted, f"The file's heights above {own.name} were taken as above {wanted.name}.")
    low, high = float(nodes_m.min()), float(nodes_m.max())
    sentence = f"Heights brought from {own.name} to {wanted.name}: {low:+.2f} to {high:+.2f} m."
    told = replace(told, conversions=(*told.conversions, sentence), warnings=(*told.warnings, *warnings))
    heights_m = raised(grid.heights_m, nodes_m)
    heights_m.setflags(write=False)
    return replace(grid, heights_m=heights_m, vertical_datum=wanted.name, provenance=told)


def raised(heights_m: npt.NDArray[np.float32], nodes_m: Array) -> npt.NDArray[np.float32]:
    """Heights (rows, cols) with a step added that is known at nodes, evenly spaced from the first post to the last."""
    rows, cols = heights_m.shape
    above_m = np.empty((rows, cols), np.float32)
    at = np.linspace(0.0, nodes_m.shape[0] - 1.0, rows)
    of_cols = np.linspace(0.0, nodes_m.shape[1] - 1.0, cols)
    node_cols = np.arange(nodes_m.shape[1])
    for row, place in enumerate(at.tolist()):
        first = min(int(place), max(nodes_m.shape[0] - 2, 0))
        after = min(first + 1, nodes_m.shape[0] - 1)
        between = nodes_m[first] + (place - first) * (nodes_m[after] - nodes_m[first])
        above_m[row] = heights_m[row] + np.interp(of_cols, node_cols, between)
    return above_m


def _named(grid: ElevationGrid, datum: VerticalDatum, sentence: str) -> ElevationGrid:
    """The same heights under another datum's name, which is told."""
    told = replace(grid.provenance, conversions=(*grid.provenance.conversions, sentence))
    return replace(grid, vertical_datum=datum.name, provenance=told)


def _nodes(grid: ElevationGrid, own: VerticalDatum, wanted: VerticalDatum) -> tuple[Array, tuple[str, ...]]:
    """The step at nodes over the grid, evenly spaced from its first to its last post, (rows, cols) metres."""
    rows, cols = (
        math.ceil((posts - 1) * cell_m / NODES_M) + 1
        for posts, cell_m in ((grid.rows, grid.cell_north_m), (grid.cols, grid.cell_east_m))
    )
    row, col = np.meshgrid(
        np.linspace(0.0, grid.rows - 1.0, rows), np.linspace(0.0, grid.cols - 1.0, cols), indexing="ij"
    )
    east_m, north_m = grid.position_of(row.ravel(), col.ravel())
    step_m, told = altitude_step(grid, east_m, north_m, given=own, wanted=wanted)
    return step_m.reshape(rows, cols), told


def _check_on_earth(grid: ElevationGrid) -> None:
    if grid.crs is None:
        raise VerticalDatumError("The DEM has no CRS, so it has no place on Earth, and no geoid lies under it.")
    body = body_of(grid.crs).name
    if body != "Earth":
        raise VerticalDatumError(f"The DEM lies on {body}, where no geoid of the Earth and no sea level is.")
