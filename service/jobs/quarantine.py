"""The quarantine: where what a data folder holds and its store does not know is put, until somebody decides on it.

quarantine/<when>/<part>/<name>    part: dems, results, inputs, incoming, work, or store for a store that was replaced
"""

from __future__ import annotations

import time
import uuid
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

__all__ = ["Quarantine", "sentence_of_parts", "size_bytes"]

CALLED = {"dems": "DEM", "results": "result", "inputs": "input of a job", "store": "store"}


class Quarantine:
    """The quarantine of one data folder; what one start or one restore puts there lies together."""

    def __init__(self, root: Path) -> None:
        self.root = root / "quarantine"
        self._place = self.root / f"{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}-{uuid.uuid4().hex[:6]}"
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
