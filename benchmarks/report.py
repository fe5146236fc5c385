"""Tables of measurements: what was measured, the target, and whether it was met."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

__all__ = ["Row", "Table", "as_markdown", "as_text", "duration", "missed"]


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement: its cells in the table's columns, the target in words, and whether it was met (None: none)."""

    cells: tuple[str, ...]
    target: str = ""
    met: bool | None = None

    @property
    def verdict(self) -> str:
        return "" if self.met is None else "met" if self.met else "**missed**"


@dataclass(frozen=True, slots=True)
class Table:
    """A titled table; ``note`` says how its numbers come about."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[Row] = field(default_factory=tuple)
    note: str = ""

    @property
    def headings(self) -> tuple[str, ...]:
        return (*self.columns, "target", "verdict")

    def lines(self) -> list[tuple[str, ...]]:
        return [(*row.cells, row.target, row.verdict) for row in self.rows]


def as_markdown(table: Table) -> str:
    head = f"| {' | '.join(table.headings)} |\n|{' --- |' * len(table.headings)}"
    body = "\n".join(f"| {' | '.join(line)} |" for line in table.lines())
    note = f"{table.note}\n\n" if table.note else ""
    return f"## {table.title}\n\n{note}{head}\n{body}\n"


def as_text(table: Table) -> str:
    lines = [table.headings, *table.lines()]
    widths = [max(len(line[column]) for line in lines) for column in range(len(table.headings))]
    body = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]
    return "\n".join([table.title, "-" * len(table.title), *body, ""])


def missed(tables: Iterable[Table]) -> list[str]:
    """The rows whose target was missed, each as one line."""
    return [
        f"{table.title}: {' | '.join(row.cells)} (target {row.target})"
        for table in tables
        for row in table.rows
        if row.met is False
    ]


def duration(seconds: float) -> str:
    """A time with three significant digits and the unit that suits it."""
    if seconds < 1e-3:
        return f"{seconds * 1e6:.3g} µs"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"
