"""From a DEM and what is asked to files: the way that every map command goes."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from rich.table import Table

from service.errors import RequestError
from service.files.layer import Layer
from service.files.replacing import replacing
from service.parts.anchors import AnchorIn
from service.products.product import Finished, Product, Work

from .anchor_files import anchors_from_file
from .anchor_texts import anchor_from_text
from .grounds import read_ground
from .height_words import told_of_heights
from .output import print_json, print_tables, print_warnings, progress_bar

__all__ = ["anchors_of", "leaving_nothing_new", "make_map", "output_folder"]

# each command leaves one; they tell a folder of results from one of somebody's own files
SUMMARIES = (
    *("visibility.json", "dop.json", "morph.json", "bubble.json", "path.json", "flight.json"),
    *("place.json", "reposition.json", "detection.json"),
)


def anchors_of(texts: list[str], files: list[Path], *, lonlat: bool) -> list[AnchorIn]:
    """The anchors of all --anchor and --anchors options. Raises RequestError."""
    anchors = [anchor_from_text(text, lonlat=lonlat) for text in texts]
    return anchors + [anchor for path in files for anchor in anchors_from_file(path)]


def make_map(
    dem: str,
    product: Product,
    asked: BaseModel,
    tables: Callable[[Any], tuple[Table, ...]],
    *,
    summary: str,
    reading: dict[str, Any],
    heights: frozenset[str],
    out: Path | None,
    as_json: bool,
    left_out: Collection[str] = (),
    what: str = "Sight lines",
    work: Work | None = None,
    margin_m: float | None = None,
) -> None:
    """Read, calculate, write into ``out`` and print. What can be wrong in the request is found before the work.

    tables: of the answer. summary: the file of the answer. left_out: layers that are not written. heights: the words
    with which the options' heights were given. work: what the calculation may use; its progress is shown here.
    margin_m: how far around the area ground is read; None: of one file all, of tiles none.
    """
    grid = read_ground(dem, reading, getattr(asked, "area", None), margin_m)
    told = told_of_heights(grid, heights)
    layers = tuple(
        layer
        for layer in product.layers
        if layer.name not in left_out and not layer.for_screens and layer.is_of(dict(asked))
    )
    folder = None if out is None else output_folder(out, (summary, *(layer.name for layer in layers)))
    with progress_bar(what) as progress:
        finished = product.calculate(grid, asked, replace(work or Work(), progress=progress))
    answer: Any = finished.answer
    answer = answer.model_copy(update={"warnings": [*answer.warnings, *told]})
    document = answer.model_dump(mode="json")
    written = [] if folder is None else _write_files(finished, document, summary, layers, folder)
    if as_json:
        print_json({**document, "files": [str(path) for path in written]})
        return
    print_tables(*tables(answer))
    print_warnings(answer.warnings)
    for path in written:
        print(path)


def output_folder(out: Path, names: Iterable[str]) -> Path:
    """The folder, made if need be, for files of these names.

    Raises RequestError where it cannot be one, where nothing can be put into it, and where a file would be replaced
    that is an input of this command, or lies in a folder that no command of ours has written into.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RequestError(f"The output folder {str(out)!r} cannot be made: {error.strerror}.") from error
    if not os.access(out, os.W_OK | os.X_OK):
        raise RequestError(f"The output folder {str(out)!r} cannot be written into; name another with --out.")
    there = [out / name for name in names if (out / name).is_file()]
    # whatever the option is called: a word of the command line that names such a file is read from
    words = {Path(word.partition("=")[2] or word).absolute() for word in sys.argv[1:]}
    for path in there:
        if path.absolute() in words:
            raise RequestError(f"{path} is read by this command and would be overwritten; name another --out.")
    if there and not any(_is_summary(out / name) for name in SUMMARIES):
        raise RequestError(
            f"{there[0]} is there already and was not written by Sightline; move it away or name another --out."
        )
    return out


@contextmanager
def leaving_nothing_new(folder: Path, names: Iterable[str]) -> Iterator[None]:
    """When the block fails or is stopped, the files that were not there before it are removed."""
    new = [folder / name for name in names if not (folder / name).exists()]
    try:
        yield
    except BaseException:
        for path in new:
            path.unlink(missing_ok=True)
        raise


def _is_summary(path: Path) -> bool:
    """Whether a command of ours wrote it."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(told, dict) and isinstance(told.get("version"), str)


def _write_files(
    finished: Finished, document: Mapping[str, Any], summary: str, layers: tuple[Layer, ...], folder: Path
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
