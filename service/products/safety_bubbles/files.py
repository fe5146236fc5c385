"""The files of finished safety bubbles: JSON, CSV, GeoJSON, arrays and pictures."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from service.files.geojson import write_collection
from service.files.layer import later
from service.files.replacing import replacing
from service.files.tables import TableWriter
from service.products.safety_bubbles.calculate import FinishedBubbles
from terrain import to_lon_lat

__all__ = ["BUBBLE_FILES", "MEDIA_TYPES", "write_bubble_file"]


def write_bubble_file(finished: FinishedBubbles, name: str, path: Path) -> None:
    """Write the file of that name to a path, whole or not at all."""
    with replacing(path) as unfinished:
        BUBBLE_FILES[name](finished, unfinished)


def _write_json(finished: FinishedBubbles, path: Path) -> None:
    path.write_text(json.dumps(finished.points, allow_nan=False), encoding="utf-8")


def _write_csv(finished: FinishedBubbles, path: Path) -> None:
    names = list(finished.numbers())
    with path.open("w", newline="", encoding="utf-8") as file:
        table = TableWriter(file, end="\r\n")
        table.row([*names, "nearest", "verdict", "push_east", "push_north", "push_up", "push_m", "in_sight"])
        for point in finished.points:
            numbers = [point[name] for name in names]
            sight = "" if point["in_sight"] is None else " ".join(point["in_sight"])
            table.row([*numbers, point["nearest"], point["verdict"], *point["push"], point["push_m"], sight])


def _write_geojson(finished: FinishedBubbles, path: Path) -> None:
    """One point each, in longitude, latitude and altitude; without a CRS in the DEM's local metres, and says so."""
    grid = finished.grid
    across = finished.points_m[:, :2].tolist()
    if grid.crs is not None:
        across = np.round(np.column_stack(to_lon_lat(grid, *finished.points_m[:, :2].T)), 8).tolist()
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [*place, point["altitude_m"]]},
            "properties": {name: value for name, value in point.items() if name not in ("east_m", "north_m")},
        }
        for place, point in zip(across, finished.points, strict=True)
    ]
    write_collection(grid, features, path)


def _write_npz(finished: FinishedBubbles, path: Path) -> None:
    more = {} if finished.bubbles.visible is None else {"visible": finished.bubbles.visible}
    with path.open("wb") as file:
        np.savez(
            file,
            allow_pickle=False,
            **finished.numbers(),
            covariance_m2=finished.bubbles.covariance_m2,
            at_building=finished.bubbles.around.at_building,
            verdict=finished.bubbles.check.verdict,
            push=finished.bubbles.check.push,
            push_m=finished.bubbles.check.push_m,
            nearest_m=finished.bubbles.around.nearest_m,
            unknown_m=finished.bubbles.around.unknown_m,
            **more,
        )


BUBBLE_FILES: Mapping[str, Callable[[FinishedBubbles, Path], None]] = MappingProxyType(
    {
        "points.json": _write_json,
        "points.csv": _write_csv,
        "points.geojson": _write_geojson,
        "points.npz": _write_npz,
        "profile.png": later("service.products.safety_bubbles.picture", "write_bubble_profile"),
        "map.png": later("service.products.safety_bubbles.picture", "write_bubble_map"),
    }
)
MEDIA_TYPES = {
    ".json": "application/json",
    ".csv": "text/csv",
    ".geojson": "application/geo+json",
    ".npz": "application/x-npz",
    ".png": "image/png",
}
