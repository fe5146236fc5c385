"""Missions kept with their versions, in the file that the job store keeps: every change is one transaction.

Each save makes a version. Named ones stay for good; of the others the newest stay, and of older ones those that lie
closest in time to the one before them make room.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import UTC, datetime

from service.access.callers import acting_tenant, seen_tenant
from service.database import READ, WRITE, Begin, Connection, Place
from service.errors import EditConflictError, LimitError, NotFoundError

__all__ = ["MissionRecord", "MissionShelf", "Sheet", "VersionRecord"]

ANYTHING = "*"
# so many versions without a name are never thinned out
NEWEST = 20
Transaction = Callable[[Begin], AbstractContextManager[Connection]]


@dataclass(frozen=True, slots=True)
class Sheet:
    """A mission's document as text, and what lists tell of it. ground: the name of its DEM's file."""

    document: str
    name: str
    anchors: int
    dem_sha256: str | None = None
    ground: str | None = None


@dataclass(frozen=True, slots=True)
class MissionRecord:
    """A mission without its document; times are seconds since 1970 UTC.

    dem_id: the DEM of this service that has the digest of the mission's ground, None where none has.
    """

    id: str
    name: str
    dem_id: str | None
    ground: str | None
    anchors: int
    created_at_s: float
    saved_at_s: float
    version: int
    saved_by: str | None

    @property
    def place(self) -> Place:
        """Where it stands in lists."""
        return Place(self.saved_at_s, self.id)


@dataclass(frozen=True, slots=True)
class VersionRecord:
    """One version of a mission without its document. name: given by people, None where nobody did."""

    version: int
    name: str | None
    saved_at_s: float
    saved_by: str | None


class MissionShelf:
    """Every method is one transaction and safe to call from any thread. Raises what the store's do.

    transaction: begins one of the store's; most_missions, most_versions: limits of the settings.
    """

    def __init__(self, transaction: Transaction, most_missions: int, most_versions: int) -> None:
        self._transaction = transaction
        self._most_missions = most_missions
        self._most_versions = most_versions

    def add(self, sheet: Sheet, saved_by: str | None, name: str | None = None) -> MissionRecord:
        """Keep a new mission. name: of its first version. Raises LimitError when there are as many as may be."""
        mission_id, now_s = uuid.uuid4().hex, time.time()
        with self._transaction(WRITE) as connection:
            tenant = acting_tenant()
            query = "SELECT count(*) FROM missions WHERE tenant = ?"
            total = connection.execute(query, (tenant,)).fetchone()[0]
            if total >= self._most_missions:
                raise LimitError(
                    f"There are {total:,} missions already, which is the limit; delete one first",
                    limit_name="max_missions",
                    limit=self._most_missions,
                    given=total + 1,
                )
            connection.execute(
                "INSERT INTO missions VALUES (?, ?, ?, ?, ?, ?, ?, 0, NULL, ?)",
                (mission_id, *_columns(sheet), now_s, now_s, tenant),
            )
            return self._append(connection, mission_id, sheet, 1, now_s, saved_by, name)

    def mission(self, mission_id: str) -> MissionRecord:
        """Raises NotFoundError."""
        with self._transaction(READ) as connection:
            return _found(connection, mission_id)

    def missions(self, limit: int, offset: int, after: Place | None = None) -> tuple[list[MissionRecord], int]:
        """One page, last saved first, and how many there are in all. after: the last of the page before."""
        mine, whose = _seen("tenant")
        older, than = ("1 = 1", ()) if after is None else after.condition("saved_at_s", "m.id")
        with self._transaction(READ) as connection:
            total = connection.execute(f"SELECT count(*) FROM missions WHERE {mine}", whose).fetchone()[0]
            rows = connection.execute(
                f"{MISSION} WHERE {mine} AND {older} ORDER BY saved_at_s DESC, m.id LIMIT ? OFFSET ?",
                (*whose, *than, limit, offset),
            ).fetchall()
        return [MissionRecord(*row) for row in rows], total

    def document(self, mission_id: str, version: int | None = None) -> tuple[MissionRecord, VersionRecord, str]:
        """A version of a mission, the newest unless another is named, with its document. Raises NotFoundError."""
        with self._transaction(READ) as connection:
            mission = _found(connection, mission_id)
            told, document = _version(connection, mission_id, mission.version if version is None else version)
        return mission, told, document

    def versions(
        self, mission_id: str, limit: int, offset: int, after: Place | None = None
    ) -> tuple[list[VersionRecord], int]:
        """One page of a mission's versions, newest first, and how many there are in all. Raises NotFoundError.

        after: the last of the page before; its number is that of the version.
        """
        older, than = ("1 = 1", ()) if after is None else ("version < ?", (after.number,))
        with self._transaction(READ) as connection:
            _found(connection, mission_id)
            of = "FROM mission_versions WHERE mission_id = ?"
            total = connection.execute(f"SELECT count(*) {of}", (mission_id,)).fetchone()[0]
            rows = connection.execute(
                f"SELECT version, name, saved_at_s, saved_by {of} AND {older} ORDER BY version DESC LIMIT ? OFFSET ?",
                (mission_id, *than, limit, offset),
            ).fetchall()
        return [VersionRecord(*row) for row in rows], total

    def save(
        self, mission_id: str, sheet: Sheet, builds_on: str, saved_by: str | None, name: str | None = None
    ) -> MissionRecord:
        """Keep a new version; a mission that is the same as the newest gets none unless it is named.

        builds_on: the version that it was made from, or "*" for any. Raises NotFoundError, EditConflictError.
        """
        with self._transaction(WRITE) as connection:
            mission = _unchanged(connection, mission_id, builds_on)
            newest, document = _version(connection, mission_id, mission.version)
            if document == sheet.document and (name is None or newest.name == name):
                return mission
            return self._append(connection, mission_id, sheet, mission.version + 1, time.time(), saved_by, name)

    def name_version(self, mission_id: str, version: int, name: str | None) -> VersionRecord:
        """Give a version a name, with which it stays for good, or take it away. Raises NotFoundError, LimitError."""
        with self._transaction(WRITE) as connection:
            _found(connection, mission_id)
            if name is not None:
                self._refuse_many_names(connection, mission_id, version)
            connection.execute(
                "UPDATE mission_versions SET name = ? WHERE mission_id = ? AND version = ?", (name, mission_id, version)
            )
            return _version(connection, mission_id, version)[0]

    def remove(self, mission_id: str, builds_on: str = ANYTHING) -> None:
        """Forget a mission with all its versions. Raises NotFoundError, EditConflictError."""
        with self._transaction(WRITE) as connection:
            _unchanged(connection, mission_id, builds_on)
            connection.execute("DELETE FROM mission_versions WHERE mission_id = ?", (mission_id,))
            connection.execute("DELETE FROM missions WHERE id = ?", (mission_id,))

    def dem_with_digest(self, sha256: str) -> str | None:
        """Id of the newest DEM of those heights; None where there is none."""
        with self._transaction(READ) as connection:
            row = connection.execute(f"SELECT {DEM_OF.format('?', '?')}", (sha256, acting_tenant())).fetchone()
        return None if row[0] is None else str(row[0])

    def _append(
        self,
        connection: Connection,
        mission_id: str,
        sheet: Sheet,
        version: int,
        now_s: float,
        saved_by: str | None,
        name: str | None,
    ) -> MissionRecord:
        if name is not None:
            self._refuse_many_names(connection, mission_id, version)
        connection.execute(
            "INSERT INTO mission_versions VALUES (?, ?, ?, ?, ?, ?)",
            (mission_id, version, name, now_s, saved_by, sheet.document),
        )
        connection.execute(
            "UPDATE missions SET name = ?, dem_sha256 = ?, ground = ?, anchors = ?, saved_at_s = ?, "
            "version = ?, saved_by = ? WHERE id = ?",
            (*_columns(sheet), now_s, version, saved_by, mission_id),
        )
        self._thin_out(connection, mission_id)
        return _found(connection, mission_id)

    def _refuse_many_names(self, connection: Connection, mission_id: str, version: int) -> None:
        query = "SELECT count(*) FROM mission_versions WHERE mission_id = ? AND name IS NOT NULL AND version != ?"
        named = connection.execute(query, (mission_id, version)).fetchone()[0]
        if named >= self._most_versions:
            raise LimitError(
                f"The mission has {named:,} versions with names already, which is the limit; take a name away first",
                limit_name="max_mission_versions",
                limit=self._most_versions,
                given=named + 1,
            )

    def _thin_out(self, connection: Connection, mission_id: str) -> None:
        rows = connection.execute(
            "SELECT version, saved_at_s FROM mission_versions WHERE mission_id = ? AND name IS NULL ORDER BY version",
            (mission_id,),
        ).fetchall()
        while len(rows) > self._most_versions:
            # the first is what the mission began as
            old = range(1, max(2, len(rows) - NEWEST))
            closest = min(old, key=lambda number: rows[number][1] - rows[number - 1][1])
            (version, _) = rows.pop(closest)
            connection.execute(
                "DELETE FROM mission_versions WHERE mission_id = ? AND version = ?", (mission_id, version)
            )


DEM_OF = (
    "(SELECT id FROM dems WHERE json_extract(summary, '$.sha256') = {} AND dems.tenant = {} "
    "ORDER BY created_at_s DESC, id LIMIT 1)"
)
MISSION = (
    f"SELECT m.id, m.name, {DEM_OF.format('m.dem_sha256', 'm.tenant')}, m.ground, m.anchors, m.created_at_s, "
    "m.saved_at_s, m.version, m.saved_by FROM missions m"
)


def _seen(column: str) -> tuple[str, tuple[str, ...]]:
    """A condition that missions meet which may be seen now, and its values."""
    tenant = seen_tenant()
    return ("1 = 1", ()) if tenant is None else (f"{column} = ?", (tenant,))


def _columns(sheet: Sheet) -> tuple[str, str | None, str | None, int]:
    return sheet.name, sheet.dem_sha256, sheet.ground, sheet.anchors


def _found(connection: Connection, mission_id: str) -> MissionRecord:
    mine, whose = _seen("m.tenant")
    row = connection.execute(f"{MISSION} WHERE m.id = ? AND {mine}", (mission_id, *whose)).fetchone()
    if row is None:
        raise NotFoundError("mission", mission_id)
    return MissionRecord(*row)


def _version(connection: Connection, mission_id: str, version: int) -> tuple[VersionRecord, str]:
    row = connection.execute(
        "SELECT version, name, saved_at_s, saved_by, document FROM mission_versions WHERE mission_id = ? AND "
        "version = ?",
        (mission_id, version),
    ).fetchone()
    if row is None:
        raise NotFoundError("version", str(version), "versions without a name make room for newer ones")
    return VersionRecord(*row[:4]), str(row[4])


def _unchanged(connection: Connection, mission_id: str, builds_on: str) -> MissionRecord:
    """The mission, when it is still the one that a change builds on. Raises NotFoundError, EditConflictError."""
    mission = _found(connection, mission_id)
    if builds_on not in (ANYTHING, str(mission.version)):
        when = datetime.fromtimestamp(mission.saved_at_s, UTC)
        raise EditConflictError(
            f"The mission was saved as version {mission.version} by {mission.saved_by or 'somebody'} on "
            f"{when:%Y-%m-%d at %H:%M:%S} UTC, and yours builds on version {builds_on[:20]}; look at version "
            f"{mission.version} before you save, or save yours as another mission.",
            version=mission.version,
            saved_by=mission.saved_by or "somebody",
            saved_at=when.isoformat(timespec="milliseconds"),
        )
    return mission
