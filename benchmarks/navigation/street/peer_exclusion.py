"""gnss_lib_py's exclusion by residuals, in whatever Python has it: ``python peer_exclusion.py ROWS.npz FOUND.npz``.

It stands alone, for the library wants a NumPy of its own. Rows: epoch, measured_m, places_m (n, 3) and thresholds (t,);
found: excluded (t, n).
"""

from __future__ import annotations

import importlib
import sys

import numpy as np


def main() -> None:
    """Exclude at each threshold."""
    navdata = importlib.import_module("gnss_lib_py.navdata.navdata")
    fde = importlib.import_module("gnss_lib_py.algorithms.fde")
    rows, found = np.load(sys.argv[1]), []
    for threshold in rows["thresholds"]:
        table = navdata.NavData()
        table["gps_millis"] = rows["epoch"] * 1000.0
        for axis, name in enumerate(("x_sv_m", "y_sv_m", "z_sv_m")):
            table[name] = rows["places_m"][:, axis]
        table["b_sv_m"] = np.zeros(len(rows["epoch"]))
        table["corr_pr_m"] = rows["measured_m"]
        told = fde.solve_fde(table, method="residual", threshold=float(threshold))
        found.append(np.atleast_1d(told["fault_residual"]) == 1)
    np.savez(sys.argv[2], excluded=np.array(found))


if __name__ == "__main__":
    main()
