"""Made-up grounds for stories: big enough to keep a worker busy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.service.running import Server

SIDE, CELL_M = 2000, 10.0


def rough_ground(folder: Path) -> Path:
    """Random heights, no CRS: 2000 x 2000 posts, 10 m apart."""
    path = folder / "rough.npy"
    np.save(path, np.random.default_rng(7).normal(100.0, 20.0, (SIDE, SIDE)).astype(np.float32))
    return path


def upload_rough_ground(server: Server, folder: Path) -> dict[str, Any]:
    return server.upload(rough_ground(folder), cell_m=CELL_M)


def long_job(dem: dict[str, Any], anchors: int = 64) -> dict[str, Any]:
    """Takes half a minute on the one thread that workers have in stories: many anchors, exact."""
    return {"dem_id": dem["id"], "anchors": _anchors(dem, anchors), "mode": "exact"}


def short_job(dem: dict[str, Any], anchors: int = 1) -> dict[str, Any]:
    return {"dem_id": dem["id"], "anchors": _anchors(dem, anchors)}


def _anchors(dem: dict[str, Any], number: int) -> list[dict[str, Any]]:
    bounds = dem["bounds_of_posts_m"]
    width_m, height_m = bounds["east"] - bounds["west"], bounds["north"] - bounds["south"]
    return [
        {
            "id": f"A{i}",
            "east_m": bounds["west"] + width_m * (i + 1) / (number + 1),
            "north_m": bounds["south"] + height_m * (i + 1) / (number + 1),
            "altitude_m": dem["highest_m"] + 30.0,
        }
        for i in range(number)
    ]
