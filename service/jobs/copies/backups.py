"""Backups of a data folder: made while a service works on it, and put back where none does."""

from __future__ import annotations

import fcntl
import shutil
import time
import uuid
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import JsonValue

from service.errors import DataFolderError, DataFolderInUseError, RequestError
from service.jobs.folder import DataFolder, make_durable, move_into_place
from service.jobs.kept_files import copy_files, is_sound
from service.jobs.marker import STORE, FolderKind, Quarantine, kind_of, mark, read_marker
from service.jobs.records import Known
from service.jobs.recovery import adopt
from service.jobs.store_file import copied, dem_digests_in, forget, known_to, settle
from service.jobs.store_place import StorePlace

__all__ = ["Backup", "Restored", "back_up", "folder_of_ours", "restore", "vacuum"]

# each round copies what came since the one before; a service cannot finish results faster than they are copied
ROUNDS = 8
Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Backup:
    """What a backup holds; missing: what the store knows and the data folder does not have."""

    known: Known
    missing: tuple[str, ...]

    def summary(self) -> dict[str, JsonValue]:
        """Ready for JSON."""
        return {**self.known.counts(), "missing": list(self.missing)}


@dataclass(slots=True)
class Restored:
    """What a restore did, as ``part/name`` each: what was there, what came from the backup, what from quarantine."""

    known: Known
    kept: list[str] = field(default_factory=list)
    from_backup: list[str] = field(default_factory=list)
    from_quarantine: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    quarantined: Counter[str] = field(default_factory=Counter)
    quarantine: Path | None = None

    def summary(self) -> dict[str, JsonValue]:
        """Ready for JSON."""
        return {
            **self.known.counts(),
            "kept": len(self.kept),
            "from_backup": len(self.from_backup),
            "from_quarantine": len(self.from_quarantine),
            "missing": [*self.missing],
            "quarantined": dict(self.quarantined),
            "quarantine": None if self.quarantine is None else str(self.quarantine),
        }


def folder_of_ours(root: Path) -> FolderKind:
    """What kind of Sightline's folders it is. Raises DataFolderError where it is none, or cannot be read."""
    root = root.absolute()
    try:
        kind = kind_of(root)
    except OSError as error:
        raise DataFolderError(f"The folder {root} cannot be read: {error.strerror}.") from error
    if kind is FolderKind.EMPTY:
        raise DataFolderError(f"The folder {root} is empty; there is no store in it.")
    return kind


def back_up(place: StorePlace, target: Path, progress: Progress) -> Backup:
    """Copy store and files into a new or empty folder; each result that the copied store knows has its files there.

    Safe while a service works on the folder, which goes on meanwhile. Raises DataFolderError, RequestError, OSError.
    """
    root, target = place.root, target.absolute()
    folder_of_ours(root)
    place.check_there()
    _make_target(root, target)
    store = target / STORE
    try:
        mark(target, FolderKind.BACKUP, {"complete": False})
        absent: set[tuple[str, str]] = set()
        for _ in range(ROUNDS):
            store.unlink(missing_ok=True)
            place.snapshot(store)
            known = known_to(store)
            absent_before, absent = absent, set()
            if not _copy_new(root, target, known, absent, progress) and absent <= absent_before:
                break
        # deleted while the files were copied, after the last look at the store
        with place.as_file() as now:
            deleted = absent.difference(known_to(now).wanted())
        for part, name in deleted:
            forget(store, part, name)
        known = known_to(store)
        _drop_unknown(target, known)
        make_durable(target)
        backup = Backup(known, tuple(f"{part}/{name}" for part, name in sorted(absent - deleted)))
        mark(target, FolderKind.BACKUP, {"complete": True, "made_at_s": round(time.time(), 3), **backup.summary()})
        make_durable(target)
    except BaseException:
        # the folder was new or empty, so all of it is ours
        for path in target.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        raise
    return backup


def restore(source: Path | None, place: StorePlace, progress: Progress) -> Restored:
    """Put the store of a backup, or a store's file alone, into a data folder, and its files with it.

    What it replaces, and what the restored store does not know, goes to quarantine; what lies there and it knows comes
    back. A new or empty folder becomes a data folder. Without a source everything in quarantine that has a note comes
    back. Raises DataFolderError, DataFolderInUseError, RequestError, OSError.
    """
    if source is None:
        return _take_back(place, progress)
    source, root = source.absolute(), place.root
    with _resting(source, root) as store, copied(store) as copy:
        known = known_to(copy)
        settle(copy)
        folder = DataFolder.open(root)
        try:
            return _put_back(copy, None if store == source else source, folder, place, known, progress)
        finally:
            folder.close()


def vacuum(place: StorePlace) -> tuple[int, int]:
    """Write the store anew without what was deleted; its bytes before and after. Raises DataFolderError,
    DataFolderInUseError, RequestError.
    """
    folder_of_ours(place.root)
    folder = DataFolder.open(place.root)
    try:
        return place.vacuum()
    finally:
        folder.close()


def _take_back(place: StorePlace, progress: Progress) -> Restored:
    """Restore the store that the data folder has, with what the notes in its quarantine say."""
    folder_of_ours(root := place.root)
    folder = DataFolder.open(root)
    try:
        place.open().close()
        with place.as_file() as file, copied(file) as copy:
            settle(copy)
            in_place = [path for part in ("dems", "results") for path in sorted((root / part).iterdir())]
            if not adopt(copy, (*in_place, *reversed(Quarantine(root).held()))):
                raise RequestError(
                    f"In {root} nothing can be taken back: nothing in its quarantine has a note that the store lacks; "
                    "name the backup to restore."
                )
            return _put_back(copy, None, folder, place, known_to(copy), progress)
    finally:
        folder.close()


@contextmanager
def _resting(source: Path, root: Path) -> Iterator[Path]:
    """The store in a backup, or in another data folder that nobody uses meanwhile."""
    if source.is_file():
        yield source
        return
    if not source.exists():
        raise RequestError(f"There is no backup at {source}.")
    if root.exists() and source.samefile(root):
        raise RequestError(f"{source} is the data folder itself; name the backup that is to be put into it.")
    try:
        kind = folder_of_ours(source)
    except DataFolderError as error:
        raise RequestError(f"{source} is no backup of Sightline: {error}") from error
    if kind is FolderKind.BACKUP and not read_marker(source).complete:
        raise RequestError(f"The backup {source} was not finished; restore another one.")
    lock = source / "lock"
    if kind is FolderKind.BACKUP or not lock.is_file():
        yield source / STORE
        return
    with lock.open("rb") as held:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise DataFolderInUseError(
                f"{source} is a data folder in use; make a backup of it with `sightline store backup` and restore that."
            ) from error
        yield source / STORE


def _put_back(
    store: Path, files: Path | None, folder: DataFolder, place: StorePlace, known: Known, progress: Progress
) -> Restored:
    quarantine = Quarantine(folder.root)
    held, digests = quarantine.newest(), dem_digests_in(store)
    told = Restored(known)
    wanted = known.wanted()
    for number, (part, name) in enumerate(wanted):
        path = folder.root / part / name
        if is_sound(part, path, digests):
            told.kept.append(f"{part}/{name}")
        elif (part, name) in held and is_sound(part, held[part, name], digests):
            _replace(quarantine, part, held[part, name], path)
            told.from_quarantine.append(f"{part}/{name}")
        elif files is not None and is_sound(part, files / part / name, digests):
            work = folder.work(uuid.uuid4().hex)
            copy_files(files / part / name, work)
            _replace(quarantine, part, work, path)
            told.from_backup.append(f"{part}/{name}")
        else:
            told.missing.append(f"{part}/{name}")
        progress((number + 1) / (len(wanted) + 1))
    place.replace(store, quarantine)
    folder.set_aside_unknown(known, quarantine)
    quarantine.forget_empty()
    told.quarantined = quarantine.taken
    told.quarantine = quarantine.place if quarantine.taken else None
    return told


def _replace(quarantine: Quarantine, part: str, new: Path, path: Path) -> None:
    if path.exists() or path.is_symlink():
        quarantine.take(part, path)
    move_into_place(new, path)


def _make_target(root: Path, target: Path) -> None:
    if target.resolve().is_relative_to(root.resolve()):
        raise RequestError(f"The backup {target} would lie in the data folder itself; name a folder outside of it.")
    try:
        target.mkdir(exist_ok=True)
        empty = not any(target.iterdir())
    except OSError as error:
        why = error.strerror if target.parent.is_dir() else f"there is no folder {target.parent}"
        raise RequestError(f"The backup folder {target} cannot be made: {why}.") from error
    if not empty:
        raise RequestError(
            f"The backup folder {target} is not empty, and no backup overwrites anything; name a new one."
        )


def _copy_new(root: Path, target: Path, known: Known, absent: set[tuple[str, str]], progress: Progress) -> int:
    """Copy what is known and not copied yet; how many that were. absent: takes what is not there."""
    copied_now = 0
    wanted = known.wanted()
    for number, (part, name) in enumerate(wanted):
        if not (target / part / name).exists():
            if copy_files(root / part / name, target / part / name):
                copied_now += 1
            else:
                absent.add((part, name))
        progress((number + 1) / len(wanted))
    return copied_now


def _drop_unknown(target: Path, known: Known) -> None:
    """Take out of a backup what was copied before it was deleted."""
    for part, names in known.parts():
        (target / part).mkdir(exist_ok=True)
        for path in (target / part).iterdir():
            if path.name not in names:
                shutil.rmtree(path)
