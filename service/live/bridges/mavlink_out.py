"""What a bridge tells over MAVLink: heartbeat, position, texts on occlusion, beacon parameters, anchors as targets."""

from __future__ import annotations

import math
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pymavlink.dialects.v20 import all as dialect

from detection import EpochResult, RangingAnchor
from planning.watching import WatchedEpoch

from .true_north import NedOrigin

__all__ = ["Outgoing", "PositionAs", "Told"]

PositionAs = Literal["vision", "gps", "none"]
HEARTBEAT_S, PARAMETER_S, TARGETS_S = 1.0, 1.0, 1.0
MOST_TRIES = 10
TEXT_AGAIN_S = 2.0  # of one anchor, so that a verdict that flickers does not fill the link
TEXT_BYTES = 50
IGNORED = (
    dialect.GPS_INPUT_IGNORE_FLAG_HDOP
    | dialect.GPS_INPUT_IGNORE_FLAG_VDOP
    | dialect.GPS_INPUT_IGNORE_FLAG_VEL_HORIZ
    | dialect.GPS_INPUT_IGNORE_FLAG_VEL_VERT
    | dialect.GPS_INPUT_IGNORE_FLAG_SPEED_ACCURACY
)
TARGET_FLAGS = dialect.ADSB_FLAGS_VALID_COORDS | dialect.ADSB_FLAGS_VALID_ALTITUDE | dialect.ADSB_FLAGS_VALID_CALLSIGN
GPS_EPOCH_S, WEEK_S = 315964800.0, 604800.0
MOST_UINT64 = 2**64 - 1


@dataclass(frozen=True, slots=True)
class Told:
    """What is sent. system, component: as whom; vehicle: the system that parameters are for."""

    position: PositionAs = "vision"
    texts: bool = True
    beacons: bool = False
    targets: bool = False
    origin: bool = False
    system: int = 1
    component: int = dialect.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY
    vehicle: int = 1


@dataclass(slots=True)
class Parameter:
    """A parameter of the vehicle to set, until it says that it has it."""

    name: str
    value: float
    tries: int = 0
    held: bool = False


class Outgoing:
    """Makes messages. origin: of north, east, down; anchors: as targets. What the vehicle answers is ``heard``."""

    def __init__(self, told: Told, origin: NedOrigin, anchors: Sequence[RangingAnchor]) -> None:
        self.system, self.component = told.system, told.component
        self.problems: list[str] = []
        self._told, self._origin = told, origin
        self._anchors = {anchor.id: anchor for anchor in anchors}
        self._link = dialect.MAVLink(None, srcSystem=told.system, srcComponent=told.component)
        self._yaw_rad = math.nan
        self._due_s = dict.fromkeys(("heartbeat", "parameters", "targets"), -math.inf)
        self._parameters = _beacon_parameters(origin) if told.beacons else []
        self._origin_tries = MOST_TRIES if told.origin else 0
        self._vehicle_heard = False
        self._sights: dict[str, tuple[bool, float]] = {}
        self._had_position = True

    def heard(self, message: dialect.MAVLink_message) -> None:
        """What the vehicle says of itself."""
        if message.get_srcSystem() != self._told.vehicle:
            return
        self._vehicle_heard = True
        name = message.get_type()
        if name == "GPS_GLOBAL_ORIGIN":
            self._origin_tries = 0
        elif name == "ATTITUDE":
            self._yaw_rad = message.yaw
        elif name == "PARAM_VALUE":
            for parameter in self._parameters:
                if parameter.name == message.param_id and math.isclose(
                    message.param_value, np.float32(parameter.value), rel_tol=1e-6
                ):
                    parameter.held = True

    def moved(self, anchor: RangingAnchor) -> None:
        """An anchor is elsewhere."""
        self._anchors[anchor.id] = anchor

    def due(self, now_s: float) -> list[bytes]:
        """What is sent by the clock."""
        sent: list[bytes] = []
        if self._is_due("heartbeat", now_s, HEARTBEAT_S):
            kind, autopilot = dialect.MAV_TYPE_ONBOARD_CONTROLLER, dialect.MAV_AUTOPILOT_INVALID
            sent += self._packed(dialect.MAVLink_heartbeat_message(kind, autopilot, 0, 0, dialect.MAV_STATE_ACTIVE, 3))
            if self._vehicle_heard and self._origin_tries:
                sent += self._global_origin()
        if self._vehicle_heard and self._parameters and self._is_due("parameters", now_s, PARAMETER_S):
            sent += self._asked_parameters()
        if self._told.targets and self._is_due("targets", now_s, TARGETS_S):
            for anchor in self._anchors.values():
                sent += self._target(anchor)
        return sent

    def answer(self, watched: WatchedEpoch) -> list[bytes]:
        """The position, where there is but one, and texts on what changed; the filter's, where one goes along."""
        sent: list[bytes] = []
        result, estimate = watched.result, watched.estimate
        fix, place = result.position, None
        if estimate is not None:
            place = estimate.position_m.tolist(), estimate.covariance[:3, :3], len(estimate.used)
        elif fix is not None and fix.mirror_m is None:
            place = fix.position_m.tolist(), fix.covariance_m2, len(result.included)
        if place is not None:
            usec = min(max(round(1e6 * result.time_s), 0), MOST_UINT64)
            place_m, covariance_m2, used = place
            if self._told.position == "vision":
                sent += self._vision(usec, place_m, covariance_m2)
            elif self._told.position == "gps":
                sent += self._gps(usec, place_m, covariance_m2, used)
        return sent + (self._changes(result) if self._told.texts and result.rejection is None else [])

    def text(self, severity: int, sentence: str) -> list[bytes]:
        """A status text."""
        return self._packed(dialect.MAVLink_statustext_message(severity, sentence.encode()[:TEXT_BYTES]))

    def _packed(self, message: dialect.MAVLink_message) -> list[bytes]:
        data = bytes(message.pack(self._link))
        self._link.seq = (self._link.seq + 1) % 256
        return [data]

    def _is_due(self, what: str, now_s: float, every_s: float) -> bool:
        if now_s - self._due_s[what] < every_s:
            return False
        self._due_s[what] = now_s
        return True

    def _vision(self, usec: int, place_m: Sequence[float], covariance_m2: np.ndarray) -> list[bytes]:
        north_m, east_m, down_m = self._origin.ned_m(place_m)
        whole = np.full((6, 6), math.nan)
        whole[:3, :3] = self._origin.ned_covariance_m2(covariance_m2)
        yaw_rad = self._yaw_rad if math.isfinite(self._yaw_rad) else 0.0
        message = dialect.MAVLink_vision_position_estimate_message(
            usec, north_m, east_m, down_m, 0.0, 0.0, yaw_rad, whole[np.triu_indices(6)].tolist()
        )
        return self._packed(message)

    def _gps(self, usec: int, place_m: Sequence[float], covariance_m2: np.ndarray, used: int) -> list[bytes]:
        degrees = self._origin.degrees(place_m)
        if degrees is None:
            return []
        lon_deg, lat_deg, altitude_m = degrees
        variances = np.diag(self._origin.ned_covariance_m2(covariance_m2))
        week, second = divmod(1e-6 * usec - GPS_EPOCH_S, WEEK_S)
        flags = IGNORED | (dialect.GPS_INPUT_IGNORE_FLAG_ALT if len(place_m) < 3 else 0)
        message = dialect.MAVLink_gps_input_message(
            usec, 0, flags, round(1000.0 * second), int(week) if week >= 0.0 else 0, 3, round(1e7 * lat_deg),
            round(1e7 * lon_deg), altitude_m, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.sqrt(variances[0] + variances[1]),
            math.sqrt(variances[2]), min(used, 255),
        )  # fmt: skip
        return self._packed(message)

    def _changes(self, result: EpochResult) -> list[bytes]:
        sent: list[bytes] = []
        now_s = time.monotonic()
        for verdict in result.verdicts:
            hidden = verdict.occluded
            was, told_s = self._sights.get(verdict.anchor_id, (False, -math.inf))
            if hidden == was or now_s - told_s < TEXT_AGAIN_S:
                continue
            self._sights[verdict.anchor_id] = hidden, now_s
            said = f"occluded {verdict.excess_m:+.1f} m" if hidden else "in sight again"
            severity = dialect.MAV_SEVERITY_WARNING if hidden else dialect.MAV_SEVERITY_INFO
            sent += self.text(severity, f"{verdict.anchor_id[:24]} {said}")
        has_position = result.position is not None
        if has_position != self._had_position:
            self._had_position = has_position
            severity = dialect.MAV_SEVERITY_INFO if has_position else dialect.MAV_SEVERITY_WARNING
            sent += self.text(severity, "Ranges: position again" if has_position else "Ranges: no position")
        return sent

    def _global_origin(self) -> list[bytes]:
        self._origin_tries -= 1
        lon_deg, lat_deg = self._origin.lon_deg, self._origin.lat_deg
        if lon_deg is None or lat_deg is None:
            return []
        altitude_mm = round(1000.0 * (self._origin.at_m[2] + self._origin.sea_level_m))
        return self._packed(
            dialect.MAVLink_set_gps_global_origin_message(
                self._told.vehicle, round(1e7 * lat_deg), round(1e7 * lon_deg), altitude_mm
            )
        )

    def _asked_parameters(self) -> list[bytes]:
        sent: list[bytes] = []
        for parameter in self._parameters:
            if parameter.held or parameter.tries > MOST_TRIES:
                continue
            parameter.tries += 1
            if parameter.tries > MOST_TRIES:
                self.problems.append(f"The vehicle does not confirm {parameter.name} = {parameter.value:g}.")
                continue
            message = dialect.MAVLink_param_set_message(
                self._told.vehicle, dialect.MAV_COMP_ID_AUTOPILOT1, parameter.name.encode(), parameter.value,
                dialect.MAV_PARAM_TYPE_REAL32,
            )  # fmt: skip
            sent += self._packed(message)
        return sent

    def _target(self, anchor: RangingAnchor) -> list[bytes]:
        degrees = self._origin.degrees((anchor.east_m, anchor.north_m, anchor.altitude_m))
        if degrees is None:
            return []
        lon_deg, lat_deg, altitude_m = degrees
        # an address that no aeroplane has, the same for an id at all times
        address = 0xF00000 | (zlib.crc32(anchor.id.encode()) & 0x0FFFFF)
        message = dialect.MAVLink_adsb_vehicle_message(
            address, round(1e7 * lat_deg), round(1e7 * lon_deg), dialect.ADSB_ALTITUDE_TYPE_GEOMETRIC,
            round(1000.0 * altitude_m), 0, 0, 0, anchor.id.encode()[:8], dialect.ADSB_EMITTER_TYPE_UAV, 0,
            TARGET_FLAGS, 0,
        )  # fmt: skip
        return self._packed(message)


def _beacon_parameters(origin: NedOrigin) -> list[Parameter]:
    """ArduPilot's BCN_*: beacons are told along true north, so that it has nothing to turn."""
    if origin.lon_deg is None or origin.lat_deg is None:
        return []
    return [
        Parameter("BCN_LATITUDE", origin.lat_deg),
        Parameter("BCN_LONGITUDE", origin.lon_deg),
        Parameter("BCN_ALT", origin.at_m[2] + origin.sea_level_m),
        Parameter("BCN_ORIENT_YAW", 0.0),
    ]
