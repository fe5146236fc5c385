"""What finished maps can be downloaded as, by kind of map and file name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from service.files.layer import Layer
from service.files.replacing import replacing
from service.products.dop.files import DOP_LAYERS, MORPHING_LAYERS
from service.products.flights.layers import FLIGHT_LAYERS
from service.products.paths.layers import PATH_LAYERS
from service.products.placements.layers import PLACEMENT_LAYERS
from service.products.registry import (
    DOP_MAP,
    FLIGHT,
    MORPHING_MAP,
    PATH,
    PLACEMENT,
    REPOSITIONING,
    VISIBILITY_MAP,
    FinishedMap,
    product_of,
)
from service.products.repositionings.layers import REPOSITIONING_LAYERS
from service.products.visibility.files import VISIBILITY_LAYERS

__all__ = ["LAYERS", "write_layer"]

LAYERS: Mapping[str, Mapping[str, Layer]] = MappingProxyType(
    {
        product.name: MappingProxyType({layer.name: layer for layer in layers})
        for product, layers in (
            (VISIBILITY_MAP, VISIBILITY_LAYERS),
            (DOP_MAP, DOP_LAYERS),
            (MORPHING_MAP, MORPHING_LAYERS),
            (PLACEMENT, PLACEMENT_LAYERS),
            (PATH, PATH_LAYERS),
            (FLIGHT, FLIGHT_LAYERS),
            (REPOSITIONING, REPOSITIONING_LAYERS),
        )
    }
)


def write_layer(finished: FinishedMap, name: str, path: Path) -> None:
    """Write one layer so that ``path`` either holds all of it or is left as it was.

    Raises KeyError (no such layer), OSError.
    """
    layer = LAYERS[product_of(finished).name][name]
    with replacing(path) as unfinished:
        layer.write(finished, unfinished)
