"""What is wrong with a request is told by the place that its sender wrote, without names of ours in it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from service.ground.request import GroundIn
from service.live.request import DetectorIn, EpochsIn
from service.parts.sentences import place_of
from service.probes.request import PreviewIn, ProbeIn, ProfilesIn
from service.products.registry import PRODUCTS
from tests.service.asked import ASKED

MODELS = (*(one.asked for one in PRODUCTS.values()), GroundIn, ProbeIn, ProfilesIn, PreviewIn, DetectorIn, EpochsIn)


def unions(schema: Any) -> Iterator[tuple[str, tuple[str, ...]]]:
    """(kind, tags) of every union that a location can lead through."""
    if isinstance(schema, dict):
        if schema.get("type") == "tagged-union":
            yield "tagged", tuple(map(str, schema["choices"]))
        if schema.get("type") == "union":
            yield "untagged", ()
        for name, part in schema.items():
            # what a document shows of an input, and values of any JSON
            if name not in ("metadata", "serialization", "json_schema_input_schema", "python_schema", "ref"):
                yield from unions(part)
    elif isinstance(schema, (list, tuple)):
        for part in schema:
            yield from unions(part)


@pytest.mark.parametrize("model", MODELS, ids=lambda one: one.__name__)
def test_unions_of_a_request_are_tagged_so_that_places_leave_them_out(model: type[BaseModel]) -> None:
    for kind, tags in unions(model.__pydantic_core_schema__):
        assert kind == "tagged", "an untagged union tells the names of its classes"
        assert all(place_of(["a", tag, "b"]) == "a.b" for tag in tags), tags


@pytest.mark.parametrize(
    ("name", "changes", "place"),
    [
        ("visibility-map", {"area": {"lon_deg": 1, "lat_deg": 2, "radius_m": -1}}, "area.radius_m"),
        ("visibility-map", {"area": {"west_deg": 1, "south_deg": 2, "east_deg": 3}}, "area.north_deg"),
        ("visibility-map", {"curvature": {"radius_m": 0}}, "curvature.radius_m"),
        ("visibility-map", {"curvature": "round"}, "curvature"),
        ("path", {"goals": [{"east_m": "x", "north_m": 1}]}, "goals[0].east_m"),
        ("path", {"goals": [{"ring": [{"east_m": "x", "north_m": 1}] * 3}]}, "goals[0].ring[0].east_m"),
    ],
)
def test_a_wrong_field_is_called_as_it_was_written(name: str, changes: dict[str, Any], place: str) -> None:
    with pytest.raises(ValidationError) as caught:
        PRODUCTS[name].asked.model_validate({"dem_id": "d", **ASKED[name], **changes})
    assert place_of(caught.value.errors()[0]["loc"]) == place
