"""Stores of older Sightlines: brought up to date with nothing lost, kept as they were beside; newer ones refused."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from service.database import migrations
from service.database.migrations import SCHEMA_VERSION, STEPS, copy_before
from service.errors import DataFolderError
from service.jobs.records import JobStatus
from service.jobs.store import Store
from service.jobs.store_file import is_store, known_to

# written by the Sightline of each version, and never again
OLDER = sorted((Path(__file__).parent / "older_stores").glob("version_*.sql"))


def made(script: Path, folder: Path) -> Path:
    path = folder / "sightline.sqlite3"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.executescript(script.read_text(encoding="utf-8"))
    return path


def rows(path: Path, table: str) -> list[dict[str, object]]:
    with closing(sqlite3.connect(path)) as connection:
        connection.row_factory = sqlite3.Row
        return [dict(row) for row in connection.execute(f"SELECT * FROM {table} ORDER BY id")]


def schema(path: Path) -> set[tuple[str, str, str]]:
    with closing(sqlite3.connect(path)) as connection:
        found = connection.execute("SELECT type, name, sql FROM sqlite_schema WHERE sql IS NOT NULL").fetchall()
        columns = connection.execute("SELECT m.name, p.name, p.type FROM sqlite_schema m, pragma_table_info(m.name) p")
        return {(kind, name, " ".join(sql.split())) for kind, name, sql in found if kind == "index"} | set(columns)


def test_there_is_a_store_of_every_version_before_this_one() -> None:
    assert [path.stem for path in OLDER] == [f"version_{number}" for number in range(1, SCHEMA_VERSION)]


@pytest.mark.parametrize("script", OLDER, ids=lambda path: path.stem)
def test_an_older_store_is_migrated_with_every_row_as_it_was(script: Path, tmp_path: Path) -> None:
    path = made(script, tmp_path)
    before = {table: rows(path, table) for table in ("dems", "jobs")}
    assert is_store(path)
    Store(path).close()
    for table, older in before.items():
        migrated = rows(path, table)
        assert [{key: row[key] for key in was} for row, was in zip(migrated, older, strict=True)] == older
    Store(tmp_path / "new.sqlite3").close()
    assert schema(path) == schema(tmp_path / "new.sqlite3")


@pytest.mark.parametrize("script", OLDER, ids=lambda path: path.stem)
def test_what_an_older_store_says_is_read_through_the_new_one(script: Path, tmp_path: Path) -> None:
    store = Store(made(script, tmp_path))
    jobs, total = store.jobs("visibility-map", 10, 0)
    assert (total, [job.id[-2:] for job in jobs]) == (2, ["11", "10"])
    whole = store.job("visibility-map", jobs[1].id)  # a list has neither what was asked nor what came out
    assert (whole.summary, whole.digest, whole.pinned) == (
        {"share": 0.5, "version": "0.1.0"},
        f"{10:032x}",
        False,
    )
    assert [(job.id[-2:], job.status, job.attempts) for job in store.active_jobs()] == [
        ("14", JobStatus.RUNNING, 2),
        ("15", JobStatus.QUEUED, 0),
    ]
    failed = store.job("lines-of-sight", f"{0x12:032x}")
    assert failed.failure is not None
    assert (failed.failure.detail, failed.has_inputs) == ("Too much.", True)
    assert store.dem(f"{2:032x}").name == "Grüne Höhe.asc"
    store.close()


@pytest.mark.parametrize("script", OLDER, ids=lambda path: path.stem)
def test_the_older_store_is_kept_as_it_was(script: Path, tmp_path: Path) -> None:
    path = made(script, tmp_path)
    version = int(script.stem.removeprefix("version_"))
    known, jobs, was = known_to(path), rows(path, "jobs"), schema(path)
    Store(path).close()
    kept = copy_before(path, version)
    assert (known_to(kept), rows(kept, "jobs"), schema(kept)) == (known, jobs, was)
    Store(path).close()
    assert {file.name for file in tmp_path.iterdir()} == {path.name, kept.name}


def test_a_migration_that_fails_leaves_the_store_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = made(OLDER[0], tmp_path)
    was, jobs = schema(path), rows(path, "jobs")
    failing = (STEPS[0], STEPS[1] + "INSERT INTO nowhere VALUES (1);", *STEPS[2:])
    monkeypatch.setattr(migrations, "STEPS", failing)
    with pytest.raises(DataFolderError, match="nowhere"):
        Store(path)
    assert (schema(path), rows(path, "jobs")) == (was, jobs)
    monkeypatch.undo()
    Store(path).close()
    assert rows(path, "jobs")[0]["pinned"] == 0


def test_a_newer_store_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "sightline.sqlite3"
    Store(path).close()
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
        connection.execute("ALTER TABLE jobs ADD COLUMN of_later TEXT")
    was = path.read_bytes()
    with pytest.raises(DataFolderError, match="newer Sightline"):
        Store(path)
    assert path.read_bytes() == was
