"""What a session's ranges said against a map, taken back by requests: ``doubts``, on the anchors that it is about."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError, WithJsonSchema

from service.errors import RequestError
from service.parts.geojson_reading import GeoJsonShape, shapes_of
from service.parts.points import NotNegative, Number, PlaceIn, Positive, StrictModel
from service.parts.sentences import sentence_of
from service.parts.shapes_in_grid import places_in_grid
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import SightDoubt

__all__ = ["DoubtParameters", "DoubtsIn", "doubted_anchors", "doubts_by_anchor"]

CELLS = 2.0  # a map is often off by about so many
MOST_PLACES = 10_000  # of all doubts in a request: every one is weighed at every post that it reaches
CALLED = "doubts.geojson"


class DoubtsIn(StrictModel):
    """Where ranges contradicted a map: what a detector session answers at /map-doubts, or map_doubts.geojson."""

    geojson: Annotated[dict[str, JsonValue], WithJsonSchema({"type": "object"})] = Field(
        description="A FeatureCollection of lines or points with anchor_id, expected, probability, bearing_deg and "
        "distance_m; 10,000 places at most."
    )
    reach_m: Positive | None = Field(
        None,
        description="How far beside its line a doubt holds, one sigma, metres: it weighs its probability times "
        "exp(-d²/2·reach²). Left out: two cells of the DEM.",
    )


class DoubtParameters(StrictModel):
    """What ranges have said against the map that a request is about."""

    doubts: DoubtsIn | None = Field(
        None,
        description="Map doubts of a session, as a weight on what the map has: where one weighs more than half, an "
        "anchor that the map has in sight is unknown and does not count. Of anchors that stand elsewhere now, or are "
        "not asked about, they are passed over, which is told. null = the map is trusted.",
    )


class _Told(BaseModel):
    """The properties of a doubt that matter here."""

    model_config = ConfigDict(frozen=True)

    anchor_id: Annotated[str, Field(min_length=1)]
    expected: Literal["in sight", "hidden"]
    probability: Annotated[float, Field(strict=True, ge=0.0, le=1.0)]
    bearing_deg: Number
    distance_m: NotNegative


def doubts_by_anchor(
    grid: ElevationGrid, asked: DoubtsIn | None, anchors_m: dict[str, tuple[float, float]]
) -> tuple[dict[str, tuple[SightDoubt, ...]], tuple[str, ...]]:
    """(by anchor, the doubts about it; sentences on those that are passed over). anchors_m: east, north by id.

    A doubt is about an anchor that stands where the doubt saw it, to its reach. Raises RequestError, FrameError.
    """
    if asked is None:
        return {}, ()
    reach_m = asked.reach_m or CELLS * max(grid.cell_east_m, grid.cell_north_m)
    shapes = _shapes(asked)
    told = [_told(shape, number) for number, shape in enumerate(shapes)]
    strange = Counter(one.anchor_id for one in told if one.anchor_id not in anchors_m)
    about = [(one, shape.lines[0]) for one, shape in zip(told, shapes, strict=True) if one.anchor_id in anchors_m]
    # all at once, for what brings them into the grid has a price a call
    all_m = places_in_grid(grid, [PlaceIn.model_validate(place) for _, line in about for place in line])
    found: dict[str, list[SightDoubt]] = {}
    elsewhere, begin = Counter[str](), 0
    for one, line in about:
        places_m = all_m[begin : begin + len(line)]
        begin += len(line)
        bearing_rad = math.radians(one.bearing_deg)
        seen_m = places_m[len(line) // 2] + one.distance_m * np.array([math.sin(bearing_rad), math.cos(bearing_rad)])
        if math.dist(seen_m, anchors_m[one.anchor_id]) > reach_m:
            elsewhere[one.anchor_id] += 1
            continue
        along_m = tuple((east_m, north_m) for east_m, north_m in places_m.tolist())
        doubt = SightDoubt(along_m, one.probability, one.expected == "in sight", reach_m)
        found.setdefault(one.anchor_id, []).append(doubt)
    return {anchor_id: tuple(doubts) for anchor_id, doubts in found.items()}, _passed_over(strange, elsewhere)


def doubted_anchors(
    grid: ElevationGrid, anchors: Sequence[Anchor], asked: DoubtsIn | None
) -> tuple[tuple[Anchor, ...], tuple[str, ...]]:
    """(the anchors with the doubts about them, sentences on what of the doubts changes nothing on a map).

    Raises RequestError, FrameError.
    """
    found, told = doubts_by_anchor(grid, asked, {one.id: (one.east_m, one.north_m) for one in anchors})
    heard = sorted(name for name, doubts in found.items() if any(not doubt.has_sight for doubt in doubts))
    if heard:
        told = (*told, f"Ranges heard {', '.join(heard)} where the map hides it; a map does not count on that.")
    return tuple(replace(one, doubts=found.get(one.id, ())) for one in anchors), told


def _shapes(asked: DoubtsIn) -> list[GeoJsonShape]:
    """None where there are no features: a session that contradicts nothing. Raises RequestError, also for too many."""
    return [] if asked.geojson.get("features") == [] else shapes_of(asked.geojson, CALLED, MOST_PLACES)


def _told(shape: GeoJsonShape, number: int) -> _Told:
    if shape.kind == "Polygon":
        raise RequestError(f"{CALLED} holds a polygon; a doubt is a line or a point.")
    try:
        return _Told.model_validate(dict(shape.properties))
    except ValidationError as error:
        raise RequestError(f"{CALLED}, shape {number}, is no doubt of a session: {sentence_of(error)}") from error


def _passed_over(strange: Counter[str], elsewhere: Counter[str]) -> tuple[str, ...]:
    told = []
    if strange:
        told.append(f"Doubts about {', '.join(sorted(strange))} are passed over: no such anchor is asked about.")
    if elsewhere:
        told.append(f"Doubts about {', '.join(sorted(elsewhere))} are passed over: the anchor stands elsewhere now.")
    return tuple(told)
