"""Maps to lay over a hillshade: pixels alone, one corner of the DEM to the other, and their legend as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from service.drawing.class_map import ClassShare
from service.drawing.relief import Sampling
from service.drawing.sheet import lit_ground
from terrain import ElevationGrid

__all__ = ["write_hillshade", "write_legend", "write_pixels"]


def write_hillshade(grid: ElevationGrid, path: Path) -> None:
    """The ground lit from the north-west, grey; clear where no ground is known."""
    light, _ = lit_ground(grid, Sampling.of(grid.shape))
    grey = np.asarray(np.rint(light * 255.0), np.uint8)
    write_pixels(grid, np.stack((grey, grey, grey), axis=-1), path)


def write_pixels(grid: ElevationGrid, pixels: npt.NDArray[np.uint8], path: Path) -> None:
    """(rows, cols, 3) pixels as a PNG that is clear where no ground is known."""
    _, no_ground = lit_ground(grid, Sampling.of(grid.shape))
    alpha = np.where(no_ground, 0, 255).astype(np.uint8)
    Image.fromarray(np.dstack((pixels, alpha))).save(path, format="PNG")


def write_legend(title: str, shares: Sequence[ClassShare], path: Path) -> None:
    """The classes of a map as JSON; share: of the known posts, 0..1; null where it is no part of them."""
    known_posts = sum(share.posts or 0 for share in shares)
    classes = [
        {
            "label": share.label,
            "colour": share.colour,
            "posts": share.posts,
            "share": None if share.posts is None or not known_posts else share.posts / known_posts,
        }
        for share in shares
    ]
    legend = {"title": title, "known_posts": known_posts, "classes": classes}
    path.write_text(json.dumps(legend, allow_nan=False), encoding="utf-8")
