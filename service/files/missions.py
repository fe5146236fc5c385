"""Files for programs that fly and drive on Earth: which are written of a DEM, with which heights, and what is told.

MAVLink, QGroundControl, ArduPilot and GPX count altitudes from the Earth's mean sea level. Those of a DEM whose heights
count from an ellipsoid are brought there; where nobody knows what they count from, a file leaves altitudes out, counts
from the ground instead, or is not written.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from service.parts.map_facts import body_name
from terrain import (
    ElevationGrid,
    HeightReference,
    VerticalDatumError,
    altitude_step,
    height_reference_of,
    parse_vertical_datum,
    vertical_datum_of,
)

__all__ = ["MISSIONS", "Mission", "above_sea_level", "mission_warnings", "sea_level_m"]

MEAN_SEA_LEVEL = parse_vertical_datum("msl")


@dataclass(frozen=True, slots=True)
class Mission:
    """without_sea_level: what the file does where no altitude above sea level is known; None = it is not written."""

    name: str
    without_sea_level: str | None = None

    def is_of(self, dem: Mapping[str, Any]) -> bool:
        """Whether it is written of the DEM of this summary."""
        if dem.get("crs") is None or dem.get("body", "Earth") != "Earth":
            return False
        return self.without_sea_level is not None or dem.get("heights_count_from") != HeightReference.UNKNOWN


FROM_GROUND = "gives heights above the ground (MAV_FRAME_GLOBAL_TERRAIN_ALT), for which the vehicle needs terrain data"
MISSIONS: Mapping[str, tuple[Mission, ...]] = MappingProxyType(
    {
        "path": (Mission("path.gpx", "has no altitudes"), Mission("path.plan", FROM_GROUND)),
        "flight": (Mission("flight.plan"),),
        "placement": (Mission("plans.zip", FROM_GROUND), Mission("beacons.parm")),
        "repositioning": (Mission("plans.zip"),),
    }
)


def above_sea_level(grid: ElevationGrid) -> bool:
    """Whether files that mean sea level can have a grid's altitudes: not where nobody knows what they count from."""
    return height_reference_of(grid) is not HeightReference.UNKNOWN


def sea_level_m(
    grid: ElevationGrid, east_m: npt.ArrayLike, north_m: npt.ArrayLike, altitude_m: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Altitudes of places above mean sea level, (n,) metres, from those in the grid's vertical datum.

    A geoid and a levelling datum are mean sea level as they are; from an ellipsoid EGM96 is taken off. Raises
    VerticalDatumError where nobody knows what the grid's heights count from, or it is not on Earth; FrameError.
    """
    own = vertical_datum_of(grid)
    if own is None:
        raise VerticalDatumError("Nobody knows how the DEM lies to mean sea level; read it with vertical_datum.")
    step_m, _ = altitude_step(grid, east_m, north_m, given=own, wanted=MEAN_SEA_LEVEL)
    return np.atleast_1d(np.asarray(altitude_m, np.float64)) + step_m


def mission_warnings(product: str, grid: ElevationGrid) -> tuple[str, ...]:
    """What to know about the mission files of a product of that name: those not written, and what heights mean."""
    if grid.crs is None:
        return ()
    missions = MISSIONS[product]
    names = " and ".join(mission.name for mission in missions)
    body = body_name(grid)
    if body != "Earth":
        verb = "is" if len(missions) == 1 else "are"
        return (f"The DEM lies on {_the(body)}: {names}, which mean the Earth, {verb} not written.",)
    reference = height_reference_of(grid)
    if reference is HeightReference.SEA_LEVEL:
        return ()
    if reference is HeightReference.ELLIPSOID:
        verb = "gives" if len(missions) == 1 else "give"
        return (f"{names} {verb} altitudes above mean sea level: the DEM's, from the ellipsoid, less EGM96.",)
    datum = "does not say" if grid.vertical_datum is None else f"({grid.vertical_datum}) does not tell"
    files = ", ".join(f"{one.name} {one.without_sea_level or 'is not written'}" for one in missions)
    return (f"The DEM {datum} what its heights count from: {files}. Read it with vertical_datum (EGM96, hae).",)


def _the(body: str | None) -> str:
    return "the Moon" if body == "Moon" else str(body)
