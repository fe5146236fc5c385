"""store vacuum: the room of what was deleted goes back to the disk, and nothing else changes."""

import json

import pytest

from service.jobs.folder import DataFolder
from service.jobs.marker import STORE
from service.jobs.store import Store
from tests.service.cli.test_store_command import jobs_in, told
from tests.service.folders import DEM, small_data_folder


@pytest.fixture
def data(tmp_path):
    """A data folder with one DEM and six results."""
    small_data_folder(tmp_path / "data", 6)
    return tmp_path / "data"


def test_a_vacuum_gives_the_room_of_deleted_jobs_back_and_keeps_the_others(sightline, data):
    store = Store(data / STORE)
    with store.transaction() as connection:
        for number in range(2000):
            row = (f"f{number:031x}", "path", DEM, json.dumps({"parameters": {"a": "b" * 500}}), "failed", 1.0)
            connection.execute(
                "INSERT INTO jobs (id, kind, dem_id, request, status, created_at_s) VALUES (?, ?, ?, ?, ?, ?)", row
            )
        connection.execute("DELETE FROM jobs WHERE kind = 'path'")
    store.close()
    kept = jobs_in(data)
    ended = sightline("store", "vacuum", "--data", data, "--json")
    assert ended.code == 0
    assert told(ended)["bytes_after"] < 100_000 < 1_000_000 < told(ended)["bytes_before"]
    assert jobs_in(data) == kept
    assert told(sightline("store", "check", "--data", data, "--json"))["sound"]
    assert "before" in sightline("store", "vacuum", "--data", data).stdout


def test_a_vacuum_of_a_folder_in_use_is_refused(sightline, data):
    folder = DataFolder.open(data)
    refused = sightline("store", "vacuum", "--data", data)
    folder.close()
    assert refused.code == 2
    assert "in use" in refused.stderr
