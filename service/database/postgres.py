"""The store's tables in a database of PostgreSQL: a connection that writes, one writer of all, and one that reads."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from service.database.migrations import SCHEMA_VERSION, STEPS, refuse_newer
from service.errors import DataFolderError, ServiceError, StorageFullError, StoreLockedError, StoreServerError

from . import READ, WRITE, Begin, Cursor, Row

if TYPE_CHECKING:
    import psycopg

__all__ = ["PostgresDatabase", "of_postgres"]

# transactions that write take their turns, as those of SQLite do
BEGIN_TO_WRITE = "BEGIN; SELECT pg_advisory_xact_lock(6011732)"
BEGIN_TO_READ = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY"
# a server that is cut off is noticed within seconds, not within hours; a lock is waited for as long as one of SQLite
PATIENCE = {"connect_timeout": "5", "tcp_user_timeout": "10000", "keepalives_idle": "10", "keepalives_interval": "5"}
LOCK_TIMEOUT = "SET lock_timeout = '5s'"
# beside the tables of the steps: the version of the schema, whose store it is, and a function of SQLite's name for the
# same, which passes over what no text of PostgreSQL can hold
OURS = r"""
    CREATE TABLE sightline_store (version BIGINT NOT NULL, folder TEXT NOT NULL);
    CREATE FUNCTION json_extract(document TEXT, path TEXT) RETURNS TEXT IMMUTABLE STRICT LANGUAGE SQL AS $$
        SELECT trim('"' FROM (CASE WHEN strpos(document, '\u0000') = 0 THEN document
        ELSE regexp_replace(document, '(?<!\\)((\\\\)*)\\u0000', '\1', 'g') END::json -> substr(path, 3))::text)
    $$;
"""
IS_OURS = "SELECT 1 FROM pg_tables WHERE schemaname = current_schema() AND tablename = 'sightline_store'"
ROWS_AT_ONCE = 500


def of_postgres(step: str) -> str:
    """A step of the schema in PostgreSQL's words: numbers of the same widths, ids in the same order."""
    words = {"REAL": "DOUBLE PRECISION", "INTEGER": "BIGINT", "TEXT": 'TEXT COLLATE "C"'}
    words |= {") STRICT, WITHOUT ROWID": ")", ") STRICT": ")"}
    pattern = r"\) STRICT(?:, WITHOUT ROWID)?|\b(?:REAL|INTEGER|TEXT)\b"
    return re.sub(pattern, lambda found: words[found[0]], step)


class _Row(tuple[Any, ...]):
    """Values by number or by name; ``dict`` makes a dictionary of it."""

    names: dict[str, int]

    def __getitem__(self, key: Any) -> Any:
        return super().__getitem__(self.names[key] if isinstance(key, str) else key)

    def keys(self) -> Iterable[str]:
        """Names of the columns."""
        return self.names.keys()


def _rows(cursor: psycopg.Cursor[Any]) -> Any:
    names = {column.name: number for number, column in enumerate(cursor.description or ())}
    return type("_Row", (_Row,), {"names": names})


class _Statements:
    """Statements of an open transaction, which have ``?`` for each value."""

    def __init__(self, connection: psycopg.Connection[Any]) -> None:
        self._connection = connection

    def execute(self, sql: str, parameters: Sequence[Any] = (), /) -> Cursor:
        """Do one statement."""
        return self._connection.execute(_with_its_marks(sql), _storable(parameters))

    def pages(self, sql: str) -> Iterator[list[Row]]:
        """What a statement without values finds, some rows at a time, however many they are."""
        with self._connection.cursor(name="pages") as cursor:
            cursor.execute(_with_its_marks(sql))
            while rows := cursor.fetchmany(ROWS_AT_ONCE):
                yield rows

    def executemany(self, sql: str, parameters: Iterable[Sequence[Any]], /) -> Cursor:
        """Do one statement for many rows of values."""
        cursor = self._connection.cursor()
        cursor.executemany(_with_its_marks(sql), map(_storable, parameters))
        return cursor


class _Line:
    """A connection once there is one, and whose turn it is to use it."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.connection: psycopg.Connection[Any] | None = None

    def let_go(self) -> None:
        """Close it."""
        if self.connection is not None:
            self.connection.close()
            self.connection = None


class PostgresDatabase:
    """A database of a PostgreSQL server, reached again when it was away.

    url: ``postgresql://user@host/database``, or another connection string of libpq. folder: id of the data folder
    whose store it is; a new database takes it. as_it_is: to be read alone, so nothing is made or migrated. Raises
    StoreServerError when it cannot be reached, DataFolderError when it is another folder's or of another version,
    StoreLockedError and StorageFullError as the server says.
    """

    def __init__(self, url: str, folder: str, *, as_it_is: bool = False) -> None:
        try:
            import psycopg
        except ImportError as error:
            raise StoreServerError(
                "SIGHTLINE_DATABASE_URL needs the package psycopg: pip install 'sightline[postgres]'."
            ) from error
        self._psycopg = psycopg
        self._url = url
        self._folder = folder
        self._lines = {WRITE: _Line(), READ: _Line()}
        self._size_bytes = 0
        try:
            if as_it_is:
                with self.transaction(READ) as statements:
                    self._refuse_older(statements)
            else:
                with self.transaction() as statements:
                    self._migrate(statements)
                self.check_writable()
        except BaseException:
            self.close()
            raise

    @property
    def size_bytes(self) -> int:
        """What the database took when it was last looked at."""
        return self._size_bytes

    def close(self) -> None:
        """Let go of the server."""
        for line in self._lines.values():
            with line.lock:
                line.let_go()

    def check_writable(self) -> None:
        """Raises what a write would; measures the database meanwhile."""
        with self.transaction() as statements:
            statements.execute("UPDATE sightline_store SET version = version")
            self._size_bytes = int(statements.execute("SELECT pg_database_size(current_database())").fetchone()[0])

    @contextmanager
    def transaction(self, begin: Begin = WRITE) -> Iterator[_Statements]:
        """All or nothing. One that writes waits until no other does, also of another program."""
        line = self._lines[begin]
        with line.lock:
            try:
                connection = self._begun(line, begin)
                try:
                    yield _Statements(connection)
                    connection.execute("COMMIT")
                finally:
                    self._roll_back(connection)
            except self._psycopg.Error as error:
                told = self._told(error, line)
                if told is None:
                    raise
                raise told from error

    def _begun(self, line: _Line, begin: Begin) -> psycopg.Connection[Any]:
        words = BEGIN_TO_READ if begin == READ else BEGIN_TO_WRITE
        if line.connection is not None and not line.connection.closed:
            try:
                line.connection.execute(words)
            except self._psycopg.OperationalError:
                if not line.connection.broken:
                    self._roll_back(line.connection)
                    raise
            else:
                return line.connection
        # the server was started anew; nothing of this transaction was done yet
        line.let_go()
        line.connection = connection = self._connected()
        connection.execute(words)
        return connection

    def _connected(self) -> psycopg.Connection[Any]:
        try:
            given = self._psycopg.conninfo.conninfo_to_dict(self._url)
        except self._psycopg.ProgrammingError:  # its words hold what was given, a password too
            raise StoreServerError(
                "SIGHTLINE_DATABASE_URL is no connection string of PostgreSQL; one is postgresql://user@host/database."
            ) from None
        more = {name: value for name, value in PATIENCE.items() if name not in given}
        whole = self._psycopg.conninfo.make_conninfo(self._url, **more)
        connection = self._psycopg.connect(whole, autocommit=True, row_factory=_rows)
        try:
            connection.execute(LOCK_TIMEOUT)
            if connection.execute(IS_OURS).fetchone() is not None:
                ((version, folder),) = connection.execute("SELECT version, folder FROM sightline_store").fetchall()
                refuse_newer(version, "The store in PostgreSQL")
                if folder != self._folder:
                    raise DataFolderError(
                        "The store in PostgreSQL is that of another data folder; name that folder, or another database "
                        "(SIGHTLINE_DATABASE_URL)."
                    )
        except BaseException:
            connection.close()
            raise
        return connection

    def _migrate(self, statements: _Statements) -> None:
        """Bring the schema up to this version, in the transaction that is open."""
        if statements.execute(IS_OURS).fetchone() is None:
            statements._connection.execute(OURS)
            statements.execute("INSERT INTO sightline_store VALUES (0, ?)", (self._folder,))
        version = statements.execute("SELECT version FROM sightline_store").fetchone()[0]
        for step in STEPS[version:]:
            statements._connection.execute(of_postgres(step))
        statements.execute("UPDATE sightline_store SET version = ?", (SCHEMA_VERSION,))

    def _refuse_older(self, statements: _Statements) -> None:
        version = statements.execute("SELECT version FROM sightline_store").fetchone()[0]
        if version < SCHEMA_VERSION:
            raise DataFolderError(
                f"The store in PostgreSQL is of version {version}, this Sightline's {SCHEMA_VERSION}; use the one that "
                "wrote it, or start the service once, which brings it up to date."
            )

    def _roll_back(self, connection: psycopg.Connection[Any]) -> None:
        idle = self._psycopg.pq.TransactionStatus.IDLE
        if not connection.closed and connection.info.transaction_status != idle:
            with suppress(self._psycopg.OperationalError):  # then the server has done so itself
                connection.execute("ROLLBACK")

    def _told(self, error: psycopg.Error, line: _Line) -> ServiceError | None:
        """The error as one of ours, with its sentence; None when it is a fault of a statement."""
        errors = self._psycopg.errors
        why = " ".join(str(error).split())
        if isinstance(error, errors.LockNotAvailable | errors.QueryCanceled):
            return StoreLockedError("Another program holds the job store in PostgreSQL; end it and try again.")
        if isinstance(error, errors.DiskFull):
            return StorageFullError("The job store in PostgreSQL cannot be written; make room on its disk.")
        gone = errors.UndefinedTable | errors.InsufficientPrivilege | errors.ReadOnlySqlTransaction
        if isinstance(error, self._psycopg.OperationalError | gone) or line.connection is None:
            return StoreServerError(f"The job store in PostgreSQL cannot be used: {why}.")
        return None


def _storable(values: Sequence[Any]) -> list[Any]:
    """Values without the one character that no text of PostgreSQL can hold; its picture takes its place."""
    return [value.replace("\0", "\N{SYMBOL FOR NULL}") if isinstance(value, str) else value for value in values]


@lru_cache(256)
def _with_its_marks(sql: str) -> str:
    return sql.replace("%", "%%").replace("?", "%s")
