"""The layers of a visibility map: name, media type, what it holds, and who writes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from service.replacing import replacing
from service.visibility_map import VisibilityMap

__all__ = ["LAYERS", "Layer", "write_layer"]

Writer = Callable[[VisibilityMap, Path], None]
COG = "image/tiff; application=geotiff; profile=cloud-optimized"


@dataclass(frozen=True, slots=True)
class Layer:
    """One file that a map can be downloaded as; ``name`` is its file name."""

    name: str
    media_type: str
    description: str
    write: Writer


# The writers import what is heavy (GDAL, matplotlib) when they are called: asking for --help must not wait for them.


def _visible(finished: VisibilityMap, path: Path) -> None:
    from .geotiff import write_visible

    write_visible(finished, path)


def _min_visible_altitude(finished: VisibilityMap, path: Path) -> None:
    from .geotiff import write_min_visible_altitude

    write_min_visible_altitude(finished, path)


def _count(finished: VisibilityMap, path: Path) -> None:
    from .geotiff import write_count

    write_count(finished, path)


def _picture(finished: VisibilityMap, path: Path) -> None:
    from service.pictures import write_map_picture

    write_map_picture(finished, path)


def _arrays(finished: VisibilityMap, path: Path) -> None:
    from .arrays import write_arrays

    write_arrays(finished, path)


def _anchors(finished: VisibilityMap, path: Path) -> None:
    from .features import write_anchors

    write_anchors(finished, path)


LAYERS: dict[str, Layer] = {
    layer.name: layer
    for layer in (
        Layer(
            "visible.tif",
            COG,
            "One uint8 band per anchor: 1 visible, 0 hidden, 255 (nodata) unknown, at the receiver height asked for.",
            _visible,
        ),
        Layer(
            "min_visible_altitude.tif",
            COG,
            "One float32 band per anchor: lowest altitude in metres from which it is in sight; NaN (nodata) unknown, "
            "+inf at no altitude.",
            _min_visible_altitude,
        ),
        Layer(
            "count.tif",
            COG,
            "Band 1: how many anchors are surely visible, nodata where the sight of every anchor is unknown. "
            "Band 2: how many are unknown.",
            _count,
        ),
        Layer("map.png", "image/png", "A picture of the count over shaded relief, with anchors and legend.", _picture),
        Layer(
            "arrays.npz",
            "application/x-npz",
            "All arrays for numpy: heights_m, visible, min_visible_altitude_m, count, unknown_count, positions.",
            _arrays,
        ),
        Layer(
            "anchors.geojson",
            "application/geo+json",
            "The anchors as points, with what part of the map sees each.",
            _anchors,
        ),
    )
}


def write_layer(finished: VisibilityMap, name: str, path: Path) -> None:
    """Write one layer so that ``path`` either holds all of it or is left as it was.

    Raises KeyError (no such layer), OSError.
    """
    layer = LAYERS[name]
    with replacing(path) as unfinished:
        layer.write(finished, unfinished)
