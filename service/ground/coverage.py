"""What the ground library covers: as GeoJSON, and which of it an area takes."""

from __future__ import annotations

import hashlib
from typing import Any

from service.files.antimeridian import cut
from terrain import GroundLibrary, MosaicPlan, Tile

__all__ = ["coverage_of", "fingerprint", "plan_told"]

DECIMALS = 7


def coverage_of(library: GroundLibrary) -> dict[str, Any]:
    """A FeatureCollection with the outline of every tile; of files only their names, not where they lie."""
    return {"type": "FeatureCollection", "features": [_feature(tile) for tile in library.tiles]}


def fingerprint(plan: MosaicPlan) -> str:
    """SHA-256 of which tiles a plan takes, and of the state of their files."""
    sha = hashlib.sha256()
    for tile in plan.tiles:
        sha.update(f"{tile.path}\0{tile.size_bytes}\0{tile.modified_ns}\0".encode("utf-8", "surrogateescape"))
    return sha.hexdigest()


def plan_told(plan: MosaicPlan) -> dict[str, Any]:
    """Which tiles, in which order and why, ready for JSON."""
    return {
        "uncovered_share": plan.uncovered,
        "layers": [
            {
                "tiles": [tile.name for tile in planned.layer.tiles],
                "crs": _crs_name(planned.layer.tiles[0]),
                "cell_m": planned.layer.cell_m,
                "covers_share": planned.covers,
                "gives_share": planned.adds,
                "reason": planned.reason(),
            }
            for planned in plan.layers
        ],
    }


def _feature(tile: Tile) -> dict[str, Any]:
    ring = [[round(lon, DECIMALS), round(lat, DECIMALS)] for lon, lat in (*tile.outline_deg, tile.outline_deg[0])]
    return {
        "type": "Feature",
        "geometry": cut({"type": "Polygon", "coordinates": [ring[::-1]]}),  # GeoJSON turns anticlockwise
        "properties": {
            "name": tile.name.encode("utf-8", "replace").decode(),
            "driver": tile.driver,
            "crs": _crs_name(tile),
            "body": tile.body,
            "rows": tile.rows,
            "cols": tile.cols,
            "cell_m": round(tile.cell_m, 4),
            "vertical_datum": tile.vertical_datum,
            "file_bytes": tile.size_bytes,
        },
    }


def _crs_name(tile: Tile) -> str:
    return tile.crs_text if ":" in tile.crs_text[:8] else str(tile.crs.name)
