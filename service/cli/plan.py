"""``sightline plan``: a rover, its start and goals, limits and areas in; a path, or why there is none, out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.parts.maps_for_paths import kind_of_summary, with_map
from service.parts.sentences import sentence_of
from service.products.paths.answers import time_words
from service.products.paths.request import PathParameters, WeightsIn

from .maps import anchors_of
from .older_maps import MapFiles, make_map
from .output import facts_table
from .positioning import SatelliteOptions
from .shape_files import polygon_fields
from .track_files import tracks_from_file

__all__ = ["make_path", "request_of"]

PLACE_FORM = "{} {!r} is not of the form EAST,NORTH, or LON,LAT with --lonlat."


def request_of(
    file: Path | None, map_file: Path | None, options: dict[str, Any], parts: dict[str, dict[str, Any]], sky: Any
) -> PathParameters:
    """What the options ask for, or a file that holds the whole request. Raises RequestError.

    parts: rover, limits, weights and budget, None where an option was not given. sky: SatelliteOptions.
    """
    fields = _fields_of_file(file) if file is not None else _fields_of_options(options, parts, sky)
    if map_file is not None:
        summary = _json_of(map_file, "map")
        try:
            fields = with_map(fields, kind_of_summary(summary), summary.get("parameters", {}))
        except RequestError as error:
            raise RequestError(f"The map {map_file.name}: {error}") from error
    try:
        return PathParameters.model_validate(fields)
    except ValidationError as error:
        prefix = "" if file is None else f"The request {file.name}: "
        raise RequestError(f"{prefix}{sentence_of(error)}") from error


def make_path(dem: str, asked: PathParameters, **rest: Any) -> None:
    """Read, plan, write and print; ``rest`` as for make_map."""
    from service.products.layers import LAYERS
    from service.products.paths.calculate import calculate_path

    files = MapFiles("path.json", tuple(LAYERS["path"]))
    make_map(dem, asked, calculate_path, files, _tables, what="Planning", **rest)


def weights_of(texts: list[str]) -> dict[str, float]:
    """NAME=VALUE options as weights. Raises RequestError."""
    names, found = tuple(WeightsIn.model_fields), {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            found[name.strip().replace("-", "_")] = float(value)
        except ValueError as error:
            raise RequestError(f"--weight {text!r} is not of the form NAME=NUMBER.") from error
        if not equals or name.strip().replace("-", "_") not in names:
            raise RequestError(f"--weight {text!r} is not one of {', '.join(names)}, such as climb=2.")
    return found


def _fields_of_options(
    options: dict[str, Any], parts: dict[str, dict[str, Any]], sky: SatelliteOptions
) -> dict[str, Any]:
    lonlat = options["lonlat"]
    if options["start"] is None or not options["goals"]:
        raise RequestError("A path needs --start EAST,NORTH and --goal EAST,NORTH (or a polygon file), or --request.")
    goals: list[dict[str, Any]] = []
    for text in options["goals"]:
        path = Path(text)
        goals += (
            polygon_fields(path) if path.suffix.lower() in (".geojson", ".json") else [_place("--goal", text, lonlat)]
        )
    return {
        "start": _place("--start", options["start"], lonlat),
        "goals": goals,
        "way_points": [_place("--via", text, lonlat) for text in options["via"]],
        "anchors": [
            anchor.model_dump(exclude_none=True)
            for anchor in anchors_of(options["anchor_texts"], options["anchor_files"], lonlat=lonlat)
        ],
        **_given({"satellites": sky.fields(), "start_heading_deg": options["heading"], "seed": options["seed"]}),
        **_given({name: options[name] for name in ("mode", "unknown", "curvature")}),
        "no_go": [polygon for file in options["no_go"] for polygon in polygon_fields(file)],
        "keep_in": [polygon for file in options["keep_in"] for polygon in polygon_fields(file)],
        "tracks": [
            track.model_dump(exclude_none=True) for file in options["tracks"] for track in tracks_from_file(file)
        ],
        **_given({"departure_s": options["departure"]}),
        **{name: _given(part) for name, part in parts.items()},
        "weights": weights_of(options["weights"]),
    }


def _fields_of_file(file: Path) -> dict[str, Any]:
    document = _json_of(file, "request")
    # a body that was written for HTTP names its DEM, which here is an argument
    return {name: value for name, value in document.items() if name != "dem_id"}


def _json_of(file: Path, what: str) -> dict[str, Any]:
    try:
        document = json.loads(file.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RequestError(f"The {what} {file.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The {what} {str(file)!r} cannot be read: {error.strerror}.") from error
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The {what} {file.name} is not JSON: {error}.") from error
    if not isinstance(document, dict):
        raise RequestError(f"The {what} {file.name} holds no JSON object.")
    return document


def _place(option: str, text: str, lonlat: bool) -> dict[str, float]:
    try:
        first, second = (float(part) for part in text.split(","))
    except ValueError as error:
        raise RequestError(PLACE_FORM.format(option, text)) from error
    return {"lon_deg": first, "lat_deg": second} if lonlat else {"east_m": first, "north_m": second}


def _given(fields: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if value is not None}


def _tables(summary: dict[str, Any]) -> tuple[Table, ...]:
    facts = [("outcome", summary["status"].replace("_", " ")), ("in words", summary["sentence"])]
    if summary["totals"] is None:
        return (facts_table(f"Path over {summary['dem']['name']}", facts), *_cuts(summary))
    totals, ranged = summary["totals"], bool(summary["ranged_to"])
    facts += [
        ("length", f"{totals['length_m'] / 1000.0:.3f} km"),
        ("up, down", f"{totals['climb_m']:.0f} m, {totals['descent_m']:.0f} m"),
        ("steepest ground", f"{totals['steepest_deg']:.1f}°"),
        ("time", time_words(totals["time_s"])),
    ]
    if ranged:
        worst = totals["worst_dop"]
        needed, measure = summary["needed_in_sight"], summary["parameters"]["limits"]["measure"].upper()
        facts += [
            (f"with fewer than {needed} in sight", time_words(totals["out_of_sight_s"])),
            ("  longest at a stretch", time_words(totals["longest_out_of_sight_s"])),
            ("fewest in sight", str(totals["fewest_anchors"])),
            (f"worst {measure}", "no fix somewhere" if worst is None else f"{worst:.2f}"),
            ("position error, mean", f"{totals['mean_position_sigma_m']:.2f} m, one sigma, predicted"),
        ]
    split = ", ".join(
        f"{name.replace('_', ' ')} {value:,.0f}" for name, value in summary["cost_split"].items() if value
    )
    facts.append(("cost", f"{summary['cost']:,.0f} ({split})"))
    if summary["ratio"] is not None:
        facts.append(("  of the reference", f"{summary['ratio']:.4f}"))
    facts += [("planned by", summary["planner"]), ("validator", summary["validation"]["sentence"])]
    return (facts_table(f"Path over {summary['dem']['name']}", facts),)


def _cuts(summary: dict[str, Any]) -> tuple[Table, ...]:
    cut = summary["unreachable"]
    if cut is None:
        return ()
    table = Table(title="What would let a path through, one by itself", title_justify="left")
    table.add_column("limit")
    table.add_column("asked", justify="right")
    table.add_column("needed", justify="right")
    table.add_column("in words")
    table.add_column("path found")
    for one in cut["relaxations"]:
        numbers = (
            "–" if one[name] is None else f"{one[name]:.4g} {one['unit']}".rstrip() for name in ("asked", "needed")
        )
        table.add_row(one["reason"], *numbers, escape(one["sentence"]), "yes" if one["shown"] else "not shown")
    return (table,) if cut["relaxations"] else ()
