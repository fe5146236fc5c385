"""The models that OpenAPI shows of a product's answers, made from the product."""

from __future__ import annotations

from functools import cache
from types import GenericAlias
from typing import Any

from pydantic import Field, create_model

from service.parts.map_answers import MapOut, running_example
from service.parts.older_results import or_older
from service.parts.pages import Page
from service.products import Product

__all__ = ["list_model", "out_model", "state_model"]


@cache
def state_model(product: Product) -> type[MapOut]:
    """How a calculation stands, and its result; what is long is left out."""
    result = or_older(product.answer)
    fields: dict[str, Any] = {"result": (result, Field(description="What came out; null until it succeeded."))}
    if product.inline is not None:
        fields["files"] = (list[str], Field(description="The same as layers, under their older paths."))
    model = create_model(
        f"{product.model}{'Out' if product.inline is None else 'State'}",
        __doc__=f"How the calculation of {product.title} stands, and its result when there is one.",
        __base__=MapOut,
        **fields,
    )
    if product.example:
        example = running_example(product.path, dict(product.example))
        model.model_config["json_schema_extra"] = {
            "examples": [{**example, "files": []} if product.inline else example]
        }
    return model


@cache
def out_model(product: Product) -> type[MapOut]:
    """The same with what is long."""
    if product.inline is None:
        return state_model(product)
    inline = product.inline
    fields: dict[str, Any] = {inline.name: (_list_of(inline.model) | None, Field(description=inline.description))}
    return create_model(
        f"{product.model}Out",
        __doc__=f"How {product.title} stand, with every one of the {inline.name}.",
        __base__=state_model(product),
        **fields,
    )


@cache
def list_model(product: Product) -> type[Page]:
    """One page of them, newest first."""
    fields: dict[str, Any] = {product.plural: (_list_of(state_model(product)), ...)}
    return create_model(
        f"{product.model}List",
        __doc__=f"One page of {product.plural.replace('_', ' ')}, newest first.",
        __base__=Page,
        **fields,
    )


def _list_of(model: Any) -> Any:
    """The type of lists of a model that is made at run time."""
    return GenericAlias(list, (model,))
