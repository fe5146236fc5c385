"""Whose a folder is, and the quarantine of what a data folder holds and its store does not know.

quarantine/<when>/<part>/<name>    part: dems, results, inputs, incoming, work, or store for a store that was replaced
"""

from __future__ import annotations

import json
import time
import uuid
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from pydantic import JsonValue

from service.errors import DataFolderError

from .store_file import is_store

__all__ = [
    "ELSEWHERE",
    "MARKER",
    "STORE",
    "FolderKind",
    "Marker",
    "Quarantine",
    "claimed",
    "is_owned",
    "kind_of",
    "mark",
    "read_marker",
    "sentence_of_parts",
    "size_bytes",
    "write_owner",
]

MARKER = "sightline-folder.json"
STORE = "sightline.sqlite3"
# in its place where the store is in PostgreSQL: the id by which folder and database know each other
ELSEWHERE = "sightline.postgresql"
LAYOUT = 1
OWNER = "owner"
STAMP = "%Y%m%dT%H%M%SZ"
# a disk of its own has this when it is new
NOBODYS = frozenset({"lost+found"})
CALLED = {"dems": "DEM", "results": "result", "inputs": "input of a job", "store": "store"}


class FolderKind(StrEnum):
    """What a folder is to us."""

    DATA = "data folder"
    BACKUP = "backup"
    UNMARKED = "data folder without a marker"  # earlier releases made none; known by its store
    EMPTY = "empty"


def kind_of(root: Path) -> FolderKind:
    """What that folder is; nothing in it changes. Raises DataFolderError when it is somebody else's, and OSError."""
    marker = root / MARKER
    names = {path.name for path in root.iterdir()} - NOBODYS
    # a start that was killed in its first moment leaves a marker without words
    if not names or (names == {MARKER} and marker.is_file() and not marker.stat().st_size):
        return FolderKind.EMPTY
    if MARKER in names:
        return read_marker(root).kind
    if is_store(root / STORE):
        return FolderKind.UNMARKED
    raise DataFolderError(
        f"The folder {root} is not empty and not one of Sightline's ({MARKER} is not in it), so nothing in it is "
        "touched; name an empty or a new folder (--data, SIGHTLINE_DATA_FOLDER)."
    )


@dataclass(frozen=True, slots=True)
class Marker:
    """What a folder's marker says: what it is, by which layout; complete: of a backup, whether it was finished."""

    kind: FolderKind
    layout: int
    complete: bool = False


def mark(root: Path, kind: FolderKind, facts: Mapping[str, JsonValue] | None = None) -> None:
    """Say that the folder is ours, and what it is."""
    words = {"sightline": "see docs/data-folder.md", "kind": kind, "layout": LAYOUT, **(facts or {})}
    (root / MARKER).write_text(f"{json.dumps(words, indent=1)}\n", encoding="utf-8")


def read_marker(root: Path) -> Marker:
    """What the marker says. Raises DataFolderError, OSError."""
    marker = root / MARKER
    try:
        words = json.loads(marker.read_text(encoding="utf-8"))
        kind, layout = FolderKind(words["kind"]), int(words["layout"])
    except (ValueError, TypeError, KeyError, RecursionError, IsADirectoryError) as error:
        raise DataFolderError(
            f"The marker {marker} is damaged or not one of Sightline's, so nothing in its folder is touched; "
            f'put it right ({{"kind": "{FolderKind.DATA}", "layout": {LAYOUT}}}) or name another folder.'
        ) from error
    if layout > LAYOUT or kind not in (FolderKind.DATA, FolderKind.BACKUP):
        raise DataFolderError(f"{root} was made by a newer Sightline (layout {layout}, this one knows {LAYOUT}).")
    return Marker(kind, layout, bool(words.get("complete")))


def write_owner(folder: Path, salt: str) -> None:
    """Say in a folder's own files whose it is, by the salt of its tenant; what is the default tenant's has no word."""
    if salt:
        (folder / OWNER).write_text(salt, encoding="ascii")


def is_owned(folder: Path, salt: str) -> bool:
    """Whether a folder is of the tenant with that salt."""
    try:
        return (folder / OWNER).read_text(encoding="ascii") == salt
    except FileNotFoundError:
        return not salt


def claimed(root: Path) -> Path:
    """The data folder of that name, absolute, which is made where there is none; a service may be using it.

    Raises DataFolderError where the folder is somebody else's or a backup.
    """
    root = root.absolute()
    try:
        root.mkdir(parents=True, exist_ok=True)
        kind = kind_of(root)
        if kind is FolderKind.EMPTY:
            mark(root, FolderKind.DATA)
    except OSError as error:
        raise DataFolderError(f"The data folder {root} cannot be used: {error.strerror}.") from error
    if kind is FolderKind.BACKUP:
        raise DataFolderError(f"{root} is a backup, which stays as it is; name a data folder.")
    return root


class Quarantine:
    """The quarantine of one data folder; what one start or one restore puts there lies together."""

    def __init__(self, root: Path) -> None:
        self.root = root / "quarantine"
        self._place = self.root / f"{time.strftime(STAMP, time.gmtime())}-{uuid.uuid4().hex[:6]}"
        self.taken: Counter[str] = Counter()

    @property
    def place(self) -> Path:
        """Where this one's things lie; there is no such folder as long as there are none."""
        return self._place

    def room_for(self, part: str, name: str) -> Path:
        """A free name for something that is about to be put there."""
        folder = self._place / part
        folder.mkdir(parents=True, exist_ok=True)
        target = folder / name
        while target.exists() or target.is_symlink():
            target = folder / f"{name}-{uuid.uuid4().hex[:6]}"
        self.taken[part] += 1
        return target

    def take(self, part: str, path: Path) -> None:
        """Put a file or folder there. Raises OSError."""
        path.rename(self.room_for(part, path.name))

    def held(self) -> list[Path]:
        """Everything that lies there, oldest first."""
        if not self.root.is_dir():
            return []
        return sorted(path for path in self.root.glob("*/*/*") if path.parent.is_dir())

    def newest(self) -> dict[tuple[str, str], Path]:
        """By part and name, what was put there last."""
        return {(path.parent.name, path.name): path for path in self.held()}

    def put_there_before(self, moment_s: float) -> list[Path]:
        """What was put there before a moment, seconds since 1970 UTC."""
        stamp = time.strftime(STAMP, time.gmtime(moment_s))
        return [path for path in self.held() if path.parents[1].name < stamp]

    def forget_empty(self) -> None:
        """Remove the folders that hold nothing any more."""
        for folder in (*self.root.glob("*/*"), *self.root.glob("*"), self.root):
            if folder.is_dir() and not folder.is_symlink() and not any(folder.iterdir()):
                folder.rmdir()


def sentence_of_parts(parts: Iterable[str]) -> str:
    """How many of what, as in ``1 DEM and 4 results``."""
    counted = Counter(CALLED.get(part, "other thing") for part in parts)
    told = [f"{n:,} {what.replace(' ', 's ', 1) if ' of ' in what else f'{what}s'}" if n > 1 else f"1 {what}"
            for what, n in counted.items()]  # fmt: skip
    return " and ".join([", ".join(told[:-1]), told[-1]] if len(told) > 1 else told)


def size_bytes(path: Path) -> int:
    """Bytes of a file, or of all files in a folder."""
    files = path.rglob("*") if path.is_dir() and not path.is_symlink() else [path]
    return sum(file.lstat().st_size for file in files if file.is_file() or file.is_symlink())
