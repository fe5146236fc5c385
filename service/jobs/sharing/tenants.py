"""Whose what is: what a tenant sees of the store, ids of its own for what has the same content, and what it spent."""

from __future__ import annotations

import hashlib
import secrets
import time

from service.access.callers import DEFAULT_TENANT, acting_tenant, seen_tenant
from service.database import Connection

__all__ = ["kept_bytes", "own_id", "salt_of", "seen", "spend", "spent_s"]

HOUR_S = 3600.0


def seen(column: str = "tenant") -> tuple[str, tuple[str, ...]]:
    """A condition that rows meet which may be seen now, and its values; where no request is handled all may."""
    tenant = seen_tenant()
    return ("1 = 1", ()) if tenant is None else (f"{column} = ?", (tenant,))


def salt_of(connection: Connection, tenant: str) -> str:
    """What sets a tenant's ids and digests apart from those of others, and nobody can guess; made when first asked for.

    The default tenant has none: its ids are those that its things always had.
    """
    if tenant == DEFAULT_TENANT:
        return ""
    connection.execute("INSERT INTO tenants VALUES (?, ?) ON CONFLICT DO NOTHING", (tenant, secrets.token_hex(16)))
    return str(connection.execute("SELECT salt FROM tenants WHERE name = ?", (tenant,)).fetchone()[0])


def own_id(connection: Connection, id: str) -> str:
    """The acting tenant's own id of what has this one by its content."""
    salt = salt_of(connection, acting_tenant())
    return id if not salt else hashlib.sha256(f"{salt}\0{id}".encode()).hexdigest()[:32]


def kept_bytes(connection: Connection, tenant: str) -> int:
    """What a tenant's DEMs (a float32 a cell) and results take, as far as these have been measured."""
    (dems,) = connection.execute(
        "SELECT coalesce(sum(4 * CAST(json_extract(summary, '$.cells') AS DOUBLE PRECISION)), 0) FROM dems "
        "WHERE tenant = ?",
        (tenant,),
    ).fetchone()
    (results,) = connection.execute(
        "SELECT coalesce(sum(bytes), 0) FROM results WHERE digest IN (SELECT digest FROM jobs WHERE tenant = ?)",
        (tenant,),
    ).fetchone()
    return int(dems) + int(results)


def spend(connection: Connection, job_id: str, now_s: float) -> None:
    """Count the seconds of a job that is over now to its tenant's; a job that is deleted later stays counted."""
    hour = int(now_s // HOUR_S)
    connection.execute(
        "INSERT INTO spent SELECT tenant, ?, CASE WHEN ? > started_at_s THEN ? - started_at_s ELSE 0.0 END FROM jobs "
        "WHERE id = ? AND started_at_s IS NOT NULL "
        "ON CONFLICT (tenant, hour) DO UPDATE SET seconds = spent.seconds + excluded.seconds",
        (hour, now_s, now_s, job_id),
    )
    connection.execute("DELETE FROM spent WHERE hour < ?", (hour - 48,))


def spent_s(connection: Connection, tenant: str) -> float:
    """Seconds of calculation of the tenant's jobs that ended in this hour."""
    query = "SELECT seconds FROM spent WHERE tenant = ? AND hour = ?"
    row = connection.execute(query, (tenant, int(time.time() // HOUR_S))).fetchone()
    return 0.0 if row is None else float(row[0])
