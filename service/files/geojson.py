"""FeatureCollections as files: cut at 180°, and saying what their numbers mean where the standard does not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from service.files.geojson import cut
from service.parts.map_facts import body_name, crs_label, grid_north_deg
from terrain import ElevationGrid

__all__ = ["write_collection"]

LOCAL_METRES = "metres east and north in the DEM's local frame, which has no CRS"


def write_collection(
    grid: ElevationGrid, features: list[dict[str, Any]], path: Path, indent: int | None = None
) -> None:
    """Features of a grid: in longitude and latitude, without a CRS in the grid's metres.

    Beside the features stand the body where it is not the Earth, what altitudes count from, and where the grid's north
    lies, from which azimuths and headings in properties count.
    """
    if grid.crs is not None:
        features = [{**feature, "geometry": cut(feature["geometry"])} for feature in features]
    collection = {"type": "FeatureCollection", **_meaning(grid), "features": features}
    path.write_text(json.dumps(collection, allow_nan=False, indent=indent), encoding="utf-8")


def _meaning(grid: ElevationGrid) -> dict[str, str]:
    if grid.crs is None:
        return {"coordinates_are": LOCAL_METRES}
    body, north_deg = body_name(grid), grid_north_deg(grid)
    told = {}
    if body != "Earth":
        assert grid.crs.geodetic_crs is not None, "places have been turned into degrees"
        told = {"body": str(body), "coordinates_are": f"longitude and latitude on {body}: {grid.crs.geodetic_crs.name}"}
    told["altitudes_are"] = f"metres above {_datum(grid)}"
    if north_deg is not None:
        told["azimuths_are"] = (
            f"clockwise from the grid's north ({crs_label(grid)}), which lies {north_deg:.2f}° clockwise of true north"
        )
    return told


def _datum(grid: ElevationGrid) -> str:
    if grid.vertical_datum is None:
        return "what the DEM's heights count from, which it does not say"
    return f"the DEM's vertical datum: {grid.vertical_datum}"
