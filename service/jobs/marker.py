"""Whose a folder is: Sightline's data, a backup of it, nobody's yet, or somebody else's, which is never touched."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from pydantic import JsonValue

from service.errors import DataFolderError

from .store_file import is_store

__all__ = ["MARKER", "STORE", "FolderKind", "Marker", "kind_of", "mark", "read_marker"]

MARKER = "sightline-folder.json"
STORE = "sightline.sqlite3"
LAYOUT = 1
# a disk of its own has this when it is new
NOBODYS = frozenset({"lost+found"})


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
