"""The files of protection levels: a raster, the table and GeoJSON of a path, pictures; their list."""

from __future__ import annotations

import math
from pathlib import Path

from service.files.csv_table import TableWriter
from service.files.geojson import coordinates_of, feature, write_collection
from service.files.layer import COG, GEOJSON, JSON, PNG, Layer
from service.parts.map_facts import altitude_datum_of
from service.products.in_common import Drawn, Later, Raster, common_tags

from .calculate import PATH_COLUMNS, FinishedProtection

__all__ = ["LAYERS"]

PICTURE = "service.products.protection_levels.picture"
BANDS = ["horizontal protection level", "vertical protection level"]


def _tags(finished: FinishedProtection) -> dict[str, str]:
    parameters = finished.parameters
    return {
        **common_tags(finished.grid, finished.answer, "sightline protection levels"),
        "receiver": f"{parameters.receiver_above_ground_m:g} m above ground",
        "kind": parameters.kind,
        "missed": f"{parameters.missed:g}",
        "one sigma of a range": finished.answer.sigmas,
    }


def _write_csv(finished: FinishedProtection, path: Path) -> None:
    """One line per point: PATH_COLUMNS; inf where nothing is promised."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table, datum = TableWriter(file, end="\r\n"), altitude_datum_of(finished.grid)
        table.row([*PATH_COLUMNS, *datum])
        for numbers in finished.path_numbers.tolist():
            table.row([*(f"{number:.10g}" for number in numbers), *datum.values()])


def _write_geojson(finished: FinishedProtection, path: Path) -> None:
    """One point each, in longitude, latitude and altitude; null where nothing is promised."""
    grid, numbers = finished.grid, finished.path_numbers
    features = []
    for place, row in zip(coordinates_of(grid, numbers[:, 1:4]), numbers.tolist(), strict=True):
        told = dict(zip(PATH_COLUMNS, row, strict=True))
        finite = {name: value if math.isfinite(value) else None for name, value in told.items()}
        features.append(feature("Point", place, {k: v for k, v in finite.items() if k not in PATH_COLUMNS[1:4]}))
    write_collection(grid, features, path)


LAYERS = (
    Layer(
        "protection.tif",
        COG,
        "float32 metres: the horizontal and the vertical protection level over each post; +inf where nothing can be "
        "promised, NaN (nodata) where no ground is known.",
        Raster(_tags, lambda one: [one.horizontal, one.vertical], lambda _: BANDS, "metre", infinity="no promise"),
    ),
    Layer(
        "unwatched.tif",
        COG,
        "float32: probability of wrong ranges that no hypothesis covers; where it exceeds what may be missed nothing "
        "is promised.",
        Raster(_tags, lambda one: [one.unwatched], lambda _: ["unwatched probability"], "1"),
    ),
    Layer(
        "path.csv",
        "text/csv; charset=utf-8",
        "Levels along the path, and how many anchors are expected in sight.",
        _write_csv,
        needs="path",
    ),
    Layer("path.geojson", GEOJSON, "The same as points.", _write_geojson, needs="path"),
    Layer("map.png", PNG, "Picture: the horizontal protection level.", Drawn(f"{PICTURE}:draw_levels")),
    Layer(
        "vertical.png",
        PNG,
        "Picture: the vertical protection level.",
        Drawn(f"{PICTURE}:draw_levels", {"vertical": True}),
    ),
    Layer("profile.png", PNG, "Levels along the path.", Drawn(f"{PICTURE}:draw_profile"), needs="path"),
    Layer(
        "overlay.png",
        PNG,
        "The horizontal level as pixels to lay over a map, clear where no ground is known.",
        Later(f"{PICTURE}:write_overlay"),
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "Classes of the horizontal level with colour and posts.",
        Later(f"{PICTURE}:write_legend"),
        for_screens=True,
    ),
)
