"""A question for every product on the small ground, with every layer that its answer can have."""

from __future__ import annotations

from typing import Any

from tests.service.small_drives import drive_request
from tests.service.small_flights import flight_request
from tests.service.small_paths import ANCHORS, at, path_request

__all__ = ["ASKED"]

CREW = [
    {"id": name, **at(east_m, south_m), "above_ground_m": 30.0}
    for name, east_m, south_m in (("D1", 700.0, 60.0), ("D2", 100.0, 200.0), ("D3", 780.0, 300.0))
]
TRACK = {"id": "T", "points": [{"time_s": t, **at(60.0 + t, 60.0), "above_ground_m": 80.0} for t in (0.0, 400.0)]}

# product: its request without the DEM
ASKED: dict[str, dict[str, Any]] = {
    "visibility-map": {"anchors": ANCHORS},
    "window-map": {"anchors": [{**anchor, "max_range_m": 2000.0} for anchor in ANCHORS]},
    "dop-map": {
        "anchors": ANCHORS,
        "dop_limit": 30.0,
        "path": [{**at(100.0, 300.0), "above_ground_m": 2.0}, {**at(700.0, 60.0), "above_ground_m": 40.0}],
        "volume": {"ceiling_above_ground_m": 60.0, "layer_m": 30.0},
        "cuts": [{"line": [at(60.0, 320.0), at(700.0, 40.0)]}, {"altitude_m": 150.0}],
    },
    "morphing-map": {
        "anchors": ANCHORS,
        "dop_limit": 30.0,
        "ceiling_above_ground_m": 300.0,
        "tracks": [TRACK],
        "frames": {"to_s": 60.0, "step_s": 30.0, "above_ground_m": 50.0},
    },
    "path": path_request(limits={"min_anchors": 1}),
    "flight": flight_request(),
    "site-map": {"site_above_ground_m": 30.0, "sites": 3, "min_separation_m": 150.0, "directions": 32},
    "placement": {
        "count": 3,
        "candidates": [{"spacing_m": 150.0, "above_ground_m": [40.0]}],
        "goal": {"objective": "coverage", "min_anchors": 2},
    },
    "repositioning": {
        "anchors": CREW,
        "rover": {"place": at(640.0, 380.0), "heading_deg": 20.0, "ahead_m": 120.0},
        "goal": {"min_anchors": 2},
        "occluded": ["D1"],
        "flight": {"max_flight_m": 900.0},
    },
    "lines-of-sight": {
        "pairs": [
            {"from": {**at(95.0, 305.0), "above_ground_m": 5.0}, "to": {**at(800.0, 305.0), "above_ground_m": 5.0}}
        ]
    },
    "safety-bubbles": {
        "anchors": ANCHORS,
        "points": [{**at(100.0 + 20.0 * n, 300.0), "above_ground_m": 30.0} for n in range(9)],
        "speed_m_per_s": 2.0,
    },
    "protection-levels": {
        "anchors": ANCHORS,
        "height_sigma_m": 1.0,
        "path": [{**at(100.0 + 60.0 * n, 300.0), "above_ground_m": 2.0} for n in range(9)],
    },
    "navigation": drive_request(),
}
