"""Products in a worker: read and check what is asked, calculate it, draw its layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from pydantic import ValidationError

from service.errors import NotFoundError, NotReadyError, NotValidError
from service.jobs.folder import digest_of, make_durable
from service.jobs.results import load, save
from service.parts.altitude_datums import in_dem_datum
from service.parts.older_names import notes_on_older_names
from service.parts.sentences import fields_of, sentence_of
from service.products.product import Given, Product, Work

from .bodies import body_in, read_body
from .context import Task, TaskContext

__all__ = ["calculation_of", "check_request", "draw_layer"]


def check_request(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Read a body and refuse what cannot be calculated or is beyond the limits, before a job exists.

    given: what the request refers to; without it ``needs`` comes back where there is something to find first. What is
    long of the parameters goes into the work folder. Raises NotJsonError, NotValidError, NotFoundError, LimitError, and
    what the product's check raises.
    """
    product = context.products[arguments["product"]]
    asked: Any = read_body(product.asked, body_in(arguments), context.settings)
    needs = product.needs(asked)
    if needs is not None and "given" not in arguments:
        return {"dem_id": asked.dem_id, "needs": asdict(needs)}
    try:
        parameters = product.completed(asked, Given(**arguments.get("given", {})))
    except ValidationError as error:
        raise NotValidError(sentence_of(error), fields_of(error)) from error
    grid = context.grid(asked.dem_id)
    parameters, told = in_dem_datum(grid, parameters)
    product.check(grid, parameters, context.settings)
    packed = product.pack(grid, parameters, context.work)
    if context.work.exists():
        make_durable(context.work)
    notes = [*notes_on_older_names(asked), *told]
    return {"dem_id": asked.dem_id, "parameters": packed, "has_inputs": context.work.exists(), "notes": notes}


def calculation_of(product: Product) -> Task:
    """The task that calculates one product: files into the work folder; their digest and the answer come back."""

    def calculate(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        parameters = product.unpacked(arguments["parameters"], context.folder.inputs(arguments["job_id"]))
        work = Work(context.progress, context.stop, context.settings.dask_scheduler)
        finished = product.calculate(context.grid(arguments["dem_id"]), parameters, work)
        if product.finished is None:
            context.work.mkdir(parents=True)
            for layer in product.layers:
                layer.write(finished, context.work / layer.name)
        else:
            save(product, finished, context.work)
        make_durable(context.work)
        return {"digest": digest_of(context.work), "summary": finished.answer.model_dump(mode="json")}

    return calculate


def draw_layer(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Write one layer of a finished result into the work folder; raises NotFoundError when it was just deleted."""
    try:
        product, finished = load(context.products, context.folder.result(arguments["digest"]), arguments["summary"])
    except FileNotFoundError as error:
        raise NotFoundError("result", arguments["digest"]) from error
    context.work.mkdir(parents=True)
    try:
        product.layer[arguments["layer"]].save(finished, context.work / arguments["layer"])
    except AttributeError as error:
        if error.obj is not finished.answer:
            raise
        raise NotReadyError(
            f"The result was stored by an older Sightline and lacks {error.name}, which this layer tells; ask again."
        ) from error
    make_durable(context.work)
    return {}
