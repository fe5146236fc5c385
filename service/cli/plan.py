"""``sightline plan``: a rover, its start and goals, limits and areas in; a path, or why there is none, out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, JsonValue, ValidationError
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.parts.plan_answers import time_words
from service.parts.sentences import sentence_of
from service.products import Given
from service.products.paths import PATH
from service.products.paths.answer import PathSummary
from service.products.paths.request import PathQuestion, WeightsIn

from .maps import anchors_of, make_map
from .output import facts_table
from .positioning import SatelliteOptions
from .request_files import given, given_map, request_from_file, request_of_fields
from .shape_files import polygon_fields
from .track_files import tracks_from_file

__all__ = ["PlanOptions", "make_path", "path_request"]

PLACE_FORM = "{} {!r} is not of the form EAST,NORTH, or LON,LAT with --lonlat."


@dataclass(frozen=True, slots=True)
class PlanOptions:
    """The question as typed; rover, limits, budget and rest: fields of the request, None where one was not given."""

    start: str | None
    goals: list[str]
    via: list[str]
    weights: list[str]
    no_go: list[Path]
    keep_in: list[Path]
    anchor_texts: list[str]
    anchor_files: list[Path]
    tracks: list[Path]
    lonlat: bool
    satellites: SatelliteOptions
    rover: Mapping[str, JsonValue]
    limits: Mapping[str, JsonValue]
    budget: Mapping[str, JsonValue]
    rest: Mapping[str, JsonValue]

    def question(self) -> PathQuestion:
        """What they ask for. Raises RequestError."""
        if self.start is None or not self.goals:
            raise RequestError(
                "A path needs --start EAST,NORTH and --goal EAST,NORTH (or a polygon file), or --request."
            )
        anchors = anchors_of(self.anchor_texts, self.anchor_files, lonlat=self.lonlat)
        fields = {
            "start": self._place("--start", self.start),
            "goals": [goal for text in self.goals for goal in self._goals(text)],
            "way_points": [self._place("--via", text) for text in self.via],
            "anchors": [anchor.model_dump(exclude_none=True) for anchor in anchors],
            **given({"satellites": self.satellites.fields(), **self.rest}),
            "no_go": [polygon for file in self.no_go for polygon in polygon_fields(file)],
            "keep_in": [polygon for file in self.keep_in for polygon in polygon_fields(file)],
            "tracks": [track.model_dump(exclude_none=True) for file in self.tracks for track in tracks_from_file(file)],
            "rover": given(self.rover),
            "limits": given(self.limits),
            "budget": given(self.budget),
            "weights": _weights(self.weights),
        }
        return request_of_fields(fields, PathQuestion)

    def _goals(self, text: str) -> list[Any]:
        path = Path(text)
        if path.suffix.lower() in (".geojson", ".json"):
            return polygon_fields(path)
        return [self._place("--goal", text)]

    def _place(self, option: str, text: str) -> dict[str, float]:
        try:
            first, second = (float(part) for part in text.split(","))
        except ValueError as error:
            raise RequestError(PLACE_FORM.format(option, text)) from error
        return {"lon_deg": first, "lat_deg": second} if self.lonlat else {"east_m": first, "north_m": second}


def path_request(file: Path | None, map_file: Path | None, options: PlanOptions) -> BaseModel:
    """What the options ask for, or a file that holds the whole request, on a map where one is given.

    Raises RequestError.
    """
    on = Given() if map_file is None else given_map(map_file)
    instead = () if map_file is None else ("map_id",)
    asked = options.question() if file is None else request_from_file(file, PathQuestion, instead=instead)
    try:
        whole: BaseModel = PATH.completed(asked, on)
    except ValidationError as error:
        raise RequestError(sentence_of(error)) from error
    except RequestError as error:
        if map_file is None:
            raise
        raise RequestError(f"The map {map_file.name}: {error}") from error
    return whole


def make_path(dem: str, asked: BaseModel, **rest: Any) -> None:
    """Read, plan, write and print; ``rest`` as for make_map."""
    make_map(dem, PATH, asked, _tables, summary="path.json", what="Planning", **rest)


def _weights(texts: list[str]) -> dict[str, float]:
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


def _tables(answer: PathSummary) -> tuple[Table, ...]:
    facts = [("outcome", answer.status.replace("_", " ")), ("in words", answer.sentence)]
    totals, validation = answer.totals, answer.validation
    if totals is None or validation is None or answer.cost_split is None:
        return (facts_table(f"Path over {answer.dem.name}", facts), *_cuts(answer))
    facts += [
        ("length", f"{totals.length_m / 1000.0:.3f} km"),
        ("up, down", f"{totals.climb_m:.0f} m, {totals.descent_m:.0f} m"),
        ("steepest ground", f"{totals.steepest_deg:.1f}°"),
        ("time", time_words(totals.time_s)),
    ]
    if answer.ranged_to:
        facts += [
            (f"with fewer than {answer.needed_in_sight} in sight", time_words(totals.out_of_sight_s)),
            ("  longest at a stretch", time_words(totals.longest_out_of_sight_s)),
            ("fewest in sight", str(totals.fewest_anchors)),
            (
                f"worst {_measure(answer)}",
                "no fix somewhere" if totals.worst_dop is None else f"{totals.worst_dop:.2f}",
            ),
            ("position error, mean", f"{totals.mean_position_sigma_m:.2f} m, one sigma, predicted"),
        ]
    split = ", ".join(f"{name.replace('_', ' ')} {value:,.0f}" for name, value in answer.cost_split.items() if value)
    facts.append(("cost", f"{answer.cost:,.0f} ({split})"))
    if answer.ratio is not None:
        facts.append(("  of the reference", f"{answer.ratio:.4f}"))
    facts += [("planned by", answer.planner), ("validator", validation.sentence)]
    return (facts_table(f"Path over {answer.dem.name}", facts),)


def _measure(answer: PathSummary) -> str:
    limits = answer.parameters["limits"]
    assert isinstance(limits, dict), "as PathParameters has them"
    return str(limits["measure"]).upper()


def _cuts(answer: PathSummary) -> tuple[Table, ...]:
    cut = answer.unreachable
    if cut is None:
        return ()
    table = Table(title="What would let a path through, one by itself", title_justify="left")
    table.add_column("limit")
    table.add_column("asked", justify="right")
    table.add_column("needed", justify="right")
    table.add_column("in words")
    table.add_column("path found")
    for one in cut.relaxations:
        numbers = ("–" if value is None else f"{value:.4g} {one.unit}".rstrip() for value in (one.asked, one.needed))
        table.add_row(one.reason, *numbers, escape(one.sentence), "yes" if one.shown else "not shown")
    return (table,) if cut.relaxations else ()
