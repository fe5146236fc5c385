"""What bodies that ask for maps must be, and the parameters that each comes to with what the service knows besides."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from pydantic import BaseModel, ValidationError

from service.errors import NotValidError, RequestError
from service.parts.maps_for_paths import with_map
from service.parts.positioning_answers import DopMapIn, MorphingMapIn
from service.parts.sentences import sentence_of
from service.products.flights.request import FlightIn, FlightParameters
from service.products.paths.answer import PathIn
from service.products.paths.request import PathParameters
from service.products.placements.answer import PlacementIn
from service.products.repositionings.answer import RepositioningIn
from service.products.repositionings.request import RepositioningParameters
from service.products.visibility.answer import VisibilityMapIn

__all__ = ["MAP_REQUESTS", "MapRequest"]

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class MapRequest:
    """The model of the body; ``parameters`` takes it and what the service found for it, and raises RequestError.

    needs: fields by which the service has to find something first, where the body has them.
    """

    model: type[BaseModel]
    parameters: Callable[[Any, Mapping[str, Any]], Json]
    needs: tuple[str, ...] = ()

    def needed(self, asked: BaseModel) -> Json | None:
        """Those fields of a body; None where it names nothing that has to be found."""
        fields = asked.model_dump(mode="json", include=set(self.needs))
        return fields if any(isinstance(value, str) for value in fields.values()) else None


def _as_asked(asked: BaseModel, _: Mapping[str, Any]) -> Json:
    return asked.model_dump(mode="json", exclude={"dem_id"}, exclude_none=True)


def _of_path(asked: PathIn, found: Mapping[str, Any]) -> Json:
    fields = asked.model_dump(mode="json", exclude={"dem_id", "map_id"}, exclude_unset=True, exclude_none=True)
    if asked.map_id is not None:
        _check_ground(asked.dem_id, found)
        fields = with_map(fields, found["kind"], found["parameters"])
    return _whole(PathParameters, fields)


def _of_flight(asked: FlightIn, found: Mapping[str, Any]) -> Json:
    fields = asked.model_dump(mode="json", exclude={"dem_id", "map_id"}, exclude_unset=True, exclude_none=True)
    if asked.map_id is not None:
        _check_ground(asked.dem_id, found)
        if found["parameters"].get("frames") is not None:
            raise RequestError(f"The morphing map {asked.map_id} has frames; a flight is planned above one without.")
        fields["morphing_map"] = found["parameters"]
    return _whole(FlightParameters, fields)


def _of_repositioning(asked: RepositioningIn, found: Mapping[str, Any]) -> Json:
    ids = {anchor.id for anchor in asked.anchors}
    lasting = [one for one in found.get("occluded", ()) if one in ids]
    fields = asked.model_dump(exclude={"dem_id", "detector_id", "persistent_s"}, exclude_unset=True)
    return _whole(RepositioningParameters, {**fields, "occluded": list(dict.fromkeys((*asked.occluded, *lasting)))})


def _check_ground(dem_id: str, found: Mapping[str, Any]) -> None:
    if found["dem_id"] != dem_id:
        raise RequestError(f"The {found['kind']} {found['id']} is of another DEM, {found['dem_id']}.")


def _whole(model: type[BaseModel], fields: Json) -> Json:
    try:
        return model.model_validate(fields).model_dump(mode="json", exclude_none=True)
    except ValidationError as error:
        raise NotValidError(sentence_of(error)) from error


MAP_REQUESTS: Mapping[str, MapRequest] = MappingProxyType(
    {
        "visibility-map": MapRequest(VisibilityMapIn, _as_asked),
        "dop-map": MapRequest(DopMapIn, _as_asked),
        "morphing-map": MapRequest(MorphingMapIn, _as_asked),
        "placement": MapRequest(PlacementIn, _as_asked),
        "path": MapRequest(PathIn, _of_path, ("map_id",)),
        "flight": MapRequest(FlightIn, _of_flight, ("map_id",)),
        "repositioning": MapRequest(RepositioningIn, _of_repositioning, ("detector_id", "persistent_s")),
    }
)
