"""Checking a data folder or a backup, also while a service works on it: what is missing, damaged or unknown."""

from __future__ import annotations

import fcntl
from collections import defaultdict
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import JsonValue

from service.errors import DataFolderError
from service.jobs.kept_files import is_sound
from service.jobs.marker import Quarantine, size_bytes
from service.jobs.store_file import dem_digests_in, known_to
from service.jobs.store_place import StorePlace

from .backups import folder_of_ours

__all__ = ["Check", "SetAside", "check"]


@dataclass(frozen=True, slots=True)
class SetAside:
    """What one start or restore put into quarantine: where, how many of each kind, bytes."""

    path: str
    parts: dict[str, int]
    bytes: int


@dataclass(frozen=True, slots=True)
class Check:
    """What a check found; ``missing``, ``damaged`` and ``unknown`` hold paths within the folder.

    store_problem: a sentence when the store is missing or damaged. unknown: goes to quarantine at the next start.
    """

    folder: str
    kind: str
    in_use: bool
    store_problem: str | None
    counts: dict[str, int]
    missing: tuple[str, ...]
    damaged: tuple[str, ...]
    unknown: tuple[str, ...]
    quarantine: tuple[SetAside, ...]

    @property
    def sound(self) -> bool:
        """Whether everything that the store knows is there and whole."""
        return not (self.store_problem or self.missing or self.damaged)

    def summary(self) -> dict[str, JsonValue]:
        """Ready for JSON."""
        return {"sound": self.sound, **asdict(self)}


def check(place: StorePlace, progress: Callable[[float], None]) -> Check:
    """Look at everything and change nothing. Raises DataFolderError where the folder is not one of Sightline's."""
    root = place.root
    kind = folder_of_ours(root)
    problem, counts = None, {"dems": 0, "jobs": 0, "results": 0, "missions": 0}
    missing: set[tuple[str, str]] = set()
    damaged: set[tuple[str, str]] = set()
    unknown = _there(root)
    try:
        with place.as_file() as file:
            known = known_to(file)
            counts, digests = known.counts(), dem_digests_in(file)
        for number, (part, name) in enumerate(wanted := known.wanted()):
            path = root / part / name
            if not is_sound(part, path, digests):
                (damaged if path.is_dir() else missing).add((part, name))
            progress((number + 1) / len(wanted))
        # what a service deleted or finished meanwhile is no fault
        with place.as_file() as file:
            now = set(known_to(file).wanted())
        missing, damaged = missing & now, damaged & now
        unknown = (unknown & _there(root)) - set(wanted) - now - {("inputs", job) for job in known.jobs_over}
    except DataFolderError as error:
        problem = str(error)
    return Check(
        folder=str(root),
        kind=kind,
        in_use=_is_in_use(root),
        store_problem=problem,
        counts=counts,
        missing=_paths(missing),
        damaged=_paths(damaged),
        unknown=_paths(unknown),
        quarantine=_set_aside(root),
    )


def _there(root: Path) -> set[tuple[str, str]]:
    folders = [root / part for part in ("dems", "results", "inputs")]
    return {(folder.name, path.name) for folder in folders if folder.is_dir() for path in folder.iterdir()}


def _paths(found: set[tuple[str, str]]) -> tuple[str, ...]:
    return tuple(f"{part}/{name}" for part, name in sorted(found))


def _is_in_use(root: Path) -> bool:
    lock = root / "lock"
    if not lock.is_file():
        return False
    with lock.open("rb") as file:
        try:
            # shared, so that two checks do not take each other for a service
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


def _set_aside(root: Path) -> tuple[SetAside, ...]:
    by_start: defaultdict[Path, list[Path]] = defaultdict(list)
    for path in Quarantine(root).held():
        by_start[path.parents[1]].append(path)
    return tuple(
        SetAside(
            str(start),
            {part: sum(path.parent.name == part for path in paths) for part in sorted({p.parent.name for p in paths})},
            sum(map(size_bytes, paths)),
        )
        for start, paths in by_start.items()
    )
