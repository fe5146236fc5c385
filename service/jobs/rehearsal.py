"""One small map from start to end, so that a worker's first real task finds everything loaded."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pyproj

from service.jobs.results import load, save
from service.products.registry import PRODUCTS
from service.products.visibility import VISIBILITY_MAP
from service.products.visibility.calculate import calculate_visibility_map
from service.products.visibility.request import VisibilityMapParameters
from service.settings import Rehearsal
from service.warm_up import warm_up
from terrain import ElevationGrid

__all__ = ["rehearse"]


def rehearse(what: Rehearsal, *, first: bool) -> None:
    """Load kernels, projections and raster drivers by using each once. Raises OSError when nothing can be written.

    first: of all workers; it also compiles what the processes of sampled plans need, for itself and all others.
    """
    warm_up(what, own_processes=first)
    utm = pyproj.CRS.from_epsg(32611)
    grid = ElevationGrid(np.zeros((16, 16), np.float32), 30.0, 30.0, 400_000.0, 3_800_000.0, utm)
    anchor = {"id": "A", "lon_deg": -118.085, "lat_deg": 34.335, "altitude_m": 50.0}
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder:
        finished = calculate_visibility_map(grid, VisibilityMapParameters.model_validate({"anchors": [anchor]}))
        save(VISIBILITY_MAP, finished, Path(folder))
        product, kept = load(PRODUCTS, Path(folder))
        product.layer["visible.tif"].write(kept, Path(folder) / "visible.tif")
