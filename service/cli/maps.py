"""From a DEM and what is asked to files: the way that every map command goes."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from rich.table import Table

from service.errors import RequestError
from service.replacing import replacing
from service.schemas import AnchorIn
from terrain import ElevationGrid, read_dem

from .anchor_files import anchors_from_file
from .anchor_texts import anchor_from_text
from .height_words import told_of_heights
from .output import print_json, print_tables, print_warnings, progress_bar

__all__ = ["MapFiles", "anchors_of", "make_map", "output_folder"]

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
    folder = None if out is None else output_folder(out)
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


def output_folder(out: Path) -> Path:
    """The folder, made if need be. Raises RequestError where it cannot be one, or nothing can be put into it."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RequestError(f"The output folder {str(out)!r} cannot be made: {error.strerror}.") from error
    if not os.access(out, os.W_OK | os.X_OK):
        raise RequestError(f"The output folder {str(out)!r} cannot be written into; name another with --out.")
    return out


def _write_files(finished: Any, summary: dict[str, Any], files: MapFiles, folder: Path) -> list[Path]:
    """Every file whole or not at all; the summary comes last, so where it is new all is new."""
    from service.layers import LAYERS, write_layer
    from service.products import product_of

    layers, write = files.layers, files.write
    if write is None:
        write, offered = write_layer, LAYERS[product_of(finished).name]
        layers = tuple(name for name in layers if offered[name].is_in(summary))
    for name in set(files.layers).difference(layers):
        # of a run before; it would be taken for this one's
        (folder / name).unlink(missing_ok=True)
    for name in layers:
        write(finished, name, folder / name)
    with replacing(folder / files.summary) as unfinished:
        unfinished.write_text(json.dumps(summary, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / name for name in (files.summary, *layers)]
