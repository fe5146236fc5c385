"""The anchors of a visibility map as GeoJSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from service.files.geojson import write_collection
from service.products.visibility.calculate import VisibilityMap
from terrain import to_lon_lat

__all__ = ["write_anchors"]

# Told by the geometry and by the altitude that came of it.
POSITION = {"east_m", "north_m", "lon_deg", "lat_deg", "body", "above_ground_m", "altitude_m"}


def write_anchors(finished: VisibilityMap, path: Path) -> None:
    """A FeatureCollection of points in longitude and latitude; without a CRS in the DEM's local metres, and says so.

    Its properties are those that ``--anchors`` reads, so the file can be the next request's input.
    """
    grid = finished.grid
    features: list[dict[str, Any]] = []
    for anchor, asked, found in zip(
        finished.anchors, finished.parameters.anchors, finished.summary()["anchors"], strict=True
    ):
        position = (anchor.east_m, anchor.north_m)
        limits = asked.model_dump(exclude_none=True, exclude=POSITION)
        features.append(
            {
                "type": "Feature",
                "id": anchor.id,
                "geometry": {
                    "type": "Point",
                    "coordinates": position if grid.crs is None else to_lon_lat(grid, *position),
                },
                "properties": {**_without(found, "above_ground_m"), **limits, "altitude_m": anchor.altitude_m},
            }
        )
    write_collection(grid, features, path, indent=1)


def _without(properties: dict[str, Any], name: str) -> dict[str, Any]:
    """An anchor has one height; two in a file would be refused when it is read."""
    return {key: value for key, value in properties.items() if key != name}
