"""Where a data folder has its store: in its own file of SQLite, or in PostgreSQL; copies of either are files."""

from __future__ import annotations

import os
import shutil
import tempfile
import uuid
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from service.database import READ, Connection, Database
from service.database.postgres import PostgresDatabase
from service.database.sqlite import SqliteDatabase
from service.errors import DataFolderError, RequestError
from service.settings import Settings

from .folder import make_durable
from .marker import ELSEWHERE, STORE, Quarantine
from .store_file import SIDE_FILES, rewrite, settle, snapshot

__all__ = ["StorePlace"]


@dataclass(frozen=True, slots=True)
class StorePlace:
    """The store of a data folder; url: of a database of PostgreSQL, None for the folder's own file."""

    root: Path
    url: str | None = None

    @classmethod
    def of(cls, settings: Settings, root: Path | None = None) -> StorePlace:
        """The store of the settings' data folder, or of another."""
        url = settings.database_url
        return cls((root or settings.data_folder).absolute(), None if url is None else url.get_secret_value())

    @property
    def file(self) -> Path:
        """The file of SQLite, where it is one."""
        return self.root / STORE

    def open(self) -> Database:
        """Its tables, brought up to date, and made where there are none.

        Raises DataFolderError, also when the folder's store is kept the other way.
        """
        self._refuse_the_other()
        return SqliteDatabase(self.file) if self.url is None else self._server()

    @contextmanager
    def as_file(self) -> Iterator[Path]:
        """A file of SQLite that says what the store says now. Raises DataFolderError."""
        if self.url is not None:
            self.check_there()
        self._refuse_the_other()
        with self._copy_of_server() if self.url is not None else nullcontext(self.file) as file:
            yield file

    def check_there(self) -> None:
        """Raises DataFolderError where the folder has no store, or keeps it the other way."""
        self._refuse_the_other()
        if not (self.file if self.url is None else self._elsewhere).is_file():
            raise DataFolderError(f"The data folder {self.root} has no store, so there is nothing to read.")

    def snapshot(self, target: Path) -> None:
        """Write what the store says at one moment into a new file, also while a service works with it.

        Raises DataFolderError.
        """
        self.check_there()
        if self.url is None:
            snapshot(self.file, target)
        else:
            self._snapshot_server(target)

    def replace(self, new: Path, quarantine: Quarantine) -> None:
        """Put what a file says in the store's place; what was there is in quarantine before. The file may be changed.

        From then on the store is kept as this place says. Raises DataFolderError, OSError.
        """
        if self.file.is_file():
            settle(self.file)
            # of a store that is damaged all its files
            for path in (self.file, *self._side_files):
                if path.is_file():
                    shutil.copyfile(path, quarantine.room_for("store", path.name))
            make_durable(quarantine.place)
        if self.url is None:
            self._replace_file(new)
            self._elsewhere.unlink(missing_ok=True)
            return
        if self._elsewhere.is_file():
            with self._copy_of_server() as copy:
                shutil.copyfile(copy, quarantine.room_for("store", STORE))
            make_durable(quarantine.place)
        SqliteDatabase(new).close()  # of an older version
        with (
            closing(self._server()) as server,
            closing(SqliteDatabase(new)) as file,
            file.transaction(READ) as said,
            server.transaction() as copy,
        ):
            for table, columns in _tables(said):
                copy.execute(f"DELETE FROM {table}")
                rows = said.execute(f"SELECT {', '.join(columns)} FROM {table}")
                copy.executemany(_insert(table, columns), (tuple(row) for row in rows))
        for path in (self.file, *self._side_files):
            path.unlink(missing_ok=True)

    def vacuum(self) -> tuple[int, int]:
        """Write the file anew without what was deleted; its bytes before and after. Raises DataFolderError."""
        self._refuse_the_other()
        if self.url is not None:
            raise RequestError(
                "The store is in PostgreSQL, which vacuums by itself; VACUUM FULL there gives room back to the disk."
            )
        return rewrite(self.file)

    @property
    def _elsewhere(self) -> Path:
        return self.root / ELSEWHERE

    @property
    def _side_files(self) -> list[Path]:
        return [self.file.with_name(f"{STORE}{suffix}") for suffix in SIDE_FILES]

    def _id(self) -> str:
        return self._elsewhere.read_text(encoding="ascii").strip()

    def _refuse_the_other(self) -> None:
        if self.url is None and self._elsewhere.exists():
            raise DataFolderError(
                f"The data folder {self.root} has its store in PostgreSQL; say where (SIGHTLINE_DATABASE_URL), or put "
                "a backup into it with `sightline store restore`."
            )
        if self.url is not None and self.file.exists():
            raise DataFolderError(
                f"The data folder {self.root} has its store in {STORE}; `sightline store restore` of a backup moves it "
                "into PostgreSQL, or leave SIGHTLINE_DATABASE_URL out."
            )

    @contextmanager
    def _copy_of_server(self) -> Iterator[Path]:
        with tempfile.TemporaryDirectory(prefix="sightline-store-") as place:
            self._snapshot_server(Path(place) / STORE)
            yield Path(place) / STORE

    def _snapshot_server(self, target: Path) -> None:
        with (
            closing(PostgresDatabase(str(self.url), self._id(), as_it_is=True)) as server,
            closing(SqliteDatabase(target)) as file,
            server.transaction(READ) as said,
            file.transaction() as copy,
        ):
            for table, columns in _tables(copy):
                for rows in said.pages(f"SELECT {', '.join(columns)} FROM {table}"):
                    copy.executemany(_insert(table, columns), rows)
        settle(target)

    def _server(self) -> PostgresDatabase:
        new = not self._elsewhere.exists()
        if new:  # first here: a database that has an id which no folder knows could never be used
            self._elsewhere.write_text(f"{uuid.uuid4().hex}\n", encoding="ascii")
        try:
            return PostgresDatabase(str(self.url), self._id())
        except BaseException:
            if new:
                self._elsewhere.unlink()
            raise

    def _replace_file(self, new: Path) -> None:
        work = self.root / "work" / uuid.uuid4().hex
        work.mkdir()
        shutil.copyfile(new, work / STORE)
        make_durable(work)
        for path in self._side_files:
            path.unlink(missing_ok=True)
        (work / STORE).replace(self.file)
        descriptor = os.open(self.root, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        work.rmdir()


def _tables(file: Connection) -> list[tuple[str, list[str]]]:
    """Tables of the store's schema, each with its columns."""
    tables = file.execute("SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%'").fetchall()
    return [(table, [row["name"] for row in file.execute(f"PRAGMA table_info({table})")]) for (table,) in tables]


def _insert(table: str, columns: Sequence[str]) -> str:
    return f"INSERT INTO {table} ({', '.join(columns)}) VALUES ({', '.join('?' * len(columns))})"
