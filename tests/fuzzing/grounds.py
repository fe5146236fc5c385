"""What a service has that is asked anything: grounds of every kind, a map of each kind, detectors, a mission."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from terrain import ElevationGrid, write_npz
from tests.service.running import Server

__all__ = ["BUDGET", "CHANGES", "NORTH_M", "WEST_M", "made_ids"]

# the ground that the examples of the documentation stand on, roughly
WEST_M, NORTH_M, CELL_M, POSTS = 392_000.0, 3_810_000.0, 500.0, 48
# of examples, so that they are answered here: high enough above this ground, and planned in little time
BUDGET = {"iterations": 300, "seconds": 10.0}
CHANGES: dict[str, dict[str, Any]] = {
    "DriveIn": {"path_m": [[WEST_M + 100.0, NORTH_M - 500.0], [WEST_M + 180.0, NORTH_M - 460.0]]},
    "FlightIn": {"start": {"east_m": 403000.0, "north_m": 3796000.0, "altitude_m": 1500.0}, "budget": BUDGET},
    "PathIn": {"budget": BUDGET},
    "PlacementIn": {"time_limit_s": 3.0},
}


def made_ids(server: Server, folder: Path, document: dict[str, Any]) -> dict[str, list[str]]:
    """Ids of all that, by the names of parameters; folder: for files of grounds. The first are those of examples."""
    schemas = document["components"]["schemas"]
    rows, cols = np.mgrid[:POSTS, :POSTS]
    rough_m = (950.0 + 12.0 * np.sin(rows / 2.0) + 10.0 * np.cos(cols / 3.0)).astype(np.float32)
    holed_m = rough_m.copy()
    holed_m[10:20, 5:9] = np.nan
    grounds = {
        "rough": (rough_m, "EPSG:32611"),
        "local": (rough_m, None),
        "holed": (holed_m, "EPSG:32611"),
        "point": (rough_m[:1, :1], "EPSG:32611"),
        "row": (rough_m[:1], "EPSG:32611"),
        "moon": (rough_m, "IAU_2015:30130"),
    }
    dems = []
    for name, (heights_m, crs) in grounds.items():
        grid = ElevationGrid(heights_m, CELL_M, CELL_M, WEST_M, NORTH_M, crs)
        write_npz(grid, folder / f"{name}.npz")
        dems.append(server.upload(folder / f"{name}.npz")["id"])
    ids = {"dem_id": dems, "map_id": [], "detector_id": []}
    for kind, name in (
        ("visibility-maps", "VisibilityMapIn"),
        ("dop-maps", "DopMapIn"),
        ("morphing-maps", "MorphingMapIn"),
    ):
        example = schemas[name]["examples"][0]
        made = server.until_over(
            server.client.post(f"/{kind}", json={**example, "dem_id": dems[0]}).headers["Location"]
        )
        assert made["status"] == "succeeded", made
        ids["map_id"].append(made["id"])
    path = {**schemas["PathIn"]["examples"][0], **CHANGES["PathIn"], "dem_id": dems[0]}
    planned = server.until_over(server.client.post("/paths", json=path).headers["Location"])
    assert planned["status"] == "succeeded", planned
    ids["path_id"] = [planned["id"]]
    detector = schemas["DetectorIn"]["examples"][0]
    moved = [
        {**one, "east_m": WEST_M + one["east_m"], "north_m": NORTH_M - 600.0 + one["north_m"]}
        for one in detector["anchors"]
    ]
    over_a_map = {"dem_id": dems[0], "anchors": [{**one, "altitude_m": 1100.0 + one["altitude_m"]} for one in moved]}
    for changes in (over_a_map, {}):
        asked = {**detector, **changes, "idle_timeout_s": 900}
        ids["detector_id"].append(server.client.post("/detectors", json=asked).json()["id"])
    ids |= {"mission_id": [server.client.post("/missions", json={"name": "fuzzed"}).json()["id"]], "version": ["1"]}
    return ids
