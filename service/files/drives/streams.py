"""Logs of messages of a drive: inertial units and satellite receivers of ROS, MAVLink, PX4's ULog and DataFlash."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from service.errors import RequestError
from service.files.logs.form import LogForm
from service.files.logs.known import choose_streams
from service.files.logs.message_rows import Rows
from service.files.logs.messages import Message, MessageLog, Stream, number_at
from service.files.logs.opening import open_messages

from .rows import DriveRows, Field

__all__ = ["read_drive_streams"]


@dataclass(frozen=True, slots=True)
class _Unit:
    """Paths of forces along and turn rates about x, y, z, and what they are to be multiplied with."""

    forces: str
    rates: str
    force_factor: float = 1.0
    rate_factor: float = 1.0
    rank: int = 1


@dataclass(frozen=True, slots=True)
class _Receiver:
    """Paths of latitude, longitude, altitude with factors; sigmas, east, north, up, or speed and course, where told."""

    place: str
    degrees: float = 1.0
    metres: float = 1.0
    sigmas: str = ""
    sigma_factor: float = 1.0
    velocity: str = ""
    up_sign: float = 1.0
    variances: bool = False
    rank: int = 1


GRAVITY = 9.80665
UNITS: dict[str, dict[str, _Unit]] = {
    "ros": {
        "Imu": _Unit(
            "linear_acceleration.x linear_acceleration.y linear_acceleration.z",
            "angular_velocity.x angular_velocity.y angular_velocity.z",
        )
    },
    "mavlink": {
        "HIGHRES_IMU": _Unit("xacc yacc zacc", "xgyro ygyro zgyro", rank=3),
        "SCALED_IMU": _Unit("xacc yacc zacc", "xgyro ygyro zgyro", GRAVITY / 1000.0, 1e-3, 2),
        "RAW_IMU": _Unit("xacc yacc zacc", "xgyro ygyro zgyro", GRAVITY / 1000.0, 1e-3),
    },
    "ulog": {
        "sensor_combined": _Unit(
            "accelerometer_m_s2[0] accelerometer_m_s2[1] accelerometer_m_s2[2]", "gyro_rad[0] gyro_rad[1] gyro_rad[2]"
        )
    },
    "dataflash": {"IMU": _Unit("AccX AccY AccZ", "GyrX GyrY GyrZ")},
}
RECEIVERS: dict[str, dict[str, _Receiver]] = {
    "ros": {
        "NavSatFix": _Receiver(
            "latitude longitude altitude",
            sigmas="position_covariance[0] position_covariance[8]",
            variances=True,
        )
    },
    "mavlink": {
        "GPS_RAW_INT": _Receiver("lat lon alt", 1e-7, 1e-3, "h_acc v_acc", 1e-3, "vel cog"),
    },
    "ulog": {
        "vehicle_gps_position": _Receiver(
            "lat lon alt", 1e-7, 1e-3, "eph epv", velocity="vel_e_m_s vel_n_m_s vel_d_m_s", up_sign=-1.0
        ),
        "sensor_gps": _Receiver(
            "latitude_deg longitude_deg altitude_msl_m",
            sigmas="eph epv",
            velocity="vel_e_m_s vel_n_m_s vel_d_m_s",
            up_sign=-1.0,
            rank=2,
        ),
    },
    "dataflash": {"GPS": _Receiver("Lat Lng Alt")},
}
# of these families the vehicle's axes are forward, right, down
DOWNWARD = ("mavlink", "ulog", "dataflash")
# MAVLink says so of what is not known
NO_COURSE = 65535.0


def read_drive_streams(path: Path, form: LogForm, into: DriveRows) -> None:
    """Add what a log of messages holds. Raises RequestError, also for one without inertial readings."""
    log = open_messages(path)
    unit_of, receiver_of = UNITS.get(log.family, {}), RECEIVERS.get(log.family, {})
    units = [one for one in log.streams if _short(one) in unit_of]
    receivers = [one for one in log.streams if _short(one) in receiver_of]
    if not units:
        names = ", ".join(sorted(one.name for one in log.streams)[:12])
        raise RequestError(f"In the log {path.name} ({log.format}) no messages are an inertial unit's; it has {names}.")
    unit = max(units, key=lambda one: (unit_of[_short(one)].rank, one.count))
    receiver = max(receivers, key=lambda one: (receiver_of[_short(one)].rank, one.count)) if receivers else None
    if log.family in DOWNWARD:
        into.axes = "frd"
    into.told += [*log.told, f"{path.name}: taken for inertial readings is {unit.name}, {_beside(units, unit)}"]
    into.streams[unit.name] = "inertial readings"
    if receiver is not None:
        into.streams[receiver.name] = "fixes"
        into.told.append(f"{path.name}: taken for fixes is {receiver.name}, {_beside(receivers, receiver)}")
    maps = form.streams or tuple(one for one in choose_streams(log).maps if one.role == "ranges")
    rows = Rows.of(maps, form.ids)
    taken = {unit.name, *(one.stream for one in maps), *([] if receiver is None else [receiver.name])}
    for message in log.read(taken):
        at_s = _stamp(log, message)
        if message.stream == unit.name:
            _reading(message, at_s, unit_of[_short(unit)], into)
        elif receiver is not None and message.stream == receiver.name:
            _fix(message, at_s, receiver_of[_short(receiver)], into)
        into.take(rows.take(message))


def _short(stream: Stream) -> str:
    return stream.kind.rsplit("/", 1)[-1]


def _beside(found: Collection[Stream], taken: Stream) -> str:
    others = [one.name for one in found if one is not taken]
    return f"not {', '.join(others[:4])}." if others else "the only one."


def _stamp(log: MessageLog, message: Message) -> float:
    stamp = number_at(message.body, "header.stamp") if log.family == "ros" else None
    return stamp if stamp is not None and stamp > 0.0 else message.time_s


def _numbers(message: Message, paths: str) -> list[float] | None:
    found = [number_at(message.body, path) for path in paths.split()]
    return None if any(one is None or not math.isfinite(one) for one in found) else [one or 0.0 for one in found]


def _reading(message: Message, at_s: float, unit: _Unit, into: DriveRows) -> None:
    force, rate = _numbers(message, unit.forces), _numbers(message, unit.rates)
    if force is None or rate is None:
        return
    x, y, z = (unit.force_factor * one for one in force)
    p, q, r = (unit.rate_factor * one for one in rate)
    into.times_s.append(at_s)
    into.forces.append((x, y, z))
    into.rates.append((p, q, r))


def _fix(message: Message, at_s: float, receiver: _Receiver, into: DriveRows) -> None:
    place = _numbers(message, receiver.place)
    if place is None or (place[0] == 0.0 and place[1] == 0.0):
        return  # which is how receivers say that they know none
    fix: dict[str, Field] = {
        "time_s": at_s,
        "lat_deg": place[0] * receiver.degrees,
        "lon_deg": place[1] * receiver.degrees,
        "altitude_m": place[2] * receiver.metres,
    }
    sigmas = _numbers(message, receiver.sigmas) if receiver.sigmas else None
    for name, value in zip(("horizontal_sigma_m", "vertical_sigma_m"), sigmas or (), strict=False):
        sigma_m = math.sqrt(max(value, 0.0)) if receiver.variances else value * receiver.sigma_factor
        if sigma_m > 0.0:
            fix[name] = sigma_m
    velocity = _numbers(message, receiver.velocity) if receiver.velocity else None
    if velocity is not None and len(velocity) == 3:
        fix["velocity_m_per_s"] = [velocity[0], velocity[1], receiver.up_sign * velocity[2]]
    elif velocity is not None and NO_COURSE not in velocity:
        speed, course = velocity[0] / 100.0, math.radians(velocity[1] / 100.0)
        fix["velocity_m_per_s"] = [speed * math.sin(course), speed * math.cos(course), 0.0]
    into.fixes.append(fix)
