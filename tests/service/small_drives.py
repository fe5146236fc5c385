"""Drives over the small ground, as requests: straight and level readings, ranges to anchors, fixes at the beginning."""

from __future__ import annotations

from typing import Any

import numpy as np

from terrain import height_at
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from tests.service.small_paths import ANCHORS
from visibility.sight import anchor_above_ground

__all__ = ["ANTENNA_M", "SPEED_M_PER_S", "drive_request", "true_places_m"]

ANTENNA_M, SPEED_M_PER_S, DURATION_S, STEP_S = 1.5, 4.0, 20.0, 0.05
GRAVITY_M_PER_S2 = 9.7964  # of WGS 84 at 34.3° north


def true_places_m(times_s: np.ndarray, from_east_m: float = 600.0, south_m: float = 300.0) -> np.ndarray:
    """(n, 3) east, north, altitude of an antenna that is driven east over the small ground."""
    east_m = WEST_M + from_east_m + SPEED_M_PER_S * times_s
    north_m = np.full_like(east_m, NORTH_M - south_m)
    return np.column_stack([east_m, north_m, height_at(small_grid(), east_m, north_m) + ANTENNA_M])


def drive_request(anchors: list[dict[str, Any]] | None = None, **changes: Any) -> dict[str, Any]:
    """Twenty seconds; ranges four times a second to each of the anchors, right to the centimetre."""
    grid = small_grid()
    stood = [
        anchor_above_ground(grid, one["id"], one["east_m"], one["north_m"], one["above_ground_m"])
        for one in (ANCHORS if anchors is None else anchors)
    ]
    times_s = np.arange(0.0, DURATION_S + STEP_S / 2.0, STEP_S)
    at_s = np.arange(0.5, DURATION_S, 0.25)
    fixes_s = np.arange(0.0, 4.0, 1.0)
    places_m = true_places_m(at_s)
    ranges = []
    for anchor in stood:
        away_m = np.linalg.norm(places_m - (anchor.east_m, anchor.north_m, anchor.altitude_m), axis=1)
        for time_s, range_m in zip(at_s.tolist(), np.round(away_m, 2).tolist(), strict=True):
            ranges.append({"time_s": time_s, "anchor_id": anchor.id, "range_m": range_m, "sigma_m": 0.3})
    return {
        "readings": {
            "times_s": np.round(times_s, 3).tolist(),
            "forces": [[0.0, 0.0, GRAVITY_M_PER_S2]] * len(times_s),
            "rates": [[0.0, 0.0, 0.0]] * len(times_s),
        },
        "fixes": [
            {
                "time_s": time_s,
                **dict(zip(("east_m", "north_m", "altitude_m"), np.round(place_m, 2).tolist(), strict=True)),
                "horizontal_sigma_m": 0.5,
                "vertical_sigma_m": 0.5,
                "velocity_m_per_s": [SPEED_M_PER_S, 0.0, 0.0],
            }
            for time_s, place_m in zip(fixes_s.tolist(), true_places_m(fixes_s), strict=True)
        ],
        "ranges": ranges,
        "anchors": [
            {"id": one.id, "east_m": one.east_m, "north_m": one.north_m, "altitude_m": one.altitude_m} for one in stood
        ],
        "settings": {"imu": "tactical", "antenna_above_ground_m": ANTENNA_M, "heading_deg": 90.0},
        **changes,
    }
