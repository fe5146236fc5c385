"""Maps to lay over a hillshade: pixels alone, one corner of the DEM to the other, and their legend as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from service.drawing.class_map import ClassShare, class_pixels, class_shares
from service.drawing.classes import count_classes
from service.drawing.relief import Sampling
from service.drawing.sheet import lit_ground
from service.products.dop.calculate import FinishedDopMap
from service.products.dop.picture import dop_classes
from service.products.visibility.calculate import VisibilityMap
from service.products.visibility.picture import count_pixels, count_shares
from terrain import ElevationGrid

__all__ = ["write_count_legend", "write_count_overlay", "write_dop_legend", "write_dop_overlay", "write_hillshade"]


def write_hillshade(grid: ElevationGrid, path: Path) -> None:
    """The ground lit from the north-west, grey; clear where no ground is known."""
    light, _ = lit_ground(grid, Sampling.of(grid.shape))
    grey = np.asarray(np.rint(light * 255.0), np.uint8)
    _write_pixels(grid, np.stack((grey, grey, grey), axis=-1), path)


def write_count_overlay(finished: VisibilityMap, path: Path) -> None:
    """The count of anchors in sight in the colours of its classes, darkened by relief."""
    _write_pixels(finished.grid, count_pixels(finished, count_classes(len(finished.anchors))), path)


def write_count_legend(finished: VisibilityMap, path: Path) -> None:
    """Its classes, most anchors first."""
    _write_legend("Anchors in sight", count_shares(finished, count_classes(len(finished.anchors))), path)


def write_dop_overlay(finished: FinishedDopMap, path: Path) -> None:
    """The dilution in the colours of its classes, darkened by relief."""
    classes, numbers = dop_classes(finished.dop, finished.count, finished.parameters)
    _write_pixels(finished.grid, class_pixels(finished.grid, numbers, classes), path)


def write_dop_legend(finished: FinishedDopMap, path: Path) -> None:
    """Its classes, best first."""
    classes, numbers = dop_classes(finished.dop, finished.count, finished.parameters)
    _write_legend(finished.parameters.measure.upper(), class_shares(finished.grid, numbers, classes), path)


def _write_pixels(grid: ElevationGrid, pixels: npt.NDArray[np.uint8], path: Path) -> None:
    """(rows, cols, 3) pixels as a PNG that is clear where no ground is known."""
    _, no_ground = lit_ground(grid, Sampling.of(grid.shape))
    alpha = np.where(no_ground, 0, 255).astype(np.uint8)
    Image.fromarray(np.dstack((pixels, alpha))).save(path, format="PNG")


def _write_legend(title: str, shares: Sequence[ClassShare], path: Path) -> None:
    """share: of the known posts, 0..1; null where it is no part of them."""
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
