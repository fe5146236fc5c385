"""No-go zones as polygons and dilutions as contour lines, in GeoJSON."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from service.files.geojson import write_collection
from service.parts.positioning import PositioningParameters
from terrain import ElevationGrid, to_lon_lat
from visibility.dilution import NO_GO, contour_lines, zones

__all__ = ["write_contours", "write_no_go_zones"]

DECIMALS_DEG, DECIMALS_M = 8, 3
LEVELS_PER_LIMIT = (0.5, 1.0, 2.0)


class PositioningMap(Protocol):
    """A map of positioning at the antenna of a rover on the ground; arrays (rows, cols)."""

    @property
    def grid(self) -> ElevationGrid:
        """The ground it lies on."""
        ...

    @property
    def parameters(self) -> PositioningParameters:
        """What was asked for."""
        ...

    @property
    def no_go(self) -> npt.NDArray[np.uint8]:
        """1 where positioning is not good enough."""
        ...

    @property
    def dop(self) -> npt.NDArray[np.float32]:
        """The dilution; +inf = no fix, NaN = unknown."""
        ...


def write_no_go_zones(finished: PositioningMap, path: Path) -> None:
    """Polygons in degrees round the no-go posts; without a CRS in the DEM's local metres, and says so."""
    grid, parameters = finished.grid, finished.parameters
    features = [
        _feature(
            "Polygon",
            [_coordinates(grid, ring) for ring in (zone.exterior, *zone.holes)],
            {"area_m2": round(zone.area_m2, 1), **_limit(parameters)},
        )
        for zone in zones(grid, finished.no_go == NO_GO)
    ]
    write_collection(grid, features, path)


def write_contours(finished: PositioningMap, path: Path) -> None:
    """One MultiLineString for each level of the dilution; the limit is one of them."""
    grid, parameters = finished.grid, finished.parameters
    levels = [parameters.dop_limit * part for part in LEVELS_PER_LIMIT]
    lines = contour_lines(grid, finished.dop, levels) if min(grid.shape) > 1 else dict.fromkeys(levels, ())
    features = [
        _feature(
            "MultiLineString",
            [_coordinates(grid, line) for line in lines[level]],
            {"dop": level, **_limit(parameters)},
        )
        for level in levels
    ]
    write_collection(grid, features, path)


def _limit(parameters: PositioningParameters) -> dict[str, str | float]:
    return {"measure": parameters.measure, "kind": parameters.kind, "dop_limit": parameters.dop_limit}


def _coordinates(grid: ElevationGrid, line_m: npt.NDArray[np.float64]) -> list[list[float]]:
    if grid.crs is None:
        metres: list[list[float]] = np.round(line_m, DECIMALS_M).tolist()
        return metres
    degrees: list[list[float]] = np.round(
        np.column_stack(to_lon_lat(grid, line_m[:, 0], line_m[:, 1])), DECIMALS_DEG
    ).tolist()
    return degrees


def _feature(kind: str, coordinates: list[list[list[float]]], properties: dict[str, str | float]) -> dict[str, object]:
    return {"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties}
