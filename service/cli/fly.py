"""``sightline fly``: from where to where through the air, above what, in; a flight, its mission and pictures out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.table import Table

from service.errors import RequestError
from service.parts.maps_for_paths import kind_of_summary
from service.parts.sentences import sentence_of
from service.products.flights.calculate import calculate_flight
from service.products.flights.request import FlightParameters
from service.products.layers import LAYERS
from service.products.paths.answers import time_words

from .anchor_texts import position_fields
from .maps import anchors_of
from .older_maps import MapFiles, make_map
from .output import facts_table
from .request_files import given, request_from_file
from .volume_texts import ceiling_fields

__all__ = ["flight_request", "make_flight"]

POINT_FORM = "{} {!r} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 80agl or 612msl."


def flight_request(
    file: Path | None, map_file: Path | None, options: dict[str, Any], above: dict[str, Any], rest: dict[str, Any]
) -> FlightParameters:
    """What the options ask for, or a file that holds the whole request. Raises RequestError.

    above: options of the morphing map, None where one was not given. rest: fields as they are.
    """
    if file is not None:
        return request_from_file(file, FlightParameters)
    if options["start"] is None or options["goal"] is None:
        raise RequestError("A flight needs --start and --goal, each EAST,NORTH,HEIGHT; or --request.")
    lonlat = options["lonlat"]
    anchors = anchors_of(options["anchor_texts"], options["anchor_files"], lonlat=lonlat)
    ceiling = {} if options["ceiling"] is None else ceiling_fields(options["ceiling"])
    fields = {
        **{
            name: position_fields(options[name], lonlat=lonlat, complaint=POINT_FORM.format(f"--{name}", options[name]))
            for name in ("start", "goal")
        },
        **given(rest),
        "budget": given({"iterations": options["iterations"], "seconds": options["seconds"]}),
    }
    if map_file is None and anchors and not ceiling:
        raise RequestError("A morphing map of anchors needs --ceiling, the top of the air, such as 2500msl or 300agl.")
    if map_file is not None and anchors:
        raise RequestError("A map brings its own anchors along; give --map or anchors.")
    if map_file is not None:
        fields |= {"morphing_map": _map_of(map_file), **ceiling}
    elif anchors:
        told = [anchor.model_dump(exclude_none=True) for anchor in anchors]
        fields["morphing_map"] = {"anchors": told, **given(above), **ceiling}
    else:
        fields |= ceiling
    try:
        return FlightParameters.model_validate(fields)
    except ValidationError as error:
        raise RequestError(sentence_of(error)) from error


def make_flight(dem: str, asked: FlightParameters, **rest: Any) -> None:
    """Read, plan, write and print; ``rest`` as for make_map."""
    files = MapFiles("flight.json", tuple(LAYERS["flight"]))
    make_map(dem, asked, calculate_flight, files, _tables, what="Planning", **rest)


def _map_of(file: Path) -> Any:
    """What a morph.json was asked for. Raises RequestError."""
    try:
        summary = json.loads(file.read_text(encoding="utf-8-sig"))
        if isinstance(summary, dict) and kind_of_summary(summary) == "morphing-map":
            return summary["parameters"]
    except OSError as error:
        raise RequestError(f"The map {str(file)!r} cannot be read: {error.strerror}.") from error
    except (ValueError, RequestError) as error:
        raise RequestError(f"The map {file.name} is no morph.json that Sightline wrote.") from error
    raise RequestError(f"The map {file.name} is no morph.json that Sightline wrote.")


def _tables(summary: dict[str, Any]) -> tuple[Table, ...]:
    facts = [("outcome", summary["status"].replace("_", " ")), ("in words", summary["sentence"])]
    totals = summary["totals"]
    if totals is not None:
        facts += [
            ("length", f"{totals['length_m'] / 1000.0:.3f} km"),
            ("up, down", f"{totals['climb_m']:.0f} m, {totals['descent_m']:.0f} m"),
            ("time", time_words(totals["time_s"])),
            ("highest", f"{totals['highest_m']:.1f} m"),
            ("from the ground", f"{totals['clearance_m']:.1f} m and more"),
        ]
        if totals["margin_m"] is not None:
            facts.append(("above the morphing map", f"{totals['margin_m']:.1f} m and more"))
        facts += [("corners", str(len(summary["corners"]))), ("planned by", summary["planner"])]
        facts.append(("validator", summary["validation"]["sentence"]))
    return (facts_table(f"Flight over {summary['dem']['name']}", facts),)
