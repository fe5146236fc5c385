"""Planned paths as files: GeoJSON with what holds at each vertex, and a table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from service.files.geojson import write_collection
from service.files.tables import TableWriter
from service.products.paths.answers import VERTEX_COLUMNS
from service.products.paths.calculate import FinishedPath
from terrain import ElevationGrid, to_lon_lat

__all__ = ["vertex_properties", "write_csv", "write_geojson"]

DECIMALS_DEG, DECIMALS_M, DECIMALS = 8, 3, 4
# told by the geometry
PLACE = ("east_m", "north_m")


def write_geojson(finished: FinishedPath, path: Path) -> None:
    """A FeatureCollection in longitude, latitude and altitude; without a CRS in the DEM's local metres, and says so.

    A found path is one LineString, whose properties ``vertices`` hold what the points hold one by one.
    """
    features = [_line(finished), *_points(finished)] if finished.found else _blocked(finished)
    write_collection(finished.grid, features, path)


def write_csv(finished: FinishedPath, path: Path) -> None:
    """A row per vertex; an empty cell is no number: no anchors, no fix, no bubble asked for."""
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = [
            {"east_m": round(east_m, DECIMALS_M), "north_m": round(north_m, DECIMALS_M), **row}
            for east_m, north_m, row in zip(
                finished.column("east_m").tolist(),
                finished.column("north_m").tolist(),
                vertex_properties(finished),
                strict=True,
            )
        ]
        for row in rows:
            row["visible_anchors"] = " ".join(row["visible_anchors"])
        TableWriter(file).rows(list(rows[0]), rows)


def vertex_properties(finished: FinishedPath) -> list[dict[str, Any]]:
    """What holds at each vertex, ready for JSON: angles in degrees, None where there is no number."""
    ids = np.array(finished.answer["ranged_to"])
    columns: dict[str, list[Any]] = {}
    for name in VERTEX_COLUMNS:
        if name in PLACE:
            continue
        values = finished.column(name)
        if name.endswith("_rad"):
            name, values = f"{name.removesuffix('_rad')}_deg", np.degrees(values)
        columns[name] = [round(value, DECIMALS) if math.isfinite(value) else None for value in values.tolist()]
    columns["anchor_count"] = finished.column("anchor_count").astype(int).tolist()
    columns["visible_anchors"] = [ids[row == 1].tolist() if len(ids) else [] for row in finished.visible]
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _line(finished: FinishedPath) -> dict[str, Any]:
    answer = finished.answer
    properties = {
        "what": "path",
        **{key: answer[key] for key in ("status", "sentence", "cost", "cost_split", "reference_cost", "ratio")},
        **answer["totals"],
        "corners": finished.corners.tolist(),
        "vertices": vertex_properties(finished),
    }
    return _feature("LineString", _coordinates(finished), properties)


def _points(finished: FinishedPath) -> list[dict[str, Any]]:
    places = _coordinates(finished)
    return [
        _feature("Point", place, {"what": "vertex", "number": number, **properties})
        for number, (place, properties) in enumerate(zip(places, vertex_properties(finished), strict=True))
    ]


def _blocked(finished: FinishedPath) -> list[dict[str, Any]]:
    """Start and goals, and where the way is cut and by what."""
    grid, answer = finished.grid, finished.answer
    named: list[tuple[str, Any, dict[str, Any]]] = [
        ("start", answer["start"], {}),
        *(("goal", goal, {}) for goal in answer["goals"]),
    ]
    if answer["unreachable"] is not None:
        cut = answer["unreachable"]
        named.append(
            ("blocked", cut["where"], {name: cut[name] for name in ("reason", "relaxations", "grain") if name in cut})
        )
    return [
        _feature("Point", _place(grid, at["east_m"], at["north_m"]), {"what": what, "status": answer["status"], **more})
        for what, at, more in named
    ]


def _coordinates(finished: FinishedPath) -> list[list[float]]:
    east_m, north_m, up_m = (finished.column(name) for name in ("east_m", "north_m", "altitude_m"))
    if finished.grid.crs is None:
        metres: list[list[float]] = np.round(np.column_stack([east_m, north_m, up_m]), DECIMALS_M).tolist()
        return metres
    lon_deg, lat_deg = to_lon_lat(finished.grid, east_m, north_m)
    places = np.column_stack([np.round(lon_deg, DECIMALS_DEG), np.round(lat_deg, DECIMALS_DEG), np.round(up_m, 2)])
    degrees: list[list[float]] = places.tolist()
    return degrees


def _place(grid: ElevationGrid, east_m: float, north_m: float) -> list[float]:
    if grid.crs is None:
        return [round(east_m, DECIMALS_M), round(north_m, DECIMALS_M)]
    lon_deg, lat_deg = to_lon_lat(grid, east_m, north_m)
    return [round(float(lon_deg), DECIMALS_DEG), round(float(lat_deg), DECIMALS_DEG)]


def _feature(kind: str, coordinates: Any, properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties}
