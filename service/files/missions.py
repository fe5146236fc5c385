"""Files for programs that fly and drive on Earth: which are written of a DEM, with which heights, and what is told.

MAVLink, QGroundControl, ArduPilot and GPX count altitudes from the Earth's mean sea level. A DEM whose heights count
from an ellipsoid has none to give; then a file leaves altitudes out, counts from the ground instead, or is not written.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from service.parts.map_facts import body_name
from terrain import ElevationGrid, HeightReference, height_reference_of

__all__ = ["MISSIONS", "Mission", "above_sea_level", "mission_warnings"]


@dataclass(frozen=True, slots=True)
class Mission:
    """without_sea_level: what the file does where no altitude above sea level is known; None = it is not written."""

    name: str
    without_sea_level: str | None = None

    def is_of(self, dem: Mapping[str, Any]) -> bool:
        """Whether it is written of the DEM of this summary."""
        if dem.get("crs") is None or dem.get("body", "Earth") != "Earth":
            return False
        return self.without_sea_level is not None or dem.get("heights_count_from") != HeightReference.ELLIPSOID


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
    """Whether a grid's altitudes go into files that mean sea level: where that is unknown they do, and it is told."""
    return height_reference_of(grid) is not HeightReference.ELLIPSOID


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
    if reference is HeightReference.UNKNOWN:
        verb = "takes" if len(missions) == 1 else "take"
        datum = "does not say" if grid.vertical_datum is None else f"({grid.vertical_datum}) does not tell"
        return (f"The DEM {datum} what its heights count from; {names} {verb} them as above mean sea level.",)
    begin = f"The DEM's heights count from the {grid.vertical_datum}, not from sea level, and no geoid model is there"
    return tuple(f"{begin}: {one.name} {one.without_sea_level or 'is not written'}." for one in missions)


def _the(body: str | None) -> str:
    return "the Moon" if body == "Moon" else str(body)
