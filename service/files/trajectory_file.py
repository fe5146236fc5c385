"""Trajectories as files: where a receiver was at times of its recording, and how it stood."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from gnss import Place, enu_to_ecef_m, place_ecef_m
from gnss.sky import place_of_ecef
from service.errors import RequestError

from .csv_table import Numbers, read_csv_table

__all__ = ["read_trajectory"]

Array = npt.NDArray[np.float64]
ECEF, GEODETIC = ("x_m", "y_m", "z_m"), ("lon_deg", "lat_deg", "height_m")
ANGLES = ("heading_deg", "pitch_deg", "roll_deg")


def read_trajectory(path: Path, lever_arm_m: npt.ArrayLike = (0.0, 0.0, 0.0)) -> tuple[Array, Array, list[str]]:
    """(times (k,) s, the antenna's places (k, 3) ECEF, warnings) of a CSV.

    Columns time_s, and x_m, y_m, z_m (ECEF) or lon_deg, lat_deg, height_m (above the ellipsoid), and for a lever arm
    heading_deg, pitch_deg, roll_deg; without names time and ECEF, as gps-sdr-sim has it. lever_arm_m: (3,) from there
    to the antenna, forward, left, up. Raises RequestError, GnssInputError.
    """
    table = read_csv_table(path, "trajectory", nameless=True)
    numbers, columns = Numbers(table.delimiter), table.columns
    if columns[:4] == ("1", "2", "3", "4"):
        names: tuple[str, ...] = ("1", "2", "3", "4")
        columns = ("time_s", *ECEF)
    else:
        placed = ECEF if set(ECEF) <= set(columns) else GEODETIC
        missing = [name for name in ("time_s", *placed) if name not in columns]
        if missing:
            raise RequestError(
                f"The trajectory {path.name} has no column {missing[0]!r}; it needs time_s, and {', '.join(ECEF)} or "
                f"{', '.join(GEODETIC)}."
            )
        turned = ANGLES if set(ANGLES) <= set(columns) else ()
        names = ("time_s", *placed, *turned)
    rows = []
    for where, cells in table.lines:
        found = numbers.row(where, {name: cells[name] for name in names})
        if len(found) < len(names):
            raise RequestError(f"{where}: {next(name for name in names if name not in found)} is empty.")
        rows.append([found[name] for name in names])
    if not rows:
        raise RequestError(f"The trajectory {path.name} has no row below its header.")
    values = np.array(rows, np.float64)
    places_m, arm = values[:, 1:4], np.asarray(lever_arm_m, np.float64)
    if GEODETIC[0] in names:
        places_m = np.array([place_ecef_m(Place(*row)) for row in places_m])
    if arm.any():
        if ANGLES[0] not in names:
            raise RequestError(f"A lever arm needs {', '.join(ANGLES)} in the trajectory {path.name}.")
        places_m = _moved(places_m, values[:, 4:7], arm)
    unused = [name for name in columns if name not in names] if names[0] == "time_s" else []
    told = f"Columns of {path.name} that are not used: {', '.join(unused)}."
    return values[:, 0], places_m, [told] if unused else []


def _moved(places_m: Array, angles_deg: Array, arm_m: Array) -> Array:
    """The places of the antenna."""
    from navigation.inertial import matrices_of, quaternion_of_angles

    turns = matrices_of([quaternion_of_angles(*angles) for angles in np.radians(angles_deg)])
    return np.array(
        [enu_to_ecef_m(place_of_ecef(place_m), turn @ arm_m) for place_m, turn in zip(places_m, turns, strict=True)]
    )
