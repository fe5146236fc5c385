"""Baselines with whole cycles fixed: GEONET and a simulated circle, against RTKLIB's own program."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.report import Row, Table
from benchmarks.timing import best_of_s
from gnss.differential import BaselineSettings, Fix, read_observations, read_orbits, solve_baseline
from gnss.gps_time import WEEK_S

__all__ = ["baselines"]

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "rtk"
GEONET_M = (2022.7712, -468.6304, 2610.2880)  # of rnx2rtkp 2.4.3 b34
CIRCLE_FROM_S = 1823 * WEEK_S + 6 * 86_400  # 2014-12-20, from which its track counts


def baselines() -> Table:
    """Epochs fixed and their errors."""
    title = "Differential GNSS"
    if not DATA.is_dir():
        return Table(title, ("what",), (Row(("the data are not here",)),))
    rover, base = (read_observations(DATA / "geonet" / f"{name}.05o") for name in ("07590920", "30400920"))
    orbits = read_orbits(DATA / "geonet" / "07590920.05n")
    still = BaselineSettings(moving=False, frequencies=2)
    found = solve_baseline(rover, base, orbits, settings=still)
    seconds = best_of_s(lambda: solve_baseline(rover, base, orbits, settings=still), rounds=3)
    solved, fixed = found.fix != Fix.NONE, found.fix == Fix.FIXED
    off_m = np.linalg.norm(found.baseline_ecef_m - GEONET_M, axis=1)[solved]
    met = bool(fixed.sum() == solved.sum() == 115 and off_m[-1] <= 0.005)
    cells = ("GEONET, 3.3 km, 30 s", f"{fixed.sum()} of {solved.sum()}", f"{1e3 * off_m[-1]:.1f} mm from RTKLIB's")
    rows = [Row((*cells, f"{seconds:.2f} s"), "115 of 115, ≤ 5 mm", met)]
    rover, base = (read_observations(DATA / "simulated" / f"{name}.obs") for name in ("rover", "base"))
    orbits = read_orbits(DATA / "simulated" / "base.nav")
    track, place = (np.loadtxt(DATA / "simulated" / f"{name}.csv", delimiter=",") for name in ("rover", "base"))
    found = solve_baseline(rover, base, orbits, place[0, 1:])
    seconds = best_of_s(lambda: solve_baseline(rover, base, orbits, place[0, 1:]), rounds=3)
    since_s = found.time_s - CIRCLE_FROM_S
    truth = np.stack([np.interp(since_s, track[:, 0], track[:, n]) for n in (1, 2, 3)], axis=1)
    fixed = found.fix == Fix.FIXED
    errors_m = np.linalg.norm(found.rover_ecef_m - truth, axis=1)[fixed]
    rms_mm, worst_mm = 1e3 * float(np.sqrt((errors_m**2).mean())), 1e3 * float(errors_m.max())
    cells = ("a circle, 100 m, 1 Hz", f"{fixed.sum()} of {len(fixed)}", f"{rms_mm:.1f} mm rms, {worst_mm:.0f} at worst")
    met = bool(fixed.sum() >= 207 and rms_mm <= 10.0 and worst_mm < 95.0)
    rows.append(Row((*cells, f"{seconds:.2f} s"), "≥ 207 of 258, ≤ 10 mm rms, none wrong", met))
    note = "RTKLIB fixes 115 of 115 and 207 of 258 (10.1 mm). A wrong fix is off by half a wavelength, 95 mm, or more."
    return Table(title, ("pair", "epochs fixed", "error", "time"), rows, note)
