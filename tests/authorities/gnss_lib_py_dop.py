"""How gnss_lib_py_dop.json was made: gnss-lib-py 1.1.0 with numpy 2.4 on Python 3.11, in an environment of its own.

    pip install gnss-lib-py==1.1.0 && python gnss_lib_py_dop.py > gnss_lib_py_dop.json

The library brings pandas, plotly, georinex, xarray and a browser engine with it, so the tests do not install it.
"""

import json

import numpy as np
from gnss_lib_py.navdata.navdata import NavData
from gnss_lib_py.utils.dop import calculate_dop

rng = np.random.default_rng(20261122)
cases = []
for satellites in (4, 5, 6, 8, 12, 20):
    for _ in range(4):
        data = NavData()
        data["el_sv_deg"] = np.round(rng.uniform(3.0, 89.0, satellites), 3)
        data["az_sv_deg"] = np.round(rng.uniform(0.0, 360.0, satellites), 3)
        found = calculate_dop(data)
        case = {"elevation_deg": data["el_sv_deg"].tolist(), "azimuth_deg": data["az_sv_deg"].tolist()}
        cases.append(case | {name.lower(): float(found[name]) for name in ("GDOP", "PDOP", "HDOP", "VDOP", "TDOP")})
print("[\n" + ",\n".join(json.dumps(case) for case in cases) + "\n]")
