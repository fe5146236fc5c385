"""Only a folder of Sightline's, or one that is nobody's, becomes a data folder; all others stay as they are."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import pytest

from service.errors import DataFolderError
from service.jobs.folder import DataFolder
from service.jobs.marker import MARKER, STORE, FolderKind, kind_of, mark
from service.jobs.store import Store
from tests.service.folders import contents


@pytest.mark.parametrize("holds", ["README.md", "dems/hill.tif", ".hidden", "lock", "work/", "results/run-1/out.csv"])
def test_a_folder_that_holds_anything_else_is_refused_and_not_touched(tmp_path: Path, holds: str) -> None:
    path = tmp_path / holds
    path.parent.mkdir(exist_ok=True, parents=True)
    path.mkdir() if holds.endswith("/") else path.write_text("somebody's")
    before = contents(tmp_path)
    with pytest.raises(DataFolderError, match=r"not empty and not one of Sightline's .* nothing in it is touched"):
        DataFolder.open(tmp_path)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("beside", ["", "lost+found", MARKER])
def test_an_empty_folder_becomes_ours(tmp_path: Path, beside: str) -> None:
    if beside == MARKER:
        (tmp_path / MARKER).touch()  # a start that was killed in its first moment
    elif beside:
        (tmp_path / beside).mkdir()
    DataFolder.open(tmp_path).close()
    assert kind_of(tmp_path) is FolderKind.DATA
    DataFolder.open(tmp_path).close()


@pytest.mark.parametrize("journal", ["WAL", "DELETE"])
def test_the_database_of_another_program_under_our_name_is_not_touched(tmp_path: Path, journal: str) -> None:
    connection = sqlite3.connect(tmp_path / STORE)
    connection.execute(f"PRAGMA journal_mode = {journal}")
    connection.executescript("CREATE TABLE jobs (id TEXT); CREATE TABLE dems (id TEXT); PRAGMA user_version = 1;")
    connection.close()
    (tmp_path / "lock").touch()
    before = contents(tmp_path)
    with pytest.raises(DataFolderError, match="not one of Sightline's"):
        DataFolder.open(tmp_path)
    assert contents(tmp_path) == before


def test_a_folder_of_an_earlier_release_is_known_by_its_store_and_marked(tmp_path: Path) -> None:
    Store(tmp_path / STORE).close()
    (tmp_path / "notes of somebody.txt").write_text("stays")
    assert kind_of(tmp_path) is FolderKind.UNMARKED
    DataFolder.open(tmp_path).close()
    assert kind_of(tmp_path) is FolderKind.DATA
    assert (tmp_path / "notes of somebody.txt").read_text() == "stays"


def test_a_store_that_lies_in_its_write_ahead_log_alone_is_known_too(tmp_path: Path) -> None:
    store = Store(tmp_path / "live.sqlite3")  # while it is open, nothing has reached the file itself
    for suffix in ("", "-wal"):
        (tmp_path / "killed").mkdir(exist_ok=True)
        (tmp_path / "killed" / f"{STORE}{suffix}").write_bytes((tmp_path / f"live.sqlite3{suffix}").read_bytes())
    store.close()
    before = contents(tmp_path / "killed")
    assert kind_of(tmp_path / "killed") is FolderKind.UNMARKED
    assert contents(tmp_path / "killed") == before


@pytest.mark.parametrize(
    "words", ["[]", "{", '{"kind": "data folder"}', '{"kind": "empty", "layout": 1}', '{"kind": "x", "layout": 1}', ""]
)
def test_a_marker_that_makes_no_sense_is_refused(tmp_path: Path, words: str) -> None:
    (tmp_path / MARKER).write_text(words)
    (tmp_path / "file").touch()
    before = contents(tmp_path)
    with pytest.raises(DataFolderError):
        DataFolder.open(tmp_path)
    assert contents(tmp_path) == before


def test_a_folder_of_a_newer_layout_is_refused(tmp_path: Path) -> None:
    DataFolder.open(tmp_path).close()
    told = json.loads((tmp_path / MARKER).read_text())
    (tmp_path / MARKER).write_text(json.dumps({**told, "layout": told["layout"] + 1}))
    with pytest.raises(DataFolderError, match="newer Sightline"):
        DataFolder.open(tmp_path)


def test_a_backup_is_not_served(tmp_path: Path) -> None:
    mark(tmp_path, FolderKind.BACKUP)
    with pytest.raises(DataFolderError, match="store restore"):
        DataFolder.open(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [MARKER]


def test_a_part_that_is_a_link_to_somebodys_folder_is_refused(tmp_path: Path) -> None:
    DataFolder.open(tmp_path / "data").close()
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "hill.tif").write_text("theirs")
    (tmp_path / "data" / "work").rmdir()
    (tmp_path / "data" / "work").symlink_to(tmp_path / "theirs")
    with pytest.raises(DataFolderError, match="is a link"):
        DataFolder.open(tmp_path / "data")
    assert (tmp_path / "theirs" / "hill.tif").read_text() == "theirs"


def test_a_link_to_a_folder_is_judged_by_what_it_leads_to(tmp_path: Path) -> None:
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "theirs")
    with pytest.raises(DataFolderError, match="not one of Sightline's"):
        DataFolder.open(tmp_path / "link")
    (tmp_path / "theirs" / "file").unlink()
    DataFolder.open(tmp_path / "link").close()
    assert (tmp_path / "theirs" / MARKER).is_file()


def test_a_file_and_a_link_to_nothing_are_told_as_that(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("theirs")
    (tmp_path / "link").symlink_to(tmp_path / "nothing")
    with pytest.raises(DataFolderError, match="it is a file, not a folder"):
        DataFolder.open(tmp_path / "file")
    with pytest.raises(DataFolderError, match="leads nowhere"):
        DataFolder.open(tmp_path / "link")
    assert (tmp_path / "file").read_text() == "theirs"
    assert not (tmp_path / "nothing").exists()
