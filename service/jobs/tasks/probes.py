"""Probes: small questions about a DEM that a warm process answers at once, as the text of the answer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.probes.places import probe
from service.probes.profiles import profiles
from service.probes.request import ProbeIn, ProfilesIn

from .bodies import body_in, read_body
from .context import TaskContext

__all__ = ["answer_probe", "answer_profiles"]


def answer_probe(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Places probed. Raises NotJsonError, NotValidError, LimitError, NotFoundError, and what ``probe`` raises."""
    asked = read_body(ProbeIn, body_in(arguments), context.settings)
    return {"json": probe(context.grid(asked.dem_id), asked).model_dump_json()}


def answer_profiles(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Lines in profile. Raises NotJsonError, NotValidError, NotFoundError, and what ``profiles`` raises."""
    asked = read_body(ProfilesIn, body_in(arguments), context.settings)
    return {"json": profiles(context.grid(asked.dem_id), asked).model_dump_json()}
