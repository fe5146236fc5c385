"""What commands print: tables for people, JSON for programs, progress on stderr; and the folders they write into."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from service.errors import RequestError

from .asking.spoken import spoken

__all__ = [
    "facts_table",
    "leaving_nothing_new",
    "output_folder",
    "print_json",
    "print_notes",
    "print_tables",
    "print_warnings",
    "progress_bar",
    "share_text",
]

NO_TERMINAL_WIDTH = 110
# each command leaves one; they tell a folder of results from one of somebody's own files
SUMMARIES = (
    *("visibility.json", "dop.json", "morph.json", "bubble.json", "path.json", "flight.json", "lines_of_sight.json"),
    *("place.json", "reposition.json", "detection.json"),
)


def print_json(document: Mapping[str, object]) -> None:
    """The document on stdout, and nothing else; NaN has no place in JSON and is a fault here."""
    print(json.dumps(document, allow_nan=False, indent=1))


def print_tables(*tables: Table) -> None:
    """Tables on stdout, as wide as the terminal."""
    console = _stdout()
    for table in tables:
        console.print(table)


def print_notes(notes: list[str]) -> None:
    """Each as one line on stdout, under the tables that it qualifies."""
    console = _stdout()
    for note in notes:
        console.print(escape(note), soft_wrap=True, highlight=False)


def print_warnings(warnings: list[str]) -> None:
    """Each warning as one line on stdout, in this command line's words, under the tables that it qualifies."""
    console = _stdout()
    for warning in warnings:
        console.print(f"[bold yellow]Warning:[/] {escape(spoken(warning))}", soft_wrap=True, highlight=False)


def _stdout() -> Console:
    """Standard output; where it is no terminal its width is not known, and nothing shall be cut for that."""
    console = Console()
    return console if console.is_terminal else Console(width=NO_TERMINAL_WIDTH)


def facts_table(title: str, facts: list[tuple[str, str]]) -> Table:
    """Two columns: what, and its value."""
    table = Table(title=escape(title), title_justify="left", show_header=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in facts:
        table.add_row(name, escape(value))
    return table


def share_text(share: float | None) -> str:
    """A share as a percentage."""
    return "–" if share is None else f"{100.0 * share:.1f} %"


@contextmanager
def progress_bar(what: str, console: Console | None = None) -> Iterator[Callable[[float], None]]:
    """A function that shows the finished share 0..1 as a bar on stderr; silent where stderr is no terminal."""
    console = console or Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda share: bar.update(task, completed=share)


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
    names = tuple(names)
    there = [out / name for name in names if (out / name).is_file()]
    # whatever the option is called: a word of the command line that names such a file is read from
    words = {Path(word.partition("=")[2] or word).absolute() for word in sys.argv[1:]}
    for path in there:
        if path.absolute() in words:
            raise RequestError(f"{path} is read by this command and would be overwritten; name another --out.")
    if there and not any(_is_summary(out / name) for name in {*SUMMARIES, *names}):
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
    """Whether it is the summary of a command."""
    if path.suffix != ".json":
        return False
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(told, dict) and isinstance(told.get("version"), str)
