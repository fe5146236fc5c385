"""A rover's client: opens a session over a DEM, sends an epoch of ranges a second, drives on what comes back.

    python examples/rover.py http://127.0.0.1:8000    (with SIGHTLINE_KEY in the environment where a key is needed)

Here the ranges are made up, from drones over the bundled DEM of Jacksboro; a rover sends what its radio measures.
"""

import json
import math
import os
import sys

import httpx
from websockets.sync.client import connect

DRONES = [
    {"id": "D1", "east_m": 748920.0, "north_m": 4023535.5, "altitude_m": 754.8},
    {"id": "D2", "east_m": 751420.0, "north_m": 4021035.5, "altitude_m": 435.0},
    {"id": "D3", "east_m": 748920.0, "north_m": 4018535.5, "altitude_m": 802.9},
    {"id": "D4", "east_m": 747152.2, "north_m": 4019267.7, "altitude_m": 983.1},
    {"id": "D5", "east_m": 747152.2, "north_m": 4022803.2, "altitude_m": 866.8},
]


def measured_ranges(second: int) -> list[dict[str, object]]:
    """Stands in for the radio: straight ranges from a rover that goes west at 1 m/s."""
    place_m = (750609.1 - second, 4020739.0, 391.5)
    drones_m = {drone["id"]: (drone["east_m"], drone["north_m"], drone["altitude_m"]) for drone in DRONES}
    return [{"anchor_id": id, "range_m": math.dist(at_m, place_m)} for id, at_m in drones_m.items()]


def main(url: str, seconds: int = 5) -> None:
    """Drive for so many seconds."""
    headers = {"Authorization": f"Bearer {key}"} if (key := os.environ.get("SIGHTLINE_KEY")) else {}
    with httpx.Client(base_url=url, timeout=60.0, trust_env=False, headers=headers) as http:
        dem = http.post("/dems", params={"sample": "jacksboro"}).raise_for_status().json()
        asked = {"anchors": DRONES, "dem_id": dem["id"], "settings": {"max_speed_m_per_s": 2.0, "harmful_m": 0.5}}
        links = http.post("/detectors", json=asked).raise_for_status().json()["links"]
        with connect(url.replace("http", "ws", 1) + links["stream"], proxy=None, additional_headers=headers) as stream:
            for second in range(seconds):
                stream.send(json.dumps({"time_s": float(second), "ranges": measured_ranges(second)}))
                answer = json.loads(stream.recv())
                sight = ", ".join(f"{one['anchor_id']} {one['p_sight']:.0%}" for one in answer["predicted"])
                print(f"{answer['time_s']:.0f} s: {answer['summary']} The map foretold: {sight}.")
        print("map doubts:", len(http.get(links["map_doubts"]).raise_for_status().json()["features"]))


if __name__ == "__main__":
    main(sys.argv[1])
