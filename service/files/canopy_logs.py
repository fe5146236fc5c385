"""Logs of what was heard through trees: CSV of any program, and GNSS pairs as gnssvod writes them (NetCDF)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from service.errors import RequestError
from service.files.csv_table import Numbers, check_columns, holds_nothing, read_csv_table

__all__ = ["COLUMNS", "CanopyLog", "read_canopy_log", "read_paired_stations"]

Reals = npt.NDArray[np.float64]
WHAT = "log"
# of whom, where, from which direction, and what was heard
TEXTS = ("anchor_id", "satellite")
COLUMNS = {
    "time_s": "seconds",
    "anchor_id": "what sent",
    "satellite": "the same",
    "east_m": "place of the receiver, metres in the DEM's CRS",
    "north_m": "place of the receiver, metres in the DEM's CRS",
    "lon_deg": "the same in degrees",
    "lat_deg": "the same",
    "above_ground_m": "height of the receiver",
    "altitude_m": "the same",
    "azimuth_deg": "direction of what sent, clockwise from grid north",
    "elevation_deg": "direction of what sent, above the horizontal",
    "loss_db": "what the trees took",
    "cn0_dbhz": "C/N0 below the trees",
    "cn0_open_dbhz": "C/N0 of the same in the open",
    "power_dbm": "power that arrived",
}
# beyond which a number is of no log, whatever its sign
MOST = {
    **dict.fromkeys(("loss_db", "cn0_dbhz", "cn0_open_dbhz", "power_dbm"), 1e3),
    **dict.fromkeys(("above_ground_m", "altitude_m"), 1e6),
    **dict.fromkeys(("east_m", "north_m"), 1e9),
    **{"lat_deg": 90.0, "elevation_deg": 90.0, "lon_deg": 360.0, "azimuth_deg": 720.0},
}


@dataclass(frozen=True, eq=False, slots=True)
class CanopyLog:
    """n rows; columns: (n,) numbers of those columns that the log has, NaN = empty; source: (n,) who sent."""

    name: str
    columns: dict[str, Reals]
    source: npt.NDArray[np.str_]

    @property
    def count(self) -> int:
        """How many rows."""
        return len(self.source)

    def has(self, *names: str) -> bool:
        """Whether all of these columns are there."""
        return all(name in self.columns for name in names)

    def column(self, name: str) -> Reals:
        """(n,) a column. Raises RequestError where it is missing."""
        if name not in self.columns:
            raise RequestError(f"The log {self.name} has no column {name}: {COLUMNS[name]}.")
        return self.columns[name]


def read_canopy_log(path: Path) -> CanopyLog:
    """A CSV whose first line names columns out of COLUMNS, in the order of time. Raises RequestError."""
    table = read_csv_table(path, WHAT)
    check_columns(table, WHAT, tuple(COLUMNS))
    numbers = Numbers(table.delimiter)
    names = [name for name in table.columns if name not in TEXTS]
    found: dict[str, list[float]] = {name: [] for name in names}
    sources = []
    for where, cells in table.lines:
        for name in names:
            cell = cells[name]
            value = math.nan if holds_nothing(cell) else numbers.number(where, name, cell)
            if abs(value) > MOST.get(name, math.inf):
                raise RequestError(f"{where}: {name} must lie within ±{MOST[name]:,.0f}, not {value:g}.")
            found[name].append(value)
        sources.append(next((cells[name] for name in TEXTS if cells.get(name)), ""))
    if not sources:
        raise RequestError(f"The log {table.name} has no rows.")
    log = CanopyLog(table.name, {name: np.array(values) for name, values in found.items()}, np.array(sources))
    if not (log.has("loss_db") or log.has("cn0_dbhz", "cn0_open_dbhz") or log.has("power_dbm")):
        raise RequestError(f"The log {table.name} needs loss_db, cn0_dbhz with cn0_open_dbhz, or power_dbm.")
    return log


def read_paired_stations(path: Path, below: str, above: str, system: str = "G") -> CanopyLog:
    """Two receivers of a gnssvod file, one below the trees and one in the open, as such a log.

    system: first letter of the satellites that are taken, whose S1 is on one carrier (G: GPS L1). Raises RequestError.
    """
    import netCDF4

    try:
        with netCDF4.Dataset(path) as day:
            stations, satellites = day["Station"][:].tolist(), np.array(day["SV"][:].tolist())
            values = {
                name: np.ma.filled(day[name][:].astype(np.float64), np.nan) for name in ("S1", "Azimuth", "Elevation")
            }
            second = np.asarray(day["Epoch"][:], np.float64)
    except OSError as error:
        raise RequestError(f"The log {path.name} is no NetCDF file that can be read.") from error
    except IndexError as error:
        raise RequestError(f"The log {path.name} is not as gnssvod would write it: {error.args[0]!s}.") from error
    for station in (below, above):
        if station not in stations:
            raise RequestError(f"The log {path.name} has no station {station!r}, but {', '.join(map(str, stations))}.")
    low, high = stations.index(below), stations.index(above)
    ours = np.char.startswith(satellites.astype(str), system)
    if not ours.any():
        raise RequestError(f"The log {path.name} has no satellites {system!r}.")
    heard = {
        "cn0_dbhz": values["S1"][low][:, ours],
        "cn0_open_dbhz": values["S1"][high][:, ours],
        "azimuth_deg": values["Azimuth"][high][:, ours],
        "elevation_deg": values["Elevation"][high][:, ours],
    }
    known = np.isfinite(heard["cn0_dbhz"]) & np.isfinite(heard["cn0_open_dbhz"]) & np.isfinite(heard["elevation_deg"])
    times_s = np.broadcast_to(second[:, None], known.shape)[known]
    columns = {"time_s": times_s, **{name: array[known] for name, array in heard.items()}}
    return CanopyLog(path.name, columns, np.broadcast_to(satellites[ours].astype(str)[None, :], known.shape)[known])
