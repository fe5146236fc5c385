"""Cloud-optimised GeoTIFFs of placements: before and after."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from service.files.cog import BYTES, FLOATS, common_tags, write_cog
from service.products.placements.calculate import FinishedPlacement

__all__ = ["write_count", "write_dop"]

NO_GROUND = 255
BANDS = ["before", "after"]


def write_count(finished: FinishedPlacement, path: Path) -> None:
    """uint8: anchors surely in sight; 255 (nodata) where no ground is known."""
    no_ground = np.isnan(finished.grid.heights_m)
    bands = [np.where(no_ground, np.uint8(NO_GROUND), some) for some in (finished.count_before, finished.count_after)]
    tags = {**common_tags(finished, "sightline placement"), "units": "anchors"}
    write_cog(path, finished.grid, bands, BANDS, NO_GROUND, tags, BYTES)


def write_dop(finished: FinishedPlacement, path: Path) -> None:
    """float32: the dilution; NaN unknown (nodata), +inf no fix."""
    tags = {**common_tags(finished, "sightline placement"), "units": "1", "infinity": "no fix"}
    write_cog(path, finished.grid, [finished.dop_before, finished.dop_after], BANDS, float("nan"), tags, FLOATS)
