"""Cloud-optimised GeoTIFFs of a visibility map."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from service.files.cog import BYTES, FLOATS, common_tags, write_cog
from service.products.visibility.calculate import VisibilityMap
from visibility import UNKNOWN

__all__ = ["write_count", "write_min_visible_altitude", "write_visible"]


def write_visible(finished: VisibilityMap, path: Path) -> None:
    """uint8, a band per anchor: 1 visible, 0 hidden, 255 unknown (nodata)."""
    ids = [anchor.id for anchor in finished.anchors]
    tags = {**_tags(finished), "units": "class: 1 visible, 0 hidden, 255 unknown"}
    write_cog(path, finished.grid, finished.visible, ids, int(UNKNOWN), tags, BYTES)


def write_min_visible_altitude(finished: VisibilityMap, path: Path) -> None:
    """float32 metres, a band per anchor: NaN unknown (nodata), +inf at no altitude."""
    ids = [anchor.id for anchor in finished.anchors]
    tags = {**_tags(finished), "units": "metre", "infinity": "in sight at no altitude"}
    write_cog(path, finished.grid, finished.altitude_m, ids, float("nan"), tags, FLOATS)


def write_count(finished: VisibilityMap, path: Path) -> None:
    """Band 1 anchors surely visible, nodata (largest value) where all are unknown; band 2 anchors unknown."""
    nodata = int(np.iinfo(finished.count.dtype).max)
    nothing_known = finished.unknown_count == len(finished.anchors)
    visible = np.where(nothing_known, finished.count.dtype.type(nodata), finished.count)
    tags = {**_tags(finished), "units": "anchors"}
    bands = (visible, finished.unknown_count)
    write_cog(path, finished.grid, bands, ["visible anchors", "unknown anchors"], nodata, tags, BYTES)


def _tags(finished: VisibilityMap) -> dict[str, str]:
    parameters = finished.parameters
    receiver = (
        f"{parameters.receiver_above_ground_m:g} m above ground"
        if parameters.receiver_above_ground_m is not None
        else f"at altitude {parameters.receiver_altitude_m:g} m"
    )
    return {**common_tags(finished, "sightline visibility map"), "receiver": receiver}
