"""From a DEM and a request to files: the way that every command which asks a product goes."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, JsonValue, ValidationError
from rich.table import Table

from service.errors import RequestError
from service.files.layer import Layer, replacing
from service.parts.altitude_datums import in_dem_datum
from service.parts.cover import covered
from service.parts.sentences import MAP_KINDS, kind_of_summary, notes_on_older_names, sentence_of
from service.parts.unused import notes_on_unused
from service.products import Finished, Given, Product, Work
from terrain import ElevationGrid
from visibility.sight.minimum_altitude import SIGNAL_ERROR
from visibility.sight.sight_lines import ERROR_STATEMENT

from ..output import (
    leaving_nothing_new,
    output_folder,
    print_json,
    print_notes,
    print_tables,
    print_warnings,
    progress_bar,
)
from .options import Output, Reading

__all__ = ["ask", "completed", "given_map", "request_from_file", "request_of_fields"]

Model = TypeVar("Model", bound=BaseModel)
FILES_OF_MAPS = {"visibility-map": "visibility.json", "dop-map": "dop.json", "morphing-map": "morph.json"}
# in place of the names that a service would have given
OF_THE_COMMAND_LINE = "command-line"
OTHER_GROUND = (
    "The map was made of other ground than this: another DEM, area or buildings (give the same --buildings); its "
    "anchors and limits are taken, and what they see is worked out on this ground."
)


def ask(
    product: Product,
    dem: str | ElevationGrid,
    asked: BaseModel | Path,
    tables: Callable[[Any], tuple[Table, ...]],
    *,
    summary: str,
    reading: Reading,
    output: Output,
    left_out: Collection[str] = (),
    what: str = "Sight lines",
    work: Work | None = None,
    changes: Mapping[str, object] | None = None,
    margin_m: float | None = None,
    on: Given | None = None,
    told: Sequence[str] = (),
) -> None:
    """Read, calculate, write and print. What can be wrong in the request is found before the work.

    asked: what the options make, of ``product.parameters``, or the file of a request; changes: what the command line
    says of either. tables: of the answer. summary: the file of the answer. left_out: layers that are
    not written. work: what the calculation may use; its progress is shown here. margin_m: how far around the area
    ground is read; None: of one file all, of tiles none. on: the map that it begins from. told: what else there is to
    know. Raises RequestError and what the packages raise.
    """
    parameters = request_from_file(asked, product) if isinstance(asked, Path) else asked
    parameters = parameters.model_copy(update=dict(changes or {}))
    ground = reading.read(dem, getattr(parameters, "area", None), margin_m) if isinstance(dem, str) else dem
    grid = covered(ground, parameters)
    parameters, of_datum = in_dem_datum(grid, parameters)
    told = (*of_datum, *told, *notes_on_unused(grid, parameters))
    if on is not None and on.map_ground not in (None, grid.digest):
        told = (*told, OTHER_GROUND)
    layers = tuple(
        layer
        for layer in product.layers
        if layer.name not in left_out and not layer.for_screens and layer.is_of(dict(parameters))
    )
    names = (summary, *(layer.name for layer in layers))
    folder = None if output.out is None else output_folder(output.out, names)
    with progress_bar(what) as progress:
        finished = _calculated(product, grid, parameters, replace(work or Work(), progress=progress))
    answer: Any = finished.answer
    answer = answer.model_copy(update={"warnings": list(dict.fromkeys((*answer.warnings, *told)))})
    document = answer.model_dump(mode="json")
    written = [] if folder is None else _write_files(finished, document, summary, layers, folder)
    if output.as_json:
        print_json({**document, "files": [str(path) for path in written]})
        return
    print_tables(*tables(answer))
    print_notes(_how_far_to_trust(answer.error_statement, document.get("mode", dict(parameters).get("mode"))))
    print_warnings(answer.warnings)
    for path in written:
        print(path)


def request_of_fields(fields: Mapping[str, object], kind: type[Model]) -> Model:
    """The request that options make. Raises RequestError."""
    try:
        return kind.model_validate(fields)
    except ValidationError as error:
        raise RequestError(sentence_of(error)) from error


def request_from_file(file: Path, product: Product, on: Given | None = None) -> BaseModel:
    """The parameters that the request in a file makes, which is as it would be sent over HTTP. Raises RequestError.

    One rule for all products: what it names of a service (its DEM, a detector session and, where ``on`` gives one, a
    map) has no meaning here. It is passed over for what the command line gives, and that is told on standard error.
    """
    document = _document(file, "request")
    for name in sorted(product.asked.model_fields.keys() - product.parameters.model_fields.keys()):
        if document.get(name) is not None and (name != "map_id" or on is not None):
            del document[name]
            _tell(f"The request {file.name} names a {name} of a service; it is passed over for the command line's.")
    document["dem_id"] = OF_THE_COMMAND_LINE
    if on is not None:
        document["map_id"] = OF_THE_COMMAND_LINE
    try:
        asked = product.asked.model_validate_json(json.dumps(document))
        needed = product.needs(asked)
        if on is None and needed is not None and needed.map_id is not None:
            raise RequestError(
                f"The request {file.name} names a map of a service by its map_id; give its file with --map."
            )
        for note in notes_on_older_names(asked):
            _tell(f"The request {file.name}: {note}")
        parameters: BaseModel = product.completed(asked, on or Given())
    except ValidationError as error:
        sentence = sentence_of(error) if on is None else sentence_of(error).replace("map_id", "--map")
        raise RequestError(f"The request {file.name}: {sentence}") from error
    return parameters


def completed(product: Product, asked: BaseModel, on: Given | None, map_file: Path | None) -> BaseModel:
    """The parameters that options make, with what the map of a file gives. Raises RequestError."""
    try:
        parameters: BaseModel = product.completed(asked, on or Given())
    except ValidationError as error:
        raise RequestError(sentence_of(error)) from error
    except RequestError as error:
        if map_file is None:
            raise
        raise RequestError(f"The map {map_file.name}: {error}") from error
    return parameters


def given_map(file: Path, kinds: Collection[str] = MAP_KINDS) -> Given:
    """The kind and the parameters of a map that a command wrote, from its summary. Raises RequestError."""
    summary = _document(file, "map")
    try:
        kind = kind_of_summary(summary)
    except RequestError:
        kind = ""
    if kind not in kinds:
        *names, last = [FILES_OF_MAPS[one] for one in kinds]
        told = f"{', '.join(names)} or {last}" if names else last
        raise RequestError(f"The map {file.name}: it is no {told} that Sightline wrote.")
    parameters = summary["parameters"]
    assert isinstance(parameters, dict), "kind_of_summary has looked"
    ground = summary.get("dem")
    digest = ground.get("sha256") if isinstance(ground, dict) else None
    return Given(map_kind=kind, map_parameters=parameters, map_ground=digest if isinstance(digest, str) else None)


def _calculated(product: Product, grid: ElevationGrid, parameters: BaseModel, work: Work) -> Finished:
    if product.unpack is None:
        return product.calculate(grid, parameters, work)
    # as the service hands it to a worker
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder:
        inputs = Path(folder) / "inputs"
        return product.calculate(grid, product.unpacked(product.pack(grid, parameters, inputs), inputs), work)


def _how_far_to_trust(statement: str | None, mode: JsonValue) -> list[str]:
    """What the answer may be off by; exact sight lines are not, and a search that is fast may answer exactly."""
    if mode in (None, "exact") or not statement or statement == ERROR_STATEMENT:
        return []
    if mode == "fast" and statement != SIGNAL_ERROR:
        return [f"Mode fast: {statement}. Where an altitude or a single post decides, take --mode exact."]
    return [f"{statement[0].upper()}{statement[1:]}."]


def _write_files(
    finished: Finished, document: Mapping[str, JsonValue], summary: str, layers: tuple[Layer, ...], folder: Path
) -> list[Path]:
    """Every file whole or not at all; the summary comes last, so where it is new all is new."""
    written = [layer for layer in layers if layer.is_in(document)]
    names = (summary, *(layer.name for layer in written))
    with leaving_nothing_new(folder, names):
        for name in {layer.name for layer in layers}.difference(names):
            # of a run before; it would be taken for this one's
            (folder / name).unlink(missing_ok=True)
        for layer in written:
            layer.save(finished, folder / layer.name)
        with replacing(folder / summary) as unfinished:
            unfinished.write_text(json.dumps(document, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / name for name in names]


def _document(file: Path, what: str) -> dict[str, JsonValue]:
    try:
        document = json.loads(file.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RequestError(f"The {what} {file.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The {what} {str(file)!r} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise RequestError(f"The {what} {file.name} is not JSON: {error}.") from error
    if not isinstance(document, dict):
        raise RequestError(f"The {what} {file.name} holds no JSON object.")
    return document


def _tell(sentence: str) -> None:
    print(f"Warning: {sentence}", file=sys.stderr)
