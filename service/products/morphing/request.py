"""What a morphing map is asked for; its parameters are in ``service.parts``, since paths and flights bring some too."""

from __future__ import annotations

from pydantic import ConfigDict, JsonValue

from service.parts.map_facts import DemId
from service.parts.positioning import POSITIONING_EXAMPLE, MorphingMapParameters

__all__ = ["REQUEST", "MorphingMapIn"]

REQUEST: dict[str, JsonValue] = {**POSITIONING_EXAMPLE, "dop_limit": 5.0, "ceiling_altitude_m": 2500.0}


class MorphingMapIn(MorphingMapParameters):
    """A DEM, anchors or satellites, and how good positioning must be up to which ceiling."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
