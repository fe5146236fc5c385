"""The anchors of a visibility map as GeoJSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyproj

from service.visibility_map import VisibilityMap
from terrain import body_of

__all__ = ["write_anchors"]

EARTH = "EPSG:4326"


def write_anchors(finished: VisibilityMap, path: Path) -> None:
    """A FeatureCollection of points in longitude and latitude; without a CRS in the DEM's local metres, and says so."""
    crs = finished.grid.crs
    to_degrees = None if crs is None else pyproj.Transformer.from_crs(crs, _degrees_of(crs), always_xy=True)
    features: list[dict[str, Any]] = []
    for properties in finished.summary()["anchors"]:
        east_m, north_m = properties["east_m"], properties["north_m"]
        coordinates = (east_m, north_m) if to_degrees is None else to_degrees.transform(east_m, north_m, errcheck=True)
        features.append(
            {
                "type": "Feature",
                "id": properties["id"],
                "geometry": {"type": "Point", "coordinates": list(coordinates)},
                "properties": properties,
            }
        )
    collection: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    if crs is None:
        collection["coordinates_are"] = "metres east and north in the DEM's local frame, which has no CRS"
    path.write_text(json.dumps(collection, allow_nan=False, indent=1), encoding="utf-8")


def _degrees_of(crs: pyproj.CRS) -> Any:
    """WGS 84 on Earth, as GeoJSON wants it; elsewhere the body's own longitude and latitude."""
    return EARTH if body_of(crs).name == "Earth" else crs.geodetic_crs
