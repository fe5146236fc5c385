"""``sightline fly``: from where to where through the air, above what, in; a flight, its mission and pictures out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, JsonValue, ValidationError
from rich.table import Table

from service.errors import RequestError
from service.parts.plan_answers import time_words
from service.parts.sentences import sentence_of
from service.products import Given
from service.products.flights import FLIGHT
from service.products.flights.calculate import FlightSummary
from service.products.flights.request import FlightParameters

from .anchor_texts import position_fields
from .maps import anchors_of, make_map
from .output import facts_table
from .request_files import given, given_map, request_from_file, request_of_fields
from .volume_texts import ceiling_fields

__all__ = ["FlyOptions", "flight_request", "make_flight"]

POINT_FORM = "{} {!r} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 80agl or 612msl."


@dataclass(frozen=True, slots=True)
class FlyOptions:
    """The question as typed; morphing_map, budget and rest: fields of the request, None where one was not given."""

    start: str | None
    goal: str | None
    anchor_texts: list[str]
    anchor_files: list[Path]
    lonlat: bool
    ceiling: str | None
    morphing_map: Mapping[str, JsonValue]
    budget: Mapping[str, JsonValue]
    rest: Mapping[str, JsonValue]

    def question(self, *, on_map: bool) -> FlightParameters:
        """What they ask for; on_map: a map is given besides. Raises RequestError."""
        if self.start is None or self.goal is None:
            raise RequestError("A flight needs --start and --goal, each EAST,NORTH,HEIGHT; or --request.")
        anchors = anchors_of(self.anchor_texts, self.anchor_files, lonlat=self.lonlat)
        if on_map and anchors:
            raise RequestError("A map brings its own anchors along; give --map or anchors.")
        ceiling = {} if self.ceiling is None else ceiling_fields(self.ceiling)
        if anchors and not ceiling:
            raise RequestError(
                "A morphing map of anchors needs --ceiling, the top of the air, such as 2500msl or 300agl."
            )
        above = {}
        if anchors:
            told = [anchor.model_dump(exclude_none=True) for anchor in anchors]
            above = {"morphing_map": {"anchors": told, **given(self.morphing_map), **ceiling}}
        fields = {
            "start": self._point("--start", self.start),
            "goal": self._point("--goal", self.goal),
            **given(self.rest),
            "budget": given(self.budget),
            **(above or ceiling),
        }
        return request_of_fields(fields, FlightParameters)

    def _point(self, option: str, text: str) -> Any:
        return position_fields(text, lonlat=self.lonlat, complaint=POINT_FORM.format(option, text))


def flight_request(file: Path | None, map_file: Path | None, options: FlyOptions) -> BaseModel:
    """What the options ask for, or a file that holds the whole request, above a map where one is given.

    Raises RequestError.
    """
    on_map = map_file is not None
    asked = (
        options.question(on_map=on_map)
        if file is None
        else request_from_file(file, FlightParameters, instead=("map_id",) if on_map else ())
    )
    above = Given() if map_file is None else given_map(map_file, ("morphing-map",))
    if map_file is not None and asked.morphing_map is not None:
        raise RequestError("Give only one of --map and morphing_map.")
    try:
        whole: BaseModel = FLIGHT.completed(asked, above)
    except ValidationError as error:
        raise RequestError(sentence_of(error)) from error
    return whole


def make_flight(dem: str, asked: BaseModel, **rest: Any) -> None:
    """Read, plan, write and print; ``rest`` as for make_map."""
    make_map(dem, FLIGHT, asked, _tables, summary="flight.json", what="Planning", **rest)


def _tables(answer: FlightSummary) -> tuple[Table, ...]:
    facts = [("outcome", answer.status.replace("_", " ")), ("in words", answer.sentence)]
    totals = answer.totals
    if totals is not None:
        facts += [
            ("length", f"{totals.length_m / 1000.0:.3f} km"),
            ("up, down", f"{totals.climb_m:.0f} m, {totals.descent_m:.0f} m"),
            ("time", time_words(totals.time_s)),
            ("highest", f"{totals.highest_m:.1f} m"),
            ("from the ground", f"{totals.clearance_m:.1f} m and more"),
        ]
        if totals.margin_m is not None:
            facts.append(("above the morphing map", f"{totals.margin_m:.1f} m and more"))
        facts += [("corners", str(len(answer.corners))), ("planned by", answer.planner)]
        if answer.validation is not None:
            facts.append(("validator", answer.validation.sentence))
    return (facts_table(f"Flight over {answer.dem.name}", facts),)
