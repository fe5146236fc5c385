"""All products of the service, in the order in which the documents list them."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from service.products import Product
from service.products.dop import DOP_MAP
from service.products.flights import FLIGHT
from service.products.lines_of_sight import LINES_OF_SIGHT
from service.products.morphing import MORPHING_MAP
from service.products.navigations import NAVIGATION
from service.products.paths import PATH
from service.products.placements import PLACEMENT
from service.products.protection_levels import PROTECTION_LEVELS
from service.products.repositionings import REPOSITIONING
from service.products.safety_bubbles import SAFETY_BUBBLES
from service.products.sites import SITE_MAP
from service.products.visibility import VISIBILITY_MAP
from service.products.windows import WINDOW_MAP

__all__ = ["PRODUCTS", "all_products"]


def _by_name(products: Iterable[Product]) -> Mapping[str, Product]:
    listed = tuple(products)
    found = {product.name: product for product in listed}
    if len(found) < len(listed) or len({product.path for product in listed}) < len(listed):
        raise ValueError("Two products have one name or one path.")
    return MappingProxyType(found)


PRODUCTS: Mapping[str, Product] = _by_name(
    [
        VISIBILITY_MAP,
        WINDOW_MAP,
        DOP_MAP,
        MORPHING_MAP,
        PATH,
        FLIGHT,
        SITE_MAP,
        PLACEMENT,
        REPOSITIONING,
        LINES_OF_SIGHT,
        SAFETY_BUBBLES,
        PROTECTION_LEVELS,
        NAVIGATION,
    ]
)


@functools.cache
def all_products(places: tuple[str, ...]) -> Mapping[str, Product]:
    """Ours and those of other packages, each named by its place, ``package.module:NAME``.

    Raises ImportError, AttributeError, ValueError.
    """
    more = []
    for place in places:
        module, _, name = place.partition(":")
        more.append(getattr(importlib.import_module(module), name))
    return _by_name([*PRODUCTS.values(), *more])
