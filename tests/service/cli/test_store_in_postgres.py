"""The store commands where PostgreSQL keeps the store: moved there and back, checked, backed up, and never mixed up."""

from __future__ import annotations

import json
import shutil
import sys

import psycopg
import pytest

from service.database.migrations import SCHEMA_VERSION, STEPS
from service.database.postgres import OURS, of_postgres
from service.jobs.marker import ELSEWHERE, STORE
from service.jobs.store import Store
from service.jobs.store_place import StorePlace
from tests.service.folders import DEM, contents, job_id, small_data_folder

MAPS = "visibility-map"


@pytest.fixture
def url(postgres, monkeypatch):
    url = postgres.new_database()
    monkeypatch.setenv("SIGHTLINE_DATABASE_URL", url)
    return url


@pytest.fixture
def moved(sightline, tmp_path, url, monkeypatch):
    """A data folder of six results whose store was moved to a server by backup and restore."""
    data = tmp_path / "data"
    small_data_folder(data, 6)
    monkeypatch.delenv("SIGHTLINE_DATABASE_URL")
    assert sightline("store", "backup", tmp_path / "before", "--data", data).code == 0
    monkeypatch.setenv("SIGHTLINE_DATABASE_URL", url)
    done = sightline("store", "restore", tmp_path / "before", "--data", data, "--json").told()
    assert (done["kept"], done["missing"], done["quarantined"]) == (7, [], {"store": 1})
    return data


def jobs(place):
    store = Store(place.open())
    page, total = store.jobs(MAPS, 100)
    whole = [store.job(MAPS, job.id) for job in page]
    store.close()
    return whole, total


def test_a_store_moves_to_a_server_and_back_with_every_row(sightline, moved, tmp_path, url, monkeypatch):
    assert not (moved / STORE).exists()
    on_server = jobs(StorePlace(moved, url))
    assert on_server == jobs(StorePlace(tmp_path / "before"))
    assert sightline("store", "check", "--data", moved, "--json").told()["sound"] is True
    made = sightline("store", "backup", tmp_path / "backup", "--data", moved, "--json").told()
    assert (made["results"], made["dems"], made["missing"]) == (6, 1, [])
    monkeypatch.delenv("SIGHTLINE_DATABASE_URL")
    assert sightline("store", "check", "--data", tmp_path / "backup", "--json").told()["sound"] is True
    assert sightline("store", "restore", tmp_path / "backup", "--data", moved).code == 0
    assert not (moved / ELSEWHERE).exists()
    assert jobs(StorePlace(moved)) == on_server


def test_what_a_restore_replaces_on_a_server_goes_to_quarantine_and_comes_back(sightline, moved, tmp_path, url):
    store = Store(StorePlace(moved, url).open())
    for number in (4, 5):
        store.remove_job(job_id(number))
    store.close()
    assert sightline("store", "check", "--data", moved, "--json").told()["unknown"] != []
    sightline("store", "restore", tmp_path / "before", "--data", moved)
    assert jobs(StorePlace(moved, url))[1] == 6
    [_, replaced] = sorted((moved / "quarantine").glob(f"*/store/{STORE}"), key=lambda path: path.stat().st_mtime)
    sightline("store", "restore", replaced, "--data", moved)
    assert jobs(StorePlace(moved, url))[1] == 4


def test_results_come_back_by_their_notes_when_the_database_was_lost(sightline, moved, postgres, monkeypatch):
    monkeypatch.setenv("SIGHTLINE_DATABASE_URL", postgres.new_database())
    assert jobs(StorePlace(moved, postgres.new_database()))[1] == 0
    back = sightline("store", "restore", "--data", moved, "--json").told()
    assert (back["results"], back["jobs"], back["missing"]) == (6, 6, [])


def test_a_database_is_the_store_of_one_folder(sightline, moved, tmp_path, url):
    small_data_folder(tmp_path / "other", 1)
    (tmp_path / "other" / STORE).unlink()
    before = contents(tmp_path / "other")
    refused = sightline("missions", "list", "--data", tmp_path / "other")
    refused.refused("is that of another data folder")
    assert contents(tmp_path / "other") == before
    shutil.copytree(moved, tmp_path / "copy")
    assert sightline("missions", "list", "--data", tmp_path / "copy").code == 0


def test_a_folder_is_not_used_the_other_way_by_chance(sightline, moved, tmp_path, monkeypatch):
    small_data_folder(tmp_path / "file", 1)
    for words in (("store", "check"), ("store", "backup", tmp_path / "b"), ("missions", "list")):
        told = sightline(*words, "--data", tmp_path / "file")
        assert "has its store in sightline.sqlite3" in told.stderr + told.stdout
    sightline("store", "vacuum", "--data", moved).refused("which vacuums by itself")
    monkeypatch.delenv("SIGHTLINE_DATABASE_URL")
    sightline("missions", "list", "--data", moved).refused("has its store in PostgreSQL; say where")
    assert not (moved / STORE).exists()


@pytest.mark.parametrize("url", ["postgresql:///x?host=/nowhere", "mysql://a:hidden@b/c d", "host=/nowhere port=1"])
def test_a_server_that_is_not_there_is_told_in_a_sentence_without_passwords(sightline, tmp_path, monkeypatch, url):
    monkeypatch.setenv("SIGHTLINE_DATABASE_URL", url)
    (tmp_path / "data").mkdir()
    refused = sightline("missions", "list", "--data", tmp_path / "data")
    refused.refused("PostgreSQL")
    assert "hidden" not in refused.stderr
    assert not (tmp_path / "data" / ELSEWHERE).exists()


@pytest.mark.parametrize("version", range(1, SCHEMA_VERSION))
def test_a_database_of_an_older_version_is_migrated_by_the_service_alone(sightline, tmp_path, url, version):
    place = StorePlace(tmp_path / "data", url)
    place.root.mkdir()
    with psycopg.connect(url) as connection:
        connection.execute(OURS)
        for step in STEPS[:version]:
            connection.execute(of_postgres(step))
        connection.execute("INSERT INTO sightline_store VALUES (%s, 'f')", (version,))
        connection.execute("INSERT INTO dems VALUES (%s, 'hill', 1.5, '{}')", (DEM,))
        columns = "id, kind, dem_id, request, status, created_at_s"
        connection.execute(f"INSERT INTO jobs ({columns}) VALUES ('j', %s, %s, '{{}}', 'queued', 2)", (MAPS, DEM))
    small_data_folder(place.root, 0)
    (place.root / STORE).unlink()
    (place.root / ELSEWHERE).write_text("f\n")
    told = json.loads(sightline("store", "check", "--data", place.root, "--json").stdout)
    assert f"is of version {version}" in told["store_problem"]
    found, total = jobs(place)
    assert (found[0].id, found[0].created_at_s, found[0].tenant, total) == ("j", 2.0, "default", 1)
    with psycopg.connect(url) as connection:
        connection.execute("UPDATE sightline_store SET version = version + 1")
    sightline("missions", "list", "--data", place.root).refused("written by a newer Sightline")


def test_a_package_that_is_missing_is_named(sightline, tmp_path, monkeypatch):
    monkeypatch.setenv("SIGHTLINE_DATABASE_URL", "postgresql:///x")
    monkeypatch.setitem(sys.modules, "psycopg", None)
    (tmp_path / "data").mkdir()
    sightline("missions", "list", "--data", tmp_path / "data").refused("pip install 'sightline[postgres]'")
