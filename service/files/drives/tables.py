"""Tables of a drive: readings, fixes and speeds by the names of their columns, ranges as range logs have them."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from service.errors import RequestError
from service.files.csv_table import CsvTable, Numbers, holds_nothing, read_csv_table
from service.files.logs.columns import find_columns
from service.files.logs.form import LogForm
from service.files.logs.times import TimeReader, date_order_of
from service.files.range_log import read_range_log

from .rows import DriveRows, Field

__all__ = ["read_drive_table"]

AXES = "xyz"
FORCE, RATE = (
    re.compile(rf"(?:.*[_. /])?(?:{names})[_. ]?([xyz])(?:[_. \[(]+({units}))?[\])]?", re.IGNORECASE)
    for names, units in (
        (
            "a|f|acc|accel|acceleration|accelerometer|linear_acceleration|force|forces|specific_force|fb",
            r"m_?/?_?s\^?2|m_per_s2|mps2|g",
        ),
        (
            "w|g|gyr|gyro|gyroscope|omega|rate|rates|angular_velocity|angular_rate|turn_rate|wb",
            r"rad_?/?_?s|rad_per_s|rps|deg_?/?_?s|deg_per_s|dps",
        ),
    )
)
# our name: names that columns have, in small letters
FIXES = {
    "lat_deg": ("lat_deg", "latitude_deg", "latitude", "lat"),
    "lon_deg": ("lon_deg", "longitude_deg", "longitude", "lon", "lng", "long"),
    "east_m": ("east_m", "easting", "east"),
    "north_m": ("north_m", "northing", "north"),
    "altitude_m": ("altitude_m", "altitude", "alt", "alt_m", "height_m", "height", "h", "ele", "up_m"),
    "horizontal_sigma_m": ("horizontal_sigma_m", "sigma_horizontal_m", "h_acc", "hacc", "eph"),
    "vertical_sigma_m": ("vertical_sigma_m", "sigma_up_m", "v_acc", "vacc", "epv"),
    "velocity_east": ("east_m_per_s", "velocity_east_m_per_s", "vel_e", "ve", "vel_e_m_s"),
    "velocity_north": ("north_m_per_s", "velocity_north_m_per_s", "vel_n", "vn", "vel_n_m_s"),
    "velocity_up": ("up_m_per_s", "velocity_up_m_per_s", "vel_u", "vu", "vel_u_m_s"),
    "velocity_sigma_m_per_s": ("velocity_sigma_m_per_s", "s_acc", "sacc"),
}
SPEED = ("forward_m_per_s", "speed_m_per_s", "speed", "forward_speed", "odometer_speed", "velocity_forward")
VELOCITY = ("velocity_east", "velocity_north", "velocity_up")


def read_drive_table(path: Path, form: LogForm, anchor_ids: Collection[str], into: DriveRows) -> None:
    """Add what a table holds. Raises RequestError for one that holds nothing of a drive."""
    table = read_csv_table(path, "log")
    columns = table.columns
    forces, rates = _vector(columns, FORCE), _vector(columns, RATE)
    small = {column.casefold(): column for column in columns}
    fixes = {name: small[one] for name, known in FIXES.items() for one in known[::-1] if one in small}
    placed = "altitude_m" in fixes and ({"lat_deg", "lon_deg"} <= fixes.keys() or {"east_m", "north_m"} <= fixes.keys())
    speed = next((small[one] for one in SPEED if one in small), None)
    if bool(forces) != bool(rates):
        lacks = "turn rates" if forces else "forces"
        such_as = "gyro_x" if forces else "acc_x"
        raise RequestError(f"The log {path.name} has no three columns of {lacks}, such as {such_as}.")
    if not (forces or placed or speed):
        log = read_range_log(path, form, anchor_ids)
        into.take(log.rows)
        into.told += log.warnings
        return
    lines = list(table.lines)
    numbers = Numbers(table.delimiter)
    time_of = _times(table, form, lines, numbers)
    if forces:
        _told_units(path.name, forces, rates, into)
    for where, cells in lines:
        time_s = time_of(where, cells)
        if forces and not any(holds_nothing(cells[one]) for one in (*forces.values(), *rates.values())):
            values = [numbers.number(where, one, cells[one]) for one in (*forces.values(), *rates.values())]
            into.times_s.append(time_s)
            into.forces.append((values[0], values[1], values[2]))
            into.rates.append((values[3], values[4], values[5]))
        if placed:
            _fix(where, cells, time_s, fixes, numbers, into)
        if speed is not None and not holds_nothing(cells[speed]):
            into.speeds.append({"time_s": time_s, "forward_m_per_s": numbers.number(where, speed, cells[speed])})


def _vector(columns: Collection[str], pattern: re.Pattern[str]) -> dict[str, str]:
    """Axis to column where all three are there, in columns alike but for the axis; {} where not."""
    found: dict[str, dict[str, str]] = {}
    for column in columns:
        match = pattern.fullmatch(column)
        if match is not None and "cov" not in column.casefold():
            stem = column[: match.start(1)] + column[match.end(1) :]
            found.setdefault(stem.casefold(), {})[match[1].casefold()] = column
    whole = [{axis: axes[axis] for axis in AXES} for axes in found.values() if set(axes) == set(AXES)]
    return max(whole, key=lambda axes: len(axes["x"])) if whole else {}


def _told_units(name: str, forces: Mapping[str, str], rates: Mapping[str, str], into: DriveRows) -> None:
    """The units that names of columns say."""
    (force, rate) = (FORCE.fullmatch(forces["x"]), RATE.fullmatch(rates["x"]))
    if force is not None and force[2]:
        into.force_unit = "g" if force[2].casefold() == "g" else "m/s2"
    if rate is not None and rate[2]:
        into.rate_unit = "deg/s" if rate[2].casefold().startswith("d") else "rad/s"
    of_units = f" in {into.force_unit}" if into.force_unit else "", f" in {into.rate_unit}" if into.rate_unit else ""
    into.told.append(
        f"{name}: taken for forces are {', '.join(forces.values())}{of_units[0]}, for turn rates "
        f"{', '.join(rates.values())}{of_units[1]}."
    )


def _times(
    table: CsvTable, form: LogForm, lines: list[tuple[str, dict[str, str]]], numbers: Numbers
) -> Callable[[str, Mapping[str, str]], float]:
    """What reads the time of a line."""
    found = find_columns(table.name, table.columns, ("anchor_id", "range_m"))
    column = form.columns.get("time_s") or found.names.get("time_s")
    if column is None or column not in table.columns:
        raise RequestError(f"The log {table.name} has no column of times; name one time_s, or say --columns time_s=….")
    date, parts = found.names.get("date", ""), found.names.get("nanoseconds", "")
    texts = (f"{cells.get(date, '')} {cells[column]}".strip() for _, cells in lines)
    times = TimeReader(numbers, form.time_unit or found.time_unit, date_order_of(table.name, texts, form.date_order))

    def time_of(where: str, cells: Mapping[str, str]) -> float:
        if holds_nothing(cells[column]):
            raise RequestError(f"{where}: {column} is missing.")
        return times.seconds(where, column, cells[column], cells.get(parts, ""), cells.get(date, ""))

    return time_of


def _fix(
    where: str, cells: Mapping[str, str], time_s: float, names: Mapping[str, str], numbers: Numbers, into: DriveRows
) -> None:
    values = {
        name: numbers.number(where, column, cells[column])
        for name, column in names.items()
        if not holds_nothing(cells[column])
    }
    pair = ("lon_deg", "lat_deg") if "lat_deg" in names else ("east_m", "north_m")
    if any(name not in values for name in (*pair, "altitude_m")):
        return
    fix: dict[str, Field] = {"time_s": time_s, **{name: values[name] for name in (*pair, "altitude_m")}}
    if all(name in values for name in VELOCITY):
        fix["velocity_m_per_s"] = [values[name] for name in VELOCITY]
    for name in ("horizontal_sigma_m", "vertical_sigma_m", "velocity_sigma_m_per_s"):
        if values.get(name, 0.0) > 0.0:
            fix[name] = values[name]
        elif name in values:
            into.no_sigmas += 1
    into.fixes.append(fix)
