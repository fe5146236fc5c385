"""Missions as QGroundControl reads them: a .plan file of items, for drones that hold a place and rovers that drive."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = ["COPTER", "LOITER", "ROVER", "TAKE_OFF", "WAYPOINT", "PlanItem", "plan_text", "zip_plans"]

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


def _item(number: int, item: PlanItem, frame: int, mode: int) -> dict[str, Any]:
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
