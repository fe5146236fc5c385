"""A disk that fills up is seen before it is full, and what deletes works even when it is."""

from __future__ import annotations

import errno
import os
import sqlite3
from pathlib import Path

import pytest

from service.errors import StorageFullError
from service.jobs.upkeep.space import MIB, Space


def disk(monkeypatch: pytest.MonkeyPatch, *, free_mib: int, total_mib: int = 100_000, free_files: int = 10**6) -> None:
    told = os.statvfs_result(
        (4096, 4096, total_mib * 256, free_mib * 256, free_mib * 256, 10**7, 0, free_files, 0, 255)
    )
    monkeypatch.setattr(os, "statvfs", lambda _: told)


def test_with_room_all_is_taken_in_and_a_reserve_put_by(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk(monkeypatch, free_mib=10_000)
    space = Space(tmp_path, 256 * MIB)
    space.look()
    space.refuse_when_low()
    assert (space.low, space.free_bytes, space.least_bytes) == (False, 10_000 * MIB, 256 * MIB)
    assert (tmp_path / "reserve").stat().st_blocks * 512 >= 8 * MIB


def test_below_the_threshold_new_work_is_refused_with_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk(monkeypatch, free_mib=255)
    space = Space(tmp_path, 256 * MIB)
    space.look()
    with pytest.raises(StorageFullError, match=r"255 MiB left.*SIGHTLINE_MIN_FREE_BYTES.*delete"):
        space.refuse_when_low()
    disk(monkeypatch, free_mib=300)
    space.look()
    space.refuse_when_low()


def test_of_a_small_disk_a_twentieth_is_kept_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    space = Space(tmp_path, 256 * MIB)
    disk(monkeypatch, free_mib=60, total_mib=1000)
    space.look()
    assert not space.low
    disk(monkeypatch, free_mib=40, total_mib=1000)
    space.look()
    assert space.low


def test_a_disk_without_files_left_is_full_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk(monkeypatch, free_mib=10_000, free_files=10)
    space = Space(tmp_path, 256 * MIB)
    space.look()
    assert space.low


def full_of(kind: str) -> Exception:
    if kind == "disk":
        return OSError(errno.ENOSPC, "No space left on device")
    error = sqlite3.OperationalError("database or disk is full")
    error.sqlite_errorcode = sqlite3.SQLITE_FULL
    return error


@pytest.mark.parametrize("kind", ["disk", "store"])
def test_on_a_full_disk_the_reserve_makes_room_to_delete(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk(monkeypatch, free_mib=10_000)
    space = Space(tmp_path, 256 * MIB)
    space.look()

    def delete(what: str) -> str:
        if (tmp_path / "reserve").exists():
            raise full_of(kind)
        return what

    assert space.freeing(delete, "done") == "done"
    # once there is room again there is a reserve again
    space.look()
    assert (tmp_path / "reserve").exists()


def test_other_errors_and_a_second_full_disk_pass_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk(monkeypatch, free_mib=10_000)
    space = Space(tmp_path, 256 * MIB)
    space.look()

    def fail(error: Exception) -> None:
        raise error

    with pytest.raises(OSError, match="denied"):
        space.freeing(fail, OSError(errno.EACCES, "denied"))
    assert (tmp_path / "reserve").exists()
    with pytest.raises(OSError, match="No space"):
        space.freeing(fail, full_of("disk"))
