"""What worker processes can be asked to do, by name: DEMs, requests checked, products calculated, probes answered."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from service.errors import NotFoundError, NotReadyError, NotValidError
from service.jobs.channel import model_of
from service.jobs.folder import digest_of, make_durable
from service.jobs.kept_files import load, save
from service.jobs.marker import write_owner
from service.jobs.records import JobRequest
from service.live.limits import DetectorLimits
from service.live.request import EpochsIn
from service.parts.altitude_datums import in_dem_datum
from service.parts.cover import covered
from service.parts.sentences import fields_of, notes_on_older_names, sentence_of
from service.parts.unused import notes_on_unused
from service.probes.canopy_fits import CanopyFitIn, canopy_fit
from service.probes.places import probe
from service.probes.previews import write_preview
from service.probes.profiles import profiles
from service.probes.replans import ReplanIn, replan
from service.probes.request import PREVIEW_FILE, PreviewIn, ProbeIn, ProfilesIn
from service.products import Given, Needs, Product, Work
from terrain import ElevationGrid

from .channel import (
    BodyArguments,
    CalculateArguments,
    Calculated,
    CheckArguments,
    Checked,
    LayerArguments,
    NeedsFields,
    ReplanArguments,
    body_in,
    read_body,
)
from .dem_tasks import (
    Task,
    TaskContext,
    draw_hillshade,
    plan_ground,
    read_ground,
    read_tiles,
    read_uploaded_dem,
    tell_coverage,
    write_dem_level,
)
from .mission_tasks import open_mission, read_mission, read_places, read_range_log, write_mission_file
from .tile_tasks import tell_tiles, write_layer_level

__all__ = [
    "answer_canopy_fit",
    "answer_preview",
    "answer_probe",
    "answer_profiles",
    "answer_replan",
    "calculation_of",
    "check_epochs",
    "check_request",
    "draw_layer",
    "tasks_for",
]

# within a job's work folder, what a calculation keeps out of memory until it is done
UNFINISHED = "unfinished"


def check_epochs(context: TaskContext, arguments: BodyArguments) -> Mapping[str, object]:
    """Raises NotJsonError, LimitError, NotValidError; nothing comes back."""
    model_of(EpochsIn, body_in(arguments), DetectorLimits.of(context.settings).refuse_long_epochs)
    return {}


def answer_probe(context: TaskContext, arguments: BodyArguments) -> Mapping[str, object]:
    """Places probed. Raises NotJsonError, NotValidError, LimitError, NotFoundError, and what ``probe`` raises."""
    asked = read_body(ProbeIn, body_in(arguments), context.settings)
    return {"json": probe(_ground(context, asked.dem_id, asked), asked).model_dump_json()}


def answer_profiles(context: TaskContext, arguments: BodyArguments) -> Mapping[str, object]:
    """Lines in profile. Raises NotJsonError, NotValidError, NotFoundError, and what ``profiles`` raises."""
    asked = read_body(ProfilesIn, body_in(arguments), context.settings)
    return {"json": profiles(_ground(context, asked.dem_id, asked), asked).model_dump_json()}


def answer_canopy_fit(context: TaskContext, arguments: BodyArguments) -> Mapping[str, object]:
    """A canopy fitted. Raises NotJsonError, NotValidError, LimitError, NotFoundError, what ``canopy_fit`` raises."""
    asked = read_body(CanopyFitIn, body_in(arguments), context.settings)
    grid = None if asked.dem_id is None else _ground(context, asked.dem_id, asked)
    return {"json": canopy_fit(grid, asked).model_dump_json()}


def answer_preview(context: TaskContext, arguments: BodyArguments) -> Mapping[str, object]:
    """Numbers over a DEM into the work folder. Raises NotJsonError, NotValidError, LimitError, NotFoundError, and what
    ``write_preview`` raises.
    """
    asked = read_body(PreviewIn, body_in(arguments), context.settings)
    grid = _ground(context, asked.dem_id, asked)
    context.work.mkdir(parents=True)
    write_preview(grid, asked, context.work / PREVIEW_FILE)
    return {}


def answer_replan(context: TaskContext, arguments: ReplanArguments) -> Mapping[str, object]:
    """A path planned again from another start. Raises NotJsonError, NotValidError, NotFoundError, what ``replan``
    raises.
    """
    given = read_body(ReplanIn, body_in(arguments), context.settings)
    product = context.products["path"]
    asked = product.unpacked(arguments["parameters"], context.folder.inputs(arguments["job_id"]))
    return {"json": replan(_ground(context, arguments["dem_id"], asked), asked, given).model_dump_json()}


def check_request(context: TaskContext, arguments: CheckArguments) -> Checked:
    """Read a body and refuse what cannot be calculated or is beyond the limits, before a job exists.

    given: what the request refers to; without it ``needs`` comes back where there is something to find first. What is
    long of the parameters goes into the work folder. Raises NotJsonError, NotValidError, NotFoundError, LimitError, and
    what the product refuses.
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
    grid = _ground(context, asked.dem_id, parameters)
    parameters, told = in_dem_datum(grid, parameters)
    product.refuse(grid, parameters, context.settings)
    packed = product.pack(grid, parameters, context.work)
    if context.work.exists():
        make_durable(context.work)
    notes = [*notes_on_older_names(asked), *told, *notes_on_unused(grid, parameters)]
    request = JobRequest(parameters=packed, has_inputs=context.work.exists(), notes=notes)
    return {"dem_id": asked.dem_id, "request": request}


def _ground(context: TaskContext, dem_id: str, parameters: BaseModel) -> ElevationGrid:
    """A DEM with what the parameters say stands there. Raises NotFoundError, and what ``covered`` raises."""
    return covered(context.grid(dem_id), parameters, context.settings.max_dem_cells)


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
        unfinished = context.work / UNFINISHED
        work = Work(context.progress, context.stop, context.settings.dask_scheduler, unfinished)
        unfinished.mkdir(parents=True)
        grid = _ground(context, arguments["dem_id"], parameters)
        finished = product.calculate(grid, parameters, work)
        if product.finished is None:
            for layer in product.layers:
                layer.write(finished, context.work / layer.name)
        else:
            save(product, finished, context.work)
        shutil.rmtree(unfinished)
        write_owner(context.work, context.salt)
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
        "write-level": write_dem_level,
        "plan-ground": plan_ground,
        "read-ground": read_ground,
        "read-tiles": read_tiles,
        "tell-coverage": tell_coverage,
        "read-mission": read_mission,
        "open-mission": open_mission,
        "read-places": read_places,
        "write-mission-file": write_mission_file,
        "probe": answer_probe,
        "profiles": answer_profiles,
        "preview": answer_preview,
        "replan": answer_replan,
        "fit-canopy": answer_canopy_fit,
        "check-request": check_request,
        "draw-layer": draw_layer,
        "tell-tiles": tell_tiles,
        "write-layer-level": write_layer_level,
        "check-epochs": check_epochs,
        "read-range-log": read_range_log,
        **{name: calculation_of(product) for name, product in products.items()},
    }
