"""The data folder: what lies where, who may use it, and writing that leaves either the whole file or none.

lock                 held while a service works on the folder
sightline.sqlite3    DEMs and jobs
incoming/            uploads and request bodies while they arrive            emptied at start
work/<token>/        what a task is writing                                  emptied at start
inputs/<job>/        big inputs of a job that is not finished
dems/<id>/           heights and geometry of a DEM; pictures/ holds its hillshade
results/<digest>/    files of a finished result, named by their content; layers/ holds drawn layers
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import re
import shutil
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Self

from service.errors import DataFolderError, DataFolderInUseError

__all__ = ["DataFolder", "digest_of", "is_full", "make_durable", "move_into_place"]

# What the system says when a disk, a quota or a file-size limit is full.
FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
# numpy's own words for the same, without the system's number
NUMPY_FULL = re.compile(r"\d+ requested and \d+ written")
BLOCK_BYTES = 1024 * 1024
SUBFOLDERS = ("incoming", "work", "inputs", "dems", "results")


@dataclass(frozen=True, slots=True)
class DataFolder:
    """Paths inside the data folder; ``open`` makes them and takes the lock, ``close`` gives it back."""

    root: Path
    _lock: IO[bytes] | None = None

    @classmethod
    def open(cls, root: Path) -> Self:
        """Make the folder usable by this process alone; raises DataFolderError and DataFolderInUseError."""
        root = root.absolute()
        try:
            root.mkdir(parents=True, exist_ok=True)
            lock = (root / "lock").open("ab")
        except OSError as error:
            raise DataFolderError(f"The data folder {root} cannot be used: {error.strerror}.") from error
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            lock.close()
            raise DataFolderInUseError(
                f"The data folder {root} is in use by another Sightline process; stop that one or choose another "
                "folder (SIGHTLINE_DATA_FOLDER)."
            ) from error
        folder = cls(root, lock)
        try:
            folder._tidy()
        except OSError as error:
            lock.close()
            raise DataFolderError(f"The data folder {root} cannot be used: {error.strerror}.") from error
        return folder

    def check_usable(self) -> None:
        """Raises DataFolderError when the folder has been removed, replaced or made unwritable since it was opened."""
        probe = self.incoming / f"probe-{uuid.uuid4().hex}"
        try:
            found = (self.root / "lock").stat()
            for name in SUBFOLDERS:
                (self.root / name).stat()
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise DataFolderError(
                f"The data folder {self.root} cannot be used any more ({error.strerror}); put it back or make it "
                "writable, then restart the service."
            ) from error
        if self._lock is not None and not os.path.samestat(found, os.fstat(self._lock.fileno())):
            raise DataFolderError(
                f"The data folder {self.root} is not the one that the service started with; restart the service."
            )

    def close(self) -> None:
        """Let another process use the folder."""
        if self._lock is not None:
            self._lock.close()

    @property
    def database(self) -> Path:
        """The SQLite file."""
        return self.root / "sightline.sqlite3"

    @property
    def incoming(self) -> Path:
        """Where uploads and bodies arrive."""
        return self.root / "incoming"

    def work(self, token: str) -> Path:
        """Where the task of that token writes."""
        return self.root / "work" / token

    def inputs(self, job_id: str) -> Path:
        """Big inputs of a job."""
        return self.root / "inputs" / job_id

    def dem(self, dem_id: str) -> Path:
        """Heights and geometry of a DEM."""
        return self.root / "dems" / dem_id

    def hillshade(self, dem_id: str) -> Path:
        """A DEM's picture."""
        return self.dem(dem_id) / "pictures" / "hillshade.png"

    def result(self, digest: str) -> Path:
        """Files of a finished result."""
        return self.root / "results" / digest

    def layer(self, digest: str, file_name: str) -> Path:
        """A drawn layer of a finished result."""
        return self.result(digest) / "layers" / file_name

    def remove(self, path: Path) -> None:
        """Remove a file or folder at once, however many files it holds: out of sight first, then for good."""
        grave = self.work(f"removed-{uuid.uuid4().hex}")
        try:
            path.rename(grave)
        except FileNotFoundError:
            return
        if grave.is_dir():
            shutil.rmtree(grave, ignore_errors=True)
        else:
            grave.unlink(missing_ok=True)

    def remove_unknown(self, dem_ids: set[str], job_ids: set[str], digests: set[str]) -> None:
        """Remove whatever no DEM and no job knows: left behind by a process that was killed."""
        for name, known in (("dems", dem_ids), ("inputs", job_ids), ("results", digests)):
            for path in (self.root / name).iterdir():
                if path.name not in known:
                    self.remove(path)

    def _tidy(self) -> None:
        for name in ("incoming", "work"):
            shutil.rmtree(self.root / name, ignore_errors=True)
        for name in SUBFOLDERS:
            (self.root / name).mkdir(exist_ok=True)


def is_full(error: OSError) -> bool:
    """Whether a write failed because there is no space left."""
    return error.errno in FULL or (error.errno is None and NUMPY_FULL.search(str(error)) is not None)


def make_durable(folder: Path) -> None:
    """Have the system write a folder's files to disk now, so that a rename never shows half of them."""
    for path in (*sorted(folder.rglob("*")), folder):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def move_into_place(source: Path, target: Path) -> None:
    """Rename a finished file or folder to its lasting name; what already stands there under that name stays."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        source.rename(target)
    except OSError as error:
        if error.errno not in (errno.EEXIST, errno.ENOTEMPTY):
            raise
        shutil.rmtree(source)
    descriptor = os.open(target.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def digest_of(folder: Path) -> str:
    """SHA-256, shortened to 32 hexadecimal digits, of the names and contents of a folder's files."""
    whole = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        whole.update(f"{path.name}\0{path.stat().st_size}\0".encode())
        with path.open("rb") as file:
            while block := file.read(BLOCK_BYTES):
                whole.update(block)
    return whole.hexdigest()[:32]
