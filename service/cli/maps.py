"""From a DEM and what is asked to files: the way that every map command goes."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from rich.table import Table

from service.errors import RequestError
from service.files.replacing import replacing
from service.parts.anchors import AnchorIn
from terrain import ElevationGrid, read_dem

from .anchor_files import anchors_from_file
from .anchor_texts import anchor_from_text
from .height_words import told_of_heights
from .output import print_json, print_tables, print_warnings, progress_bar

__all__ = ["MapFiles", "anchors_of", "leaving_nothing_new", "make_map", "output_folder"]

# each command leaves one; they tell a folder of results from one of somebody's own files
SUMMARIES = (
    *("visibility.json", "dop.json", "morph.json", "bubble.json", "path.json", "flight.json"),
    *("place.json", "reposition.json", "detection.json"),
)

Asked = TypeVar("Asked")


class Finished(Protocol):
    """What can be told in numbers once it is calculated."""

    def summary(self) -> dict[str, Any]:
        """Ready for JSON."""
        ...


@dataclass(frozen=True, slots=True)
class MapFiles:
    """What a command writes: the name of the summary, and layers by name; write: their writer, where it is no map's."""

    summary: str
    layers: tuple[str, ...]
    write: Callable[[Any, str, Path], None] | None = None


def anchors_of(texts: list[str], files: list[Path], *, lonlat: bool) -> list[AnchorIn]:
    """The anchors of all --anchor and --anchors options. Raises RequestError."""
    anchors = [anchor_from_text(text, lonlat=lonlat) for text in texts]
    return anchors + [anchor for path in files for anchor in anchors_from_file(path)]


def make_map(
    dem: str,
    parameters: Asked,
    calculate: Callable[[ElevationGrid, Asked, Callable[[float], None] | None], Finished],
    files: MapFiles,
    tables: Callable[[dict[str, Any]], tuple[Table, ...]],
    *,
    reading: dict[str, Any],
    heights: frozenset[str],
    out: Path | None,
    as_json: bool,
    what: str = "Sight lines",
) -> None:
    """Read, calculate, write into ``out`` and print. What can be wrong in the request is found before the work.

    heights: the words with which the options' heights were given.
    """
    grid = read_dem(dem, **reading)
    told = told_of_heights(grid, heights)
    folder = None if out is None else output_folder(out, (files.summary, *files.layers))
    with progress_bar(what) as progress:
        finished = calculate(grid, parameters, progress)
    summary = finished.summary()
    summary["warnings"] = [*summary["warnings"], *told]
    written = [] if folder is None else _write_files(finished, summary, files, folder)
    if as_json:
        print_json({**summary, "files": [str(path) for path in written]})
        return
    print_tables(*tables(summary))
    print_warnings(summary["warnings"])
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


def _write_files(finished: Any, summary: dict[str, Any], files: MapFiles, folder: Path) -> list[Path]:
    """Every file whole or not at all; the summary comes last, so where it is new all is new."""
    from service.products.layers import LAYERS, write_layer
    from service.products.registry import product_of

    layers, write = files.layers, files.write
    if write is None:
        write, offered = write_layer, LAYERS[product_of(finished).name]
        layers = tuple(name for name in layers if offered[name].is_in(summary))
    with leaving_nothing_new(folder, (files.summary, *layers)):
        for name in set(files.layers).difference(layers):
            # of a run before; it would be taken for this one's
            (folder / name).unlink(missing_ok=True)
        for name in layers:
            write(finished, name, folder / name)
        with replacing(folder / files.summary) as unfinished:
            unfinished.write_text(json.dumps(summary, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / name for name in (files.summary, *layers)]
