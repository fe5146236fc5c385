"""Visibility maps in a worker: check what is asked, calculate it, draw its layers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.estimates import estimate_visibility_map, refuse_beyond_limits
from service.jobs.folder import digest_of, make_durable
from service.layers import write_layer
from service.positions import resolve_anchor
from service.schemas import VisibilityMapParameters
from service.visibility_map import calculate
from service.visibility_map_store import load, save
from visibility import check_anchors

from .context import TaskContext

__all__ = ["calculate_visibility_map", "check_visibility_map", "draw_layer"]


def check_visibility_map(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Refuse what cannot be calculated or is beyond the limits, before anything is allocated for it.

    Raises LimitError, AnchorError, FrameError.
    """
    parameters = VisibilityMapParameters.model_validate(arguments["parameters"])
    grid = context.grid(arguments["dem_id"])
    estimate = estimate_visibility_map(grid, len(parameters.anchors), parameters.mode)
    refuse_beyond_limits(estimate, context.settings)
    check_anchors(grid, [resolve_anchor(grid, anchor) for anchor in parameters.anchors])
    return {}


def calculate_visibility_map(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Leave the finished map in the work folder; its digest and its summary come back."""
    parameters = VisibilityMapParameters.model_validate(arguments["parameters"])
    finished = calculate(context.grid(arguments["dem_id"]), parameters, context.progress)
    save(finished, context.work)
    make_durable(context.work)
    return {"digest": digest_of(context.work), "summary": finished.summary()}


def draw_layer(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Write one layer of a finished map into the work folder."""
    finished = load(context.folder.result(arguments["digest"]))
    context.work.mkdir(parents=True)
    write_layer(finished, arguments["layer"], context.work / arguments["layer"])
    make_durable(context.work)
    return {}
