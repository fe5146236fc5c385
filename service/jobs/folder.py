"""The data folder: what lies where, who may use it, and writing that leaves either the whole file or none.

sightline-folder.json    the marker: this folder is Sightline's
lock                     held while a service works on the folder
sightline.sqlite3        DEMs and jobs; sightline.postgresql where a server keeps them
incoming/                uploads and request bodies while they arrive            emptied of ours at start
work/<token>/            what a task is writing                                  emptied of ours at start
inputs/<job>/            big inputs of a job that is not finished
dems/<id>/               heights and geometry of a DEM; its hillshade in pictures/, bare heights in levels/
results/<digest>/        files of a finished result, named by their content; layers/<version>/ what that one drew
detectors/<id>/          a detector session, while it is open
quarantine/              what lay in one of these folders and the store does not know
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import importlib.metadata
import logging
import os
import re
import shutil
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Self

from service.errors import DataFolderError, DataFolderInUseError

from .marker import ELSEWHERE, STORE, FolderKind, Quarantine, kind_of, mark, sentence_of_parts
from .records import Known
from .store_file import SIDE_FILES

__all__ = ["DataFolder", "digest_of", "is_full", "make_durable", "move_into_place"]

VERSION = importlib.metadata.version("sightline")
# what the system says when a disk, a quota or a file-size limit is full
FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
NUMPY_FULL = re.compile(r"\d+ requested and \d+ written")  # numpy's own words for the same
SUBFOLDERS = ("incoming", "work", "inputs", "dems", "results", "detectors")
# what uploads, tasks, probes and removals call what they make for a while
PASSING = re.compile(r"(probe-|removed-)?[0-9a-f]{32}")

logger = logging.getLogger("sightline.jobs")


@dataclass(frozen=True, slots=True)
class DataFolder:
    """Paths inside the data folder; ``open`` makes them and takes the lock, ``close`` gives it back."""

    root: Path
    _lock: IO[bytes] | None = None

    @classmethod
    def open(cls, root: Path) -> Self:
        """Make the folder usable by this process alone; raises DataFolderError and DataFolderInUseError.

        A new or an empty folder becomes ours and is marked; one that is somebody else's is refused and not touched.
        """
        root = root.absolute()
        try:
            root.mkdir(parents=True, exist_ok=True)
            kind = kind_of(root)
            if kind is FolderKind.BACKUP:
                raise DataFolderError(
                    f"{root} is a backup, which stays as it is; `sightline store restore {root} --data DIR` makes a "
                    "data folder of it."
                )
            if kind is FolderKind.EMPTY:
                # before anything else lies in it, so that two starts at once both know it for ours
                mark(root, FolderKind.DATA)
            lock = (root / "lock").open("ab")
        except OSError as error:
            raise _unusable(root, error) from error
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
            if kind is FolderKind.UNMARKED:
                mark(root, FolderKind.DATA)
        except (OSError, DataFolderError) as error:
            lock.close()
            raise _unusable(root, error) if isinstance(error, OSError) else error from None
        return folder

    def check_usable(self) -> None:
        """Raises DataFolderError when the folder was removed, replaced or made unwritable since, OSError when full."""
        probe = self.incoming / f"probe-{uuid.uuid4().hex}"
        try:
            found = (self.root / "lock").stat()
            for name in SUBFOLDERS:
                (self.root / name).stat()
            probe.touch()
            probe.unlink()
        except OSError as error:
            if is_full(error):
                raise
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
        return self.root / STORE

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

    def level(self, dem_id: str, level: int) -> Path:
        """A DEM's heights at a resolution level, as bare numbers."""
        return self.dem(dem_id) / "levels" / f"{level}.f32"

    def result(self, digest: str) -> Path:
        """Files of a finished result."""
        return self.root / "results" / digest

    def layer(self, digest: str, file_name: str) -> Path:
        """A layer of a finished result as this version draws it; another may draw it otherwise."""
        return self.result(digest) / "layers" / VERSION / file_name

    @property
    def detectors(self) -> Path:
        """Where detector sessions are kept."""
        return self.root / "detectors"

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

    def set_aside_unknown(self, known: Known, quarantine: Quarantine | None = None) -> None:
        """Put whatever no DEM and no job knows into quarantine, and tell it.

        Only the inputs of a job that is over are removed: the service was killed before it could.
        """
        quarantine = quarantine or Quarantine(self.root)
        for part, names in known.parts():
            unknown = set(os.listdir(self.root / part)) - names  # noqa: PTH208 - a path for each of many takes long
            for path in (self.root / part / name for name in sorted(unknown)):
                if part == "inputs" and path.name in known.jobs_over:
                    self.remove(path)
                else:
                    quarantine.take(part, path)
        _tell(quarantine)

    def take_back(self, known: Known) -> None:
        """Take out of quarantine what the store knows and misses: a store that was away has been put back."""
        quarantine, back = Quarantine(self.root), []
        for (part, name), held in quarantine.newest().items():
            path = self.root / part / name
            if name in dict(known.parts()).get(part, ()) and not path.exists():
                if part == "results" and digest_of(held) != name:
                    logger.error("%s is damaged and stays where it is", held)
                    continue
                held.rename(path)
                back.append(part)
        if back:
            quarantine.forget_empty()
            logger.warning("%s taken back from quarantine, since the store knows them", sentence_of_parts(back))

    def count_quarantined(self) -> int:
        """How many things lie in quarantine."""
        return len(Quarantine(self.root).held())

    def _tidy(self) -> None:
        """Make what is missing, and remove what the last process of ours was in the middle of."""
        quarantine = Quarantine(self.root)
        for path in (self.root / name for name in SUBFOLDERS):
            if path.is_symlink():
                raise DataFolderError(
                    f"{path} is a link; the folders of a data folder must lie in it, so nothing is touched. Put the "
                    "whole data folder where there is room."
                )
        for name in SUBFOLDERS:
            (self.root / name).mkdir(exist_ok=True)
        for name in ("incoming", "work"):
            for path in (self.root / name).iterdir():
                if not PASSING.fullmatch(path.name):
                    quarantine.take(name, path)
                elif path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink()
        if not self.database.is_file() or not self.database.stat().st_size:
            # SQLite would delete what is left of a store whose file is gone
            for path in (self.database.with_name(f"{STORE}{suffix}") for suffix in SIDE_FILES):
                if path.is_file():
                    quarantine.take("store", path)
            there = any(any((self.root / name).iterdir()) for name in ("dems", "results", "inputs"))
            if there and not (self.root / ELSEWHERE).is_file():
                logger.warning("%s is missing; a new store is made, which knows nothing of what lies here", STORE)
        _tell(quarantine)


def _tell(quarantine: Quarantine) -> None:
    if quarantine.taken:
        logger.warning(
            "put into quarantine, %s: %s; nothing was deleted, and docs/data-folder.md tells how to take it back",
            quarantine.place,
            sentence_of_parts(quarantine.taken.elements()),
        )


def _unusable(root: Path, error: OSError) -> DataFolderError:
    where = "" if error.filename in (None, str(root)) else f" ({error.filename})"
    what = str(error.strerror)
    if os.path.isfile(root):  # noqa: PTH113 - says no where pathlib raises
        what = "it is a file, not a folder"
    elif os.path.islink(root) and not os.path.exists(root):  # noqa: PTH110, PTH114 - as above
        what = "it is a link that leads nowhere"
    return DataFolderError(f"The data folder {root} cannot be used: {what}{where}.")


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
    """SHA-256, shortened to 32 hexadecimal digits, of the names and contents of a folder's files.

    What is drawn or noted of a result later lies in folders of its own, and is not counted.
    """
    whole = hashlib.sha256()
    for path in sorted(path for path in folder.iterdir() if path.is_file()):
        whole.update(f"{path.name}\0{path.stat().st_size}\0".encode())
        with path.open("rb") as file:
            hashlib.file_digest(file, lambda: whole)
    return whole.hexdigest()[:32]
