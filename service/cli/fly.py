"""``sightline fly``: a flight for a drone above the Digital Morphing Map and away from the ground."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.table import Table

from service.errors import RequestError

from .asking.ground import AreaOptions, Margin
from .asking.options import (
    GROUP,
    DemPath,
    Kind,
    Measure,
    Mode,
    Output,
    PlacesAndAnchors,
    Reading,
    RequestFile,
    option,
    told,
)
from .output import facts_table

if TYPE_CHECKING:
    from service.products import Given
    from service.products.flights.calculate import FlightSummary

__all__ = ["fly"]

POINT = "EAST,NORTH,HEIGHT"


@GROUP
@dataclass(frozen=True, slots=True)
class MapOptions:
    """The ``morphing_map`` of a request, besides its anchors and its ceiling."""

    dop_limit: Annotated[float | None, option("Of the morphing map of these anchors. (default 2.5)", "NUMBER")] = None
    min_anchors: Annotated[int | None, option("So many must be in sight there too.", "K")] = None
    kind: Annotated[Kind | None, option("What is measured. (default ranging)")] = None
    measure: Annotated[Measure | None, option("Which dilution of precision. (default pdop)")] = None
    mode: Annotated[Mode | None, option("How its sight lines are calculated. (default fast)")] = None


@GROUP
@dataclass(frozen=True, slots=True)
class FlightOptions:
    """Fields of the request itself."""

    bubble_m: Annotated[
        float | None, option("Distance kept from all ground, metres. (default 20)", "M", "--bubble")
    ] = None
    climb_weight: Annotated[
        float | None, option("What a metre of climb costs besides its way. (default 1)", "NUMBER")
    ] = None
    speed_m_per_s: Annotated[float | None, option("Of the drone. (default 12)", "M/S", "--speed")] = None
    seed: Annotated[int | None, option("The same seed gives the same flight. (default 0)", "N")] = None


@GROUP
@dataclass(frozen=True, slots=True)
class BudgetOptions:
    """The ``budget`` of a request."""

    iterations: Annotated[int | None, option("Of the planner. (default 20000)", "N")] = None
    seconds: Annotated[float | None, option("Its time-out. (default 60)", "S", "--time-limit")] = None


def fly(
    dem: DemPath,
    /,
    *,
    start: Annotated[str | None, option("Where the drone is; HEIGHT 80agl or 612msl. Required.", POINT)] = None,
    goal: Annotated[str | None, option("Where it shall be. Required.", POINT)] = None,
    map: Annotated[Path | None, option("morph.json: stay above its map and below its ceiling.", "FILE")] = None,
    anchors: PlacesAndAnchors = PlacesAndAnchors(),
    morphing_map: MapOptions = MapOptions(),
    ceiling: Annotated[str | None, option("Top of the air, 2500msl or 300agl; anchors need one.", "HEIGHT")] = None,
    flight: FlightOptions = FlightOptions(),
    budget: BudgetOptions = BudgetOptions(),
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Plan a flight for a drone above the Digital Morphing Map and a safety bubble away from the ground.

    Writes flight.json, flight.geojson, map.png and, of a flight, flight.csv,
    flight.plan, flight.kml and profile.png into --out.
    """
    from service.products.flights import FLIGHT
    from service.products.flights.request import FlightParameters

    from .asking.products import ask, completed, given_map, request_from_file, request_of_fields
    from .asking.texts import ceiling_fields, position_fields

    def point(option: str, text: str) -> dict[str, float | str]:
        form = f"{option} {text!r} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 80agl or 612msl."
        return position_fields(text, lonlat=anchors.lonlat, complaint=form)

    def given() -> Given | None:
        return None if map is None else given_map(map, ("morphing-map",))

    if request is not None:
        asked = request_from_file(request, FLIGHT, given())
    else:
        if start is None or goal is None:
            raise RequestError("A flight needs --start and --goal, each EAST,NORTH,HEIGHT; or --request.")
        placed = [anchor.model_dump(exclude_none=True) for anchor in anchors.read()]
        if map is not None and placed:
            raise RequestError("A map brings its own anchors along; give --map or anchors.")
        if told(morphing_map) and not placed:
            raise RequestError(
                "--dop-limit, --min-anchors, --kind, --measure and --mode are of the morphing map of anchors; "
                "give --anchor or --anchors."
            )
        top = {} if ceiling is None else ceiling_fields(ceiling)
        if placed and not top:
            raise RequestError(
                "A morphing map of anchors needs --ceiling, the top of the air, such as 2500msl or 300agl."
            )
        fields: dict[str, object] = {
            "start": point("--start", start),
            "goal": point("--goal", goal),
            **told(flight),
            "budget": told(budget),
            "area": area.part(in_degrees=anchors.lonlat),
            **({"morphing_map": {"anchors": placed, **told(morphing_map), **top}} if placed else top),
        }
        asked = completed(FLIGHT, request_of_fields(fields, FlightParameters), given(), map)
    ask(
        FLIGHT,
        dem,
        asked,
        _tables,
        summary="flight.json",
        what="Planning",
        reading=reading,
        output=output,
        margin_m=margin_m,
        on=given(),
    )


def _tables(answer: FlightSummary) -> tuple[Table, ...]:
    from planning.words import time_words

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
