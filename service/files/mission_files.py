"""Files of missions, for programs that fly and drive on Earth: which there are, how high they count, plans.

MAVLink, QGroundControl, ArduPilot, GPX and KML count altitudes from the Earth's mean sea level. Those of a DEM whose
heights count from an ellipsoid are brought there; where nobody knows what they count from, a file leaves altitudes out,
counts from the ground instead, or is not written.
"""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import JsonValue

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

__all__ = [
    "COPTER",
    "LOITER",
    "MISSIONS",
    "ROVER",
    "TAKE_OFF",
    "WAYPOINT",
    "Mission",
    "PlanItem",
    "above_sea_level",
    "mission_warnings",
    "plan_text",
    "sea_level_m",
    "zip_plans",
]

# MAV_CMD
WAYPOINT, LOITER, TAKE_OFF = 16, 17, 22
# MAV_TYPE
COPTER, ROVER = 2, 10
GENERIC_FIRMWARE = 0  # MAV_AUTOPILOT
# (MAV_FRAME, QGroundControl's AltMode): MAV_FRAME_GLOBAL counts from mean sea level, MAV_FRAME_GLOBAL_TERRAIN_ALT from
# the ground below. MAV_FRAME_GLOBAL_RELATIVE_ALT, which counts from wherever the vehicle is armed, is never written.
SEA_LEVEL, GROUND = (0, 2), (10, 4)
# a zip's entries carry a time; one for all makes files of equal plans equal
ZIP_TIME = (2020, 1, 1, 0, 0, 0)
MEAN_SEA_LEVEL = parse_vertical_datum("msl")
FROM_GROUND = "gives heights above the ground (MAV_FRAME_GLOBAL_TERRAIN_ALT), for which the vehicle needs terrain data"


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


MISSIONS: Mapping[str, tuple[Mission, ...]] = MappingProxyType(
    {
        "path": (
            Mission("path.gpx", "has no altitudes"),
            Mission("path.plan", FROM_GROUND),
            Mission("path.kml", "has anchors above the ground"),
        ),
        "flight": (Mission("flight.plan"), Mission("flight.kml")),
        "placement": (
            Mission("plans.zip", FROM_GROUND),
            Mission("beacons.parm"),
            Mission("anchors.kml", "gives heights above the ground"),
        ),
        "repositioning": (Mission("plans.zip"), Mission("moves.kml")),
        "navigation": (Mission("track.gpx", "has no altitudes"),),
        "visibility-map": (Mission("map.kml", "gives heights above the ground"),),
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
    *most, last = [mission.name for mission in missions]
    names = f"{', '.join(most)} and {last}" if most else last
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


@dataclass(frozen=True, slots=True)
class PlanItem:
    """One command: where, WGS 84 degrees, at which altitude in metres, and how long it holds.

    altitude_m: above mean sea level, or above the ground in a plan that says so.
    """

    command: int
    lon_deg: float
    lat_deg: float
    altitude_m: float
    hold_s: float = 0.0


def plan_text(
    items: Sequence[PlanItem],
    home: PlanItem,
    *,
    vehicle: int = COPTER,
    cruise_m_per_s: float = 15.0,
    hover_m_per_s: float = 5.0,
    above_ground: bool = False,
) -> str:
    """The text of a .plan file (format of QGroundControl's "Plan" version 1) of these items, from home.

    above_ground: whether altitudes count from the ground; QGroundControl then looks up home's altitude itself.
    """
    frame, mode = GROUND if above_ground else SEA_LEVEL
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": [], "version": 2},
        "mission": {
            "version": 2,
            "firmwareType": GENERIC_FIRMWARE,
            "vehicleType": vehicle,
            "globalPlanAltitudeMode": mode,
            "cruiseSpeed": cruise_m_per_s,
            "hoverSpeed": hover_m_per_s,
            "plannedHomePosition": [home.lat_deg, home.lon_deg, None if above_ground else home.altitude_m],
            "items": [_item(number, item, frame, mode) for number, item in enumerate(items, 1)],
        },
    }
    return json.dumps(document, allow_nan=False, indent=1)


def zip_plans(texts: Mapping[str, str], path: Path) -> None:
    """Plans by their file names in a zip."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in texts.items():
            archive.writestr(zipfile.ZipInfo(_unused(name, archive), ZIP_TIME), text)


def _unused(name: str, archive: zipfile.ZipFile) -> str:
    """The name as one of a file, for ids come from outside: without folders, and unlike those that are there."""
    plain = re.sub(r"[^\w.() +-]", "_", name).lstrip(".")
    taken = {entry.casefold() for entry in archive.namelist()}
    stem = plain.removesuffix(".plan")
    others = (f"{stem}-{number}.plan" for number in range(2, len(taken) + 3))
    return next(one for one in (plain, *others) if one.casefold() not in taken)


def _item(number: int, item: PlanItem, frame: int, mode: int) -> dict[str, JsonValue]:
    # params 1 to 4 belong to the command; param 4 of None keeps the heading
    return {
        "type": "SimpleItem",
        "autoContinue": True,
        "command": item.command,
        "doJumpId": number,
        "frame": frame,
        "Altitude": item.altitude_m,
        "AltitudeMode": mode,
        "AMSLAltAboveTerrain": None,
        "params": [item.hold_s, 0, 0, None, item.lat_deg, item.lon_deg, item.altitude_m],
    }
