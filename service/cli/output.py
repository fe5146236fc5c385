"""What commands print: tables for people, JSON for programs, progress on stderr."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

__all__ = ["facts_table", "print_json", "print_tables", "print_warnings", "progress_bar", "share_text"]

NO_TERMINAL_WIDTH = 110


def print_json(document: Any) -> None:
    """The document on stdout, and nothing else; NaN has no place in JSON and is a fault here."""
    print(json.dumps(document, allow_nan=False, indent=1))


def print_tables(*tables: Table) -> None:
    """Tables on stdout, as wide as the terminal."""
    console = _stdout()
    for table in tables:
        console.print(table)


def print_warnings(warnings: list[str]) -> None:
    """Each warning as one line on stdout, under the tables that it qualifies."""
    console = _stdout()
    for warning in warnings:
        console.print(f"[bold yellow]Warning:[/] {escape(warning)}", soft_wrap=True, highlight=False)


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
