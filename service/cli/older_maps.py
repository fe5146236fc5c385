"""The way of map commands whose products do not answer typed yet."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from rich.table import Table

from service.files.replacing import replacing
from terrain import ElevationGrid, read_dem

from .height_words import told_of_heights
from .maps import leaving_nothing_new, output_folder
from .output import print_json, print_tables, print_warnings, progress_bar

__all__ = ["MapFiles", "make_map"]

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


def _write_files(finished: Any, summary: dict[str, Any], files: MapFiles, folder: Path) -> list[Path]:
    """Every file whole or not at all; the summary comes last, so where it is new all is new."""
    layers, write = files.layers, files.write
    assert write is not None
    with leaving_nothing_new(folder, (files.summary, *layers)):
        for name in set(files.layers).difference(layers):
            # of a run before; it would be taken for this one's
            (folder / name).unlink(missing_ok=True)
        for name in layers:
            write(finished, name, folder / name)
        with replacing(folder / files.summary) as unfinished:
            unfinished.write_text(json.dumps(summary, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / name for name in (files.summary, *layers)]
