"""What worker processes can be asked to do, by name: DEMs read and drawn, requests checked, products calculated."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import JsonValue, ValidationError

from dem_samples import sample_path
from service.errors import NotFoundError, NotReadyError, NotValidError
from service.jobs.channel import model_of
from service.jobs.folder import DataFolder, digest_of, make_durable
from service.jobs.kept_files import load, load_grid, save, save_grid
from service.jobs.records import JobRequest
from service.live.request import DetectorLimits, EpochsIn
from service.parts.altitude_datums import in_dem_datum
from service.parts.map_facts import ground_of
from service.parts.sentences import fields_of, notes_on_older_names, sentence_of
from service.products import Given, Needs, Product, Work
from service.settings import Settings
from terrain import ElevationGrid, read_dem

from .channel import (
    BodyArguments,
    CalculateArguments,
    Calculated,
    CheckArguments,
    Checked,
    DemArguments,
    LayerArguments,
    NeedsFields,
    ReadDemArguments,
    body_in,
    read_body,
)

__all__ = [
    "Task",
    "TaskContext",
    "calculation_of",
    "check_epochs",
    "check_request",
    "draw_hillshade",
    "draw_layer",
    "read_uploaded_dem",
    "tasks_for",
]

DEM_ID = re.compile(r"[0-9a-f]{32}")


@dataclass(frozen=True, slots=True)
class TaskContext:
    """Limits, where things lie, the task's own work folder (not made yet), and whom to tell the finished share.

    stop: whether somebody wants the best so far instead of all; a task that knows no such thing does not ask.
    """

    settings: Settings
    products: Mapping[str, Product]
    folder: DataFolder
    work: Path
    progress: Callable[[float], None]
    stop: Callable[[], bool]

    def grid(self, dem_id: str) -> ElevationGrid:
        """The DEM of that id; raises NotFoundError, DataFolderError."""
        # the id may come straight from a request: it must not lead out of the folder
        if not DEM_ID.fullmatch(dem_id):
            raise NotFoundError("DEM", dem_id)
        try:
            return _grid(self.folder.dem(dem_id))
        except FileNotFoundError as error:
            self.folder.check_usable()  # where the whole folder is gone, that is what to tell
            raise NotFoundError("DEM", dem_id) from error


# each task knows the arguments that it takes; see ``channel``
Task = Callable[[TaskContext, Any], Mapping[str, object]]


@lru_cache(maxsize=2)
def _grid(folder: Path) -> ElevationGrid:
    return load_grid(folder)


def read_uploaded_dem(context: TaskContext, arguments: ReadDemArguments) -> Mapping[str, object]:
    """Read the file at ``path``, or the bundled DEM ``sample``, keep the grid in the work folder, and tell about it.

    Raises DemReadError, FrameError, SampleError.
    """
    path = sample_path(arguments["sample"]) if "sample" in arguments else Path(arguments["path"])
    options = arguments["options"]
    grid = read_dem(
        path,
        nodata=float(options["nodata"]) if "nodata" in options else None,
        crs=options.get("crs"),
        height_unit=options.get("height_unit"),
        band=options.get("band"),
        cell_m=options.get("cell_m"),
        max_cells=context.settings.max_dem_cells,
    )
    save_grid(grid, context.work)
    make_durable(context.work)
    return _summary(grid)


def draw_hillshade(context: TaskContext, arguments: DemArguments) -> Mapping[str, object]:
    """Draw a DEM that was read into the work folder; raises NotFoundError when it was just deleted."""
    from service.drawing.class_map import write_hillshade  # heavy, and reading does without

    grid = context.grid(arguments["dem_id"])
    context.work.mkdir(parents=True)
    write_hillshade(grid, context.work / context.folder.hillshade(arguments["dem_id"]).name)
    make_durable(context.work)
    return {}


def _summary(grid: ElevationGrid) -> dict[str, JsonValue]:
    known = grid.unknown_posts < grid.heights_m.size
    return {
        # the resource has the name that the file came under
        **ground_of(grid).model_dump(mode="json", exclude={"name"}),
        "driver": grid.provenance.driver,
        "cells": grid.heights_m.size,
        "lowest_m": float(np.nanmin(grid.heights_m)) if known else None,
        "highest_m": float(np.nanmax(grid.heights_m)) if known else None,
        "warnings": list(grid.provenance.warnings),
    }


def check_epochs(context: TaskContext, arguments: BodyArguments) -> Mapping[str, object]:
    """Raises NotJsonError, LimitError, NotValidError; nothing comes back."""
    model_of(EpochsIn, body_in(arguments), DetectorLimits.of(context.settings).refuse_long_epochs)
    return {}


def check_request(context: TaskContext, arguments: CheckArguments) -> Checked:
    """Read a body and refuse what cannot be calculated or is beyond the limits, before a job exists.

    given: what the request refers to; without it ``needs`` comes back where there is something to find first. What is
    long of the parameters goes into the work folder. Raises NotJsonError, NotValidError, NotFoundError, LimitError, and
    what the product's check raises.
    """
    product = context.products[arguments["product"]]
    asked: Any = read_body(product.asked, body_in(arguments["body"]), context.settings)
    needs = product.needs(asked)
    if needs is not None and "given" not in arguments:
        return {"dem_id": asked.dem_id, "needs": _fields_of(needs)}
    try:
        parameters = product.completed(asked, _given(arguments))
    except ValidationError as error:
        raise NotValidError(sentence_of(error), fields_of(error)) from error
    grid = context.grid(asked.dem_id)
    parameters, told = in_dem_datum(grid, parameters)
    product.check(grid, parameters, context.settings)
    packed = product.pack(grid, parameters, context.work)
    if context.work.exists():
        make_durable(context.work)
    notes = [*notes_on_older_names(asked), *told]
    request = JobRequest(parameters=packed, has_inputs=context.work.exists(), notes=notes)
    return {"dem_id": asked.dem_id, "request": request}


def _given(arguments: CheckArguments) -> Given:
    found = arguments.get("given", {})
    return Given(found.get("map_kind"), found.get("map_parameters", {}), tuple(found.get("occluded", ())))


def _fields_of(needs: Needs) -> NeedsFields:
    return NeedsFields(
        map_id=needs.map_id,
        map_kinds=needs.map_kinds,
        detector_id=needs.detector_id,
        persistent_s=needs.persistent_s,
    )


def calculation_of(product: Product) -> Task:
    """The task that calculates one product: files into the work folder; their digest and the answer come back."""

    def calculate(context: TaskContext, arguments: CalculateArguments) -> Calculated:
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


def draw_layer(context: TaskContext, arguments: LayerArguments) -> Mapping[str, object]:
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


def tasks_for(products: Mapping[str, Product]) -> Mapping[str, Task]:
    """All tasks of a service with these products; a job's task is called as its product."""
    return {
        "read-dem": read_uploaded_dem,
        "draw-hillshade": draw_hillshade,
        "check-request": check_request,
        "draw-layer": draw_layer,
        "check-epochs": check_epochs,
        **{name: calculation_of(product) for name, product in products.items()},
    }
