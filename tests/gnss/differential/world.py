"""Two receivers under a made-up constellation, written as RINEX: every range is exact but for its stated noise."""

import math
from dataclasses import dataclass

import numpy as np

from gnss import (
    BroadcastEphemeris,
    Ephemerides,
    GpsTime,
    Place,
    enu_to_ecef_m,
    ephemeris_positions_ecef_m,
    instants,
    look_angles,
    place_ecef_m,
)

LIGHT = 299_792_458.0
EARTH_RATE = 7.2921151467e-5
WAVELENGTH_M = LIGHT / 1575.42e6
START = GpsTime(1877, 388_800.0)
PLACE = Place(8.5, 47.0, 500.0)
CODE_M, PHASE_M = 0.2, 0.002


def constellation():
    return Ephemerides(
        tuple(
            BroadcastEphemeris(
                prn=1 + 5 * plane + slot,
                toe=START,
                sqrt_semi_major_axis_sqrt_m=5153.7,
                eccentricity=0.005,
                mean_anomaly_rad=slot * math.pi / 2.5 + plane * math.pi / 12.0,
                mean_motion_difference_rad_per_s=0.0,
                argument_of_perigee_rad=0.5,
                node_longitude_rad=plane * math.pi / 3.0,
                node_rate_rad_per_s=-8e-9,
                inclination_rad=math.radians(55.0),
                inclination_rate_rad_per_s=0.0,
                **dict.fromkeys(("latitude_cos_rad", "latitude_sin_rad", "radius_cos_m", "radius_sin_m"), 0.0),
                inclination_cos_rad=0.0,
                inclination_sin_rad=0.0,
            )
            for plane in range(6)
            for slot in range(5)
        )
    )


ORBITS = constellation()


@dataclass
class Heard:
    """Epochs of one receiver: (code m, phase cycles) by satellite."""

    times: list
    rows: list


def in_sight():
    positions = ephemeris_positions_ecef_m(ORBITS, [one.id for one in ORBITS.sets], instants(START))[:, 0]
    up = look_angles(PLACE, positions).elevation_rad
    return [one.id for one, height in zip(ORBITS.sets, up, strict=True) if height > math.radians(15.0)]


def sent_from(name, time, place_m):
    """Where a satellite was when it sent what arrives now, in the frame of now, and the range."""
    flight_s = 0.075
    for _ in range(4):
        at = ephemeris_positions_ecef_m(ORBITS, [name], instants(time.plus(-flight_s)))[0, 0]
        turn = EARTH_RATE * flight_s
        at = np.array([[math.cos(turn), math.sin(turn), 0], [-math.sin(turn), math.cos(turn), 0], [0, 0, 1]]) @ at
        flight_s = float(np.linalg.norm(at - place_m)) / LIGHT
    return at, flight_s * LIGHT


def heard(places_m, rng, clock_m=0.0, names=None):
    """What a receiver at those places measures, an epoch a second."""
    names = in_sight() if names is None else names
    whole = {name: int(rng.integers(-1000, 1000)) for name in names}
    times = [START.plus(float(n)) for n in range(len(places_m))]
    rows = []
    for time, place_m in zip(times, places_m, strict=True):
        row = {}
        for name in names:
            range_m = sent_from(name, time, place_m)[1] + clock_m
            phase = (range_m + rng.normal(0.0, PHASE_M)) / WAVELENGTH_M + whole[name]
            row[name] = (range_m + rng.normal(0.0, CODE_M), phase)
        rows.append(row)
    return Heard(times, rows)


def base_m():
    return place_ecef_m(PLACE)


def circle_m(count, radius_m=25.0):
    turn = np.linspace(0.0, math.pi, count)
    enu = np.stack([radius_m * np.sin(turn), radius_m * np.cos(turn), np.zeros(count)], axis=1)
    return enu_to_ecef_m(PLACE, enu)


def labelled(text, label):
    return f"{text:60.60}{label}"


def header(version, kind, lines=()):
    first = f"{version:9.2f}           {kind}"
    return [labelled(first, "RINEX VERSION / TYPE"), *lines, labelled("", "END OF HEADER")]


def navigation_text(orbits=ORBITS):
    lines = header(2.10, "N: GPS NAV DATA")
    for one in orbits.sets:
        utc = one.toe.utc(leap_seconds=0)
        rows = [
            [1.0, 0.0, one.mean_motion_difference_rad_per_s, one.mean_anomaly_rad],
            [0.0, one.eccentricity, 0.0, one.sqrt_semi_major_axis_sqrt_m],
            [one.toe.second_of_week, 0.0, one.node_longitude_rad, 0.0],
            [one.inclination_rad, 0.0, one.argument_of_perigee_rad, one.node_rate_rad_per_s],
            [0.0, 1.0, float(one.toe.week), 0.0],
            [2.0, 0.0, 0.0, 1.0],
            [one.toe.second_of_week - 7200.0, 4.0],
        ]
        epoch = f"{utc:%y} {utc.month:2d} {utc.day:2d} {utc.hour:2d} {utc.minute:2d}  0.0"
        lines.append(f"{one.prn:2d} {epoch}" + number(0.0) * 3)
        lines += ["   " + "".join(number(value) for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def number(value):
    return f"{value:19.12E}".replace("E", "D")


def observation_text(told, place_m, version=2.10):
    """RINEX 2.10 or 3.02 of one receiver."""
    x, y, z = place_m
    position = labelled(f"{x:14.4f}{y:14.4f}{z:14.4f}", "APPROX POSITION XYZ")
    kinds = (
        labelled("     2    C1    L1", "# / TYPES OF OBSERV")
        if version < 3.0
        else labelled("G    2 C1C L1C", "SYS / # / OBS TYPES")
    )
    lines = header(version, "OBSERVATION DATA    G (GPS)", [position, kinds])
    for time, row in zip(told.times, told.rows, strict=True):
        utc = time.utc(leap_seconds=0)
        second = utc.second + utc.microsecond * 1e-6
        if version < 3.0:
            when = f" {utc:%y} {utc.month:2d} {utc.day:2d} {utc.hour:2d} {utc.minute:2d}{second:11.7f}  0{len(row):3d}"
            names = list(row)
            for first in range(0, len(names), 12):
                lines.append((when if first == 0 else " " * 32) + "".join(names[first : first + 12]))
        else:
            lines.append(f"> {utc:%Y %m %d %H %M}{second:11.7f}  0{len(row):3d}")
        for name, (code, phase) in row.items():
            lines.append(("" if version < 3.0 else name) + f"{code:14.3f}  {phase:14.3f} 8")
    return "\n".join(lines) + "\n"
