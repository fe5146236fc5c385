"""Where the store keeps its tables: one interface, and a database for each kind of server behind it."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from service.errors import DataFolderError, StorageFullError, StoreLockedError

__all__ = ["READ", "TROUBLE", "WRITE", "Begin", "Connection", "Cursor", "Database", "Place", "Row"]

# how a transaction begins: one that only reads holds up nobody
Begin = Literal["BEGIN", "BEGIN IMMEDIATE"]
READ: Begin = "BEGIN"
WRITE: Begin = "BEGIN IMMEDIATE"
# what passes: a store that is full, held, or away, and can be written again later
TROUBLE = (sqlite3.OperationalError, OSError, DataFolderError, StoreLockedError, StorageFullError)
# a value of a column; by number or by name
Row = Any


@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands in lists, which are newest first and by id within the same moment.

    number: the moment, seconds since 1970 UTC, or the number of a version.
    """

    number: float
    id: str

    def condition(self, number: str, id: str = "id") -> tuple[str, tuple[float | str, ...]]:
        """What rows behind it meet, and its values. number, id: the columns that the list is in the order of."""
        # the first half leads into the index
        return f"{number} <= ? AND ({number} < ? OR {id} > ?)", (self.number, self.number, self.id)


class Cursor(Protocol):
    """What comes of a statement."""

    @property
    def rowcount(self) -> int:
        """Rows that were changed."""
        ...

    def fetchone(self) -> Row:
        """The next row, or None."""
        ...

    def fetchall(self) -> list[Row]:
        """All rows that are left."""
        ...

    def __iter__(self) -> Iterator[Row]: ...


class Connection(Protocol):
    """An open transaction. Statements have ``?`` for each value."""

    def execute(self, sql: str, parameters: Sequence[Any] = ..., /) -> Cursor:
        """Do one statement."""
        ...

    def executemany(self, sql: str, parameters: Iterable[Sequence[Any]], /) -> Cursor:
        """Do one statement for many rows of values."""
        ...


class Database(Protocol):
    """Tables of the store. Safe to use from any thread; one transaction writes at a time, and one reads beside it."""

    @property
    def size_bytes(self) -> int:
        """What it takes on its disk, as far as is known."""
        ...

    def transaction(self, begin: Begin = WRITE) -> AbstractContextManager[Connection]:
        """All or nothing. Raises DataFolderError where the database is not the one that was opened, or is gone."""
        ...

    def check_writable(self) -> None:
        """Raises what a write would."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...
