"""The files of finished safety bubbles: JSON, CSV, GeoJSON, arrays and pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from service.files.csv_table import TableWriter
from service.files.geojson import coordinates_of, feature, write_collection
from service.files.layer import GEOJSON, JSON, PNG, Layer
from service.parts.map_facts import altitude_datum_of
from service.products.in_common import Drawn
from service.products.safety_bubbles.calculate import FinishedBubbles

__all__ = ["LAYERS"]


def _write_json(finished: FinishedBubbles, path: Path) -> None:
    path.write_text(json.dumps(finished.points, allow_nan=False), encoding="utf-8")


def _write_csv(finished: FinishedBubbles, path: Path) -> None:
    names = list(finished.numbers())
    with path.open("w", newline="", encoding="utf-8") as file:
        table, datum = TableWriter(file, end="\r\n"), altitude_datum_of(finished.grid)
        table.row([*names, "nearest", "verdict", "push_east", "push_north", "push_up", "push_m", "in_sight", *datum])
        columns = finished.columns
        told = (columns[name] for name in (*names, "nearest", "verdict"))
        for *cells, push, push_m, ids in zip(*told, *(columns[n] for n in ("push", "push_m", "in_sight")), strict=True):
            table.row([*cells, *push, push_m, " ".join(ids or ()), *datum.values()])


def _write_geojson(finished: FinishedBubbles, path: Path) -> None:
    """One point each, in longitude, latitude and altitude; without a CRS in the DEM's local metres, and says so."""
    grid = finished.grid
    features = [
        feature(
            "Point",
            [*place, point["altitude_m"]],
            {name: value for name, value in point.items() if name not in ("east_m", "north_m")},
        )
        for place, point in zip(coordinates_of(grid, finished.points_m[:, :2]), finished.points, strict=True)
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


LAYERS = (
    Layer("points.json", JSON, "Every point, in the order of the path.", _write_json),
    Layer("points.csv", "text/csv; charset=utf-8", "The same as a table.", _write_csv),
    Layer("points.geojson", GEOJSON, "The same as points in longitude, latitude and altitude.", _write_geojson),
    Layer("points.npz", "application/x-npz", "The same as arrays for numpy, with covariances.", _write_npz),
    Layer(
        "profile.png",
        PNG,
        "Radius and clearance along the way, and the bubble over ground, roofs and trees.",
        Drawn("service.products.safety_bubbles.picture:draw_bubble_profile"),
    ),
    Layer(
        "map.png",
        PNG,
        "The way on the map, with its bubbles.",
        Drawn("service.products.safety_bubbles.picture:draw_bubble_map"),
    ),
)
