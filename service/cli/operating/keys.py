"""``sightline keys``: who may use a service that others reach."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from ..asking.options import option
from ..output import facts_table, print_json, print_tables
from .store import AsJson, DataFolder

if TYPE_CHECKING:
    from service.access.keys import Key

__all__ = ["keys"]


keys = App(name="keys", help="Make, list and revoke the keys of a service; one that runs takes note within a second.")


@keys.command
def add(
    name: Annotated[str, Parameter(name="NAME", allow_leading_hyphen=False, help="Whose it is, or what for.")],
    /,
    *,
    scope: Annotated[
        Literal["read", "calculate", "admin"],
        option("read: look and download; calculate: also ask, upload, delete; admin: also what operators see."),
    ] = "calculate",
    tenant: Annotated[
        str, option("Whose things it reaches; tenants see nothing of one another.", "TENANT")
    ] = "default",
    days: Annotated[float | None, option("Days until it expires. (default never)", "DAYS")] = None,
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Make a key. Its text is shown once and kept nowhere."""
    from service.access.callers import Scope
    from service.access.keys import add_key
    from service.errors import RequestError

    if days is not None and not 0.0 < days <= 36_500.0:
        raise RequestError("--days must be more than 0 and at most 36500.")
    expires_at = None if days is None else (datetime.now(UTC) + timedelta(days=days)).replace(microsecond=0)
    key, text = add_key(_place(data), name, tenant, (Scope(scope),), expires_at)
    if as_json:
        print_json({**_told(key), "key": text})
        return
    print_tables(facts_table(f"Key {key.id}", _facts(key)))
    print(text)


@keys.command(name="list")
def list_keys(*, data: DataFolder = None, as_json: AsJson = False) -> None:
    """List the keys that there are, without their texts."""
    from service.access.keys import read_keys

    found = read_keys(_place(data))
    if as_json:
        print_json({"keys": [_told(key) for key in found]})
    elif found:
        print_tables(*(facts_table(f"Key {key.id}", _facts(key)) for key in found))
    else:
        print("There are no keys; `sightline keys add NAME` makes one.")


@keys.command
def revoke(
    id: Annotated[str, Parameter(name="ID", allow_leading_hyphen=False, help="As `sightline keys list` tells it.")],
    /,
    *,
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Take a key back; its logins end with it."""
    from service.access.keys import revoke_key

    key = revoke_key(_place(data), id)
    if as_json:
        print_json(_told(key))
    else:
        print(f"The key {key.id} ({key.name}) holds no longer.")


def _place(data: Path | None) -> Path:
    """The file of keys; a data folder that is not there yet becomes one."""
    from service.access.gate import keys_file
    from service.jobs.marker import claimed
    from service.settings import Settings

    settings = Settings() if data is None else Settings(data_folder=data)
    if settings.keys_file is None:
        claimed(settings.data_folder)
    return keys_file(settings)


def _told(key: Key) -> dict[str, object]:
    return key.model_dump(mode="json", exclude={"sha256"})


def _facts(key: Key) -> list[tuple[str, str]]:
    expires = "never" if key.expires_at is None else key.expires_at.isoformat(" ")
    over = key.expires_at is not None and key.is_over(datetime.now(UTC).timestamp())
    return [
        ("name", key.name),
        ("tenant", key.tenant),
        ("scopes", ", ".join(key.scopes)),
        ("made", key.created_at.isoformat(" ")),
        ("expires" if not over else "has expired", expires),
    ]
