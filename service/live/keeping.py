"""Sessions on disk, so that they outlive the service, also one that is killed.

detectors/<id>/session.json    what it was opened with
detectors/<id>/<n>.memory      what it remembered before the first epoch of the n-th part
detectors/<id>/<n>.epochs      the epochs of that part, a line of JSON each, every one written before it is answered

Of the parts the last two are kept, so that a session takes two of them at most. An answered epoch has been given to the
system, which a killed process takes nothing from; it is on the disk a second later at most, which a lost mains may.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from pydantic import ValidationError

from service.access.callers import DEFAULT_TENANT
from service.live.request import DetectorIn, EpochIn

__all__ = ["Kept", "Part", "SessionFolder", "kept_in"]

PART_EPOCHS, PART_BYTES = 200, 1_000_000
SESSION, EPOCHS, MEMORY = "session.json", ".epochs", ".memory"

logger = logging.getLogger("sightline.http")


@dataclass(frozen=True, slots=True)
class Kept:
    """What a session was opened with. restored_at: when a service took it over from the one before; None = never."""

    id: str
    created_at: str
    idle_timeout_s: float
    asked: DetectorIn
    restored_at: str | None = None
    tenant: str = DEFAULT_TENANT


@dataclass(frozen=True, slots=True)
class Part:
    """A stretch of a session: its memory before, as bytes, and the epochs that came then."""

    memory: bytes
    epochs: tuple[EpochIn, ...]


class SessionFolder:
    """Where one session is kept; not for two threads at once but for ``make_durable``.

    works: false once the disk refused: the session goes on and is not kept any more.
    """

    def __init__(self, root: Path, number: int = 0) -> None:
        self._root, self._number = root, number
        self._file: int | None = None
        self._epochs = self._bytes = 0
        self._fresh: set[Path] = set()  # what may not be on the disk yet
        self.works = True

    @classmethod
    def of(cls, root: Path, kept: Kept, memory: bytes) -> Self:
        """A folder for a new session. Raises OSError."""
        root.mkdir(parents=True)
        folder = cls(root)
        folder._write_facts(kept)
        folder._begin(memory)
        return folder

    def rewrite(self, kept: Kept) -> None:
        """Keep what the session is asked for from now on."""
        try:
            self._write_facts(kept)
        except OSError as error:
            self._refuse(error)

    def go_on(self, memory: bytes) -> None:
        """Begin a new part with what the session remembers now. Raises OSError."""
        self._number += 1
        self._begin(memory)

    def keep(self, asked: EpochIn, memory: Callable[[], bytes]) -> None:
        """Write an epoch that was taken in; memory: after it."""
        if not self.works or self._file is None:
            return
        line = asked.model_dump_json(exclude_unset=True).encode() + b"\n"
        try:
            os.write(self._file, line)
            self._fresh.add(self._root / f"{self._number}{EPOCHS}")
            self._epochs, self._bytes = self._epochs + 1, self._bytes + len(line)
            if self._epochs >= PART_EPOCHS or self._bytes >= PART_BYTES:
                self.go_on(memory())
        except OSError as error:
            self._refuse(error)

    def make_durable(self) -> None:
        """Have the system write what it was given to the disk now. Raises OSError."""
        fresh, self._fresh = self._fresh, set()
        for path in fresh:
            with contextlib.suppress(FileNotFoundError), path.open("rb") as file:
                os.fsync(file.fileno())

    def close(self) -> None:
        """Write no more; what is there stays."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def remove(self) -> None:
        """The session is over."""
        self.close()
        shutil.rmtree(self._root, ignore_errors=True)

    def parts(self) -> tuple[Part, ...]:
        """What is there, oldest first; a line that was cut off when the process ended was never answered."""
        numbers = sorted(int(path.stem) for path in self._root.glob(f"*{MEMORY}") if path.stem.isdigit())
        self._number = numbers[-1] if numbers else 0
        return tuple(
            Part((self._root / f"{n}{MEMORY}").read_bytes(), tuple(_epochs(self._root / f"{n}{EPOCHS}")))
            for n in numbers
        )

    def _begin(self, memory: bytes) -> None:
        self.close()
        self._write(self._root / f"{self._number}{MEMORY}", memory)
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC
        self._file = os.open(self._root / f"{self._number}{EPOCHS}", flags, 0o600)
        self._epochs = self._bytes = 0
        for suffix in (MEMORY, EPOCHS):
            for path in self._root.glob(f"*{suffix}"):
                if path.stem.isdigit() and int(path.stem) < self._number - 1:
                    path.unlink(missing_ok=True)

    def _refuse(self, error: OSError) -> None:
        self.works = False
        logger.error("the session in %s is not kept any more: %s", self._root, error)

    def _write_facts(self, kept: Kept) -> None:
        asked = kept.asked.model_dump(mode="json", exclude_unset=True)
        facts = {
            "id": kept.id,
            "created_at": kept.created_at,
            "tenant": kept.tenant,
            "idle_timeout_s": kept.idle_timeout_s,
            "asked": asked,
        }
        self._write(self._root / SESSION, json.dumps(facts, allow_nan=False).encode())

    def _write(self, path: Path, data: bytes) -> None:
        """A file, whole or not at all."""
        unfinished = path.with_name(f"{path.name}.new")
        unfinished.write_bytes(data)
        unfinished.replace(path)
        self._fresh.add(path)


def kept_in(root: Path, restored_at: str) -> Iterator[tuple[Kept, SessionFolder]]:
    """The sessions that lie there, oldest first; what is none is told and left where it is."""
    found = []
    for path in sorted(root.iterdir()):
        try:
            facts = json.loads((path / SESSION).read_text(encoding="utf-8"))
            asked = DetectorIn.model_validate_json(json.dumps(facts["asked"]))
            kept = Kept(
                str(facts["id"]),
                str(facts["created_at"]),
                float(facts["idle_timeout_s"]),
                asked,
                restored_at,
                str(facts.get("tenant", DEFAULT_TENANT)),
            )
        except (OSError, ValueError, KeyError, TypeError) as error:
            logger.warning("%s is no session that can be gone on with: %s", path, error)
            continue
        found.append((kept, SessionFolder(path)))
    yield from sorted(found, key=lambda one: one[0].created_at)


def _epochs(path: Path) -> Iterator[EpochIn]:
    if not path.is_file():
        return
    for line in path.read_bytes().splitlines(keepends=True):
        if not line.endswith(b"\n"):
            continue
        try:
            yield EpochIn.model_validate_json(line)
        except ValidationError as error:
            logger.warning("an epoch in %s cannot be read: %s", path, error.errors()[0]["msg"])
