"""API keys: made once, shown once, and kept as hashes in a file."""

from __future__ import annotations

import fcntl
import hashlib
import hmac
import logging
import os
import re
import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from service.errors import KeysError, NotFoundError, RequestError

from .callers import TENANT, Caller, Scope

__all__ = ["Key", "KeyRing", "add_key", "read_keys", "revoke_key"]

logger = logging.getLogger("sightline.access")

# a secret of 256 random bits cannot be guessed, so a plain hash of it is as good as a slow one
TEXT = re.compile(r"sightline_([0-9a-f]{12})_([A-Za-z0-9_-]{43})")
LOOK_EVERY_S = 1.0
NOBODY = "0" * 64


class Key(BaseModel):
    """A key as it is kept: everything but its secret."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: str = Field(pattern=r"^[0-9a-f]{12}$")
    name: str = Field(max_length=120)
    tenant: str = Field(pattern=f"^{TENANT.pattern}$")
    scopes: tuple[Scope, ...] = Field(min_length=1)
    created_at: datetime
    expires_at: datetime | None = None
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")

    def caller(self) -> Caller:
        """Whoever comes with it."""
        return Caller(self.tenant, self.name, self.scopes, self.id)

    def is_over(self, now_s: float) -> bool:
        """Whether it has expired; now_s: seconds since 1970 UTC."""
        return self.expires_at is not None and self.expires_at.timestamp() <= now_s


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    keys: tuple[Key, ...] = ()


def read_keys(path: Path) -> tuple[Key, ...]:
    """The keys of a file, none where there is no file. Raises KeysError."""
    try:
        return _File.model_validate_json(path.read_bytes()).keys
    except FileNotFoundError:
        return ()
    except (OSError, ValidationError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is no file of keys"
        raise KeysError(f"The keys in {path} cannot be read: {why}.") from error


def add_key(
    path: Path, name: str, tenant: str, scopes: tuple[Scope, ...], expires_at: datetime | None = None
) -> tuple[Key, str]:
    """A new key, which is in the file now, and its text, which is nowhere. Raises RequestError, KeysError."""
    if not TENANT.fullmatch(tenant):
        raise RequestError(
            f"{tenant[:80]!r} cannot be a tenant: up to 63 small letters, digits, dots, hyphens and underscores can."
        )
    if not name.strip() or len(name) > 120:
        raise RequestError("A key needs a name of up to 120 letters, to know it by.")
    id, secret = secrets.token_hex(6), secrets.token_urlsafe(32)
    text = f"sightline_{id}_{secret}"
    key = Key(
        id=id,
        name=name,
        tenant=tenant,
        scopes=scopes,
        created_at=datetime.now(UTC).replace(microsecond=0),
        expires_at=expires_at,
        sha256=hashlib.sha256(text.encode()).hexdigest(),
    )
    with _changing(path) as keys:
        keys.append(key)
    return key, text


def revoke_key(path: Path, id: str) -> Key:
    """Take a key out of the file. Raises NotFoundError, KeysError."""
    with _changing(path) as keys:
        found = next((key for key in keys if key.id == id), None)
        if found is None:
            raise NotFoundError("key", id, "`sightline keys list` has those that there are")
        keys.remove(found)
    return found


@contextmanager
def _changing(path: Path) -> Iterator[list[Key]]:
    """The keys of a file, which are written back when the block ends well; one at a time changes them."""
    try:
        folder = os.open(path.parent, os.O_RDONLY)
    except OSError as error:
        raise KeysError(f"{path.parent} cannot be used for keys: {error.strerror}.") from error
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        keys = list(read_keys(path))
        yield keys
        unfinished = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
        try:
            unfinished.touch(0o600, exist_ok=False)
            with unfinished.open("w", encoding="utf-8") as file:
                file.write(f"{_File(keys=tuple(keys)).model_dump_json(indent=1)}\n")
                file.flush()
                os.fsync(file.fileno())
            unfinished.replace(path)
        except OSError as error:
            unfinished.unlink(missing_ok=True)
            raise KeysError(f"The keys in {path} cannot be written: {error.strerror}.") from error
        os.fsync(folder)
    finally:
        os.close(folder)


class KeyRing:
    """The keys of a file for a service that runs: what is added or revoked meanwhile holds a second later.

    Raises KeysError when the file makes no sense at the start. One that makes none later leaves what was known; one
    that is gone leaves no key.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.time) -> None:
        self._path = path
        self._clock = clock
        self._looked_s = float("-inf")
        self._seen: tuple[int, int, int] | None = None
        self._keys = {key.id: key for key in read_keys(path)}

    def __len__(self) -> int:
        self._look()
        now_s = self._clock()
        return sum(not key.is_over(now_s) for key in self._keys.values())

    def find(self, text: str) -> Key | None:
        """The key of that text, unless it has expired; as slow for a wrong text as for a right one."""
        said = TEXT.fullmatch(text)
        known = None if said is None else self.by_id(said[1])
        digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
        return known if hmac.compare_digest(digest, NOBODY if known is None else known.sha256) else None

    def by_id(self, id: str) -> Key | None:
        """The key of that id, unless it has expired."""
        self._look()
        key = self._keys.get(id)
        return None if key is None or key.is_over(self._clock()) else key

    def _look(self) -> None:
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_EVERY_S:
            return
        self._looked_s = now_s
        try:
            stat = self._path.stat()
            seen = stat.st_mtime_ns, stat.st_size, stat.st_ino
        except OSError:
            seen = None
        if seen == self._seen:
            return
        self._seen = seen
        try:
            self._keys = {key.id: key for key in read_keys(self._path)}
        except KeysError as error:
            logger.error("%s The keys of before hold on.", error)
