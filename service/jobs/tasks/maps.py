"""Maps of every kind in a worker: check what is asked, calculate it, draw its layers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.errors import NotFoundError
from service.estimates import refuse_map
from service.jobs.folder import digest_of, make_durable
from service.jobs.map_requests import MAP_REQUESTS
from service.jobs.map_store import load, save
from service.products.layers import write_layer
from service.products.placements.calculate import cluster_of
from service.products.placements.request import PlacementParameters
from service.products.registry import PRODUCTS, Product

from .bodies import body_in, read_body
from .context import Task, TaskContext

__all__ = ["check_map", "draw_layer", "map_task"]


def check_map(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """What a body asks for, or the fields by which the service has to find something for it first.

    What cannot be calculated or is beyond the limits is refused before anything is allocated for it.

    Raises NotJsonError, NotValidError, RequestError, LimitError, AnchorError, FrameError, AlmanacError,
    VisibilityInputError, PlacementError.
    """
    product, request = PRODUCTS[arguments["product"]], MAP_REQUESTS[arguments["product"]]
    asked = read_body(request.model, body_in(arguments), context.settings)
    needed = request.needed(asked)
    if needed is not None and "found" not in arguments:
        return {"needed": needed}
    fields = request.parameters(asked, arguments.get("found", {}))
    parameters = product.parameters.model_validate(fields)
    dem_id = asked.dem_id  # type: ignore[attr-defined] # every such body has one
    if isinstance(parameters, PlacementParameters):
        cluster_of(parameters, context.settings.dask_scheduler)
    grid = context.grid(dem_id)
    cells, mode = grid.heights_m.size, parameters.mode
    refuse_map(cells, len(parameters.anchors), mode, context.settings)
    product.refuse(cells, product.check(grid, parameters), mode, context.settings)
    if product.refuse_more is not None:
        product.refuse_more(grid, parameters, context.settings)
    return {"dem_id": dem_id, "parameters": fields}


def map_task(product: Product) -> Task:
    """The task that calculates maps of one kind: it leaves the map in the work folder, and tells digest and summary."""

    def calculate_map(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        parameters = product.parameters.model_validate(arguments["parameters"])
        more: dict[str, Any] = {"stop": context.stop} if product.searches else {}
        if product.spreads:
            more["scheduler"] = context.settings.dask_scheduler
        finished = product.calculate(context.grid(arguments["dem_id"]), parameters, context.progress, **more)
        save(finished, context.work)
        make_durable(context.work)
        return {"digest": digest_of(context.work), "summary": finished.summary()}

    return calculate_map


def draw_layer(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Write one layer of a finished map into the work folder; raises NotFoundError when the map was just deleted."""
    try:
        finished = load(context.folder.result(arguments["digest"]))
    except FileNotFoundError as error:
        raise NotFoundError("result", arguments["digest"]) from error
    context.work.mkdir(parents=True)
    write_layer(finished, arguments["layer"], context.work / arguments["layer"])
    make_durable(context.work)
    return {}
