"""Nothing in a folder is lost: somebody else's stays untouched, what no store knows is kept, backups bring all back."""

from __future__ import annotations

import json
import shutil
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.jobs.folder import DataFolder
from service.jobs.records import DemRecord
from service.jobs.store import Store
from tests.service.folders import contents
from tests.service.running import Server, command, environment, running
from tests.stories.grounds import long_job, short_job, upload_rough_ground

# each start shall be quick, and one map is all that is asked for
QUICK: dict[str, Any] = {"workers": 1, "spare_workers": 0, "rehearse": "maps"}
STORE = "sightline.sqlite3"
MARKER = "sightline-folder.json"


def sightline_store(*words: str | Path) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "service.cli", "store", *map(str, words)]
    return subprocess.run(line, capture_output=True, text=True, timeout=120)


def small_ground(server: Server, folder: Path) -> dict[str, Any]:
    np.save(folder / "hill.npy", np.arange(400, dtype=np.float32).reshape(20, 20))
    return server.upload(folder / "hill.npy", cell_m=10.0)


def make_maps(server: Server, dem: dict[str, Any], numbers: range) -> dict[str, tuple[dict[str, Any], bytes]]:
    """By address, the map as it is told and one of its layers."""
    made = {}
    for number in numbers:
        asked = {**short_job(dem), "receiver_above_ground_m": 1.0 + number}
        answer = server.client.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"})
        assert answer.status_code == 201, answer.text
        told = answer.json()
        made[told["links"]["self"]] = (told, server.client.get(told["layers"][0]["href"]).content)
    return made


def are_there(server: Server, maps: dict[str, tuple[dict[str, Any], bytes]]) -> bool:
    """Whether all are told as they were, listed, and downloaded byte for byte; all the same of one that is not."""
    listed = {job["links"]["self"] for job in server.client.get("/visibility-maps").json()["visibility_maps"]}
    for address, (told, layer) in maps.items():
        found = server.client.get(address)
        if found.status_code != 200 or address not in listed:
            return False
        assert found.json() == told
        assert server.client.get(told["layers"][0]["href"]).content == layer
    return True


def test_somebodys_project_is_refused_in_one_sentence_and_not_touched(tmp_path: Path) -> None:
    project = tmp_path / "project"
    for name in ("dems", "results", "inputs", "work", "incoming"):
        (project / name / "2026").mkdir(parents=True)
        (project / name / "2026" / "survey.csv").write_text(f"{name}: weeks of work")
    (project / "README.md").write_text("mine")
    (project / "dems" / "link").symlink_to(project / "README.md")
    before = contents(project)
    for words in ([], ["--data", str(project)]):
        run = subprocess.run([*command(), *words], env=environment(project), capture_output=True, text=True, timeout=60)
        assert (run.returncode, run.stdout) == (2, "")
        assert run.stderr.strip().splitlines() == [
            f"The folder {project} is not empty and not one of Sightline's ({MARKER} is not in it), so nothing in it "
            "is touched; name an empty or a new folder (--data, SIGHTLINE_DATA_FOLDER)."
        ]
    assert contents(project) == before


@pytest.mark.parametrize("kept", [20_000, 50_000, 0.9])
def test_a_store_that_is_cut_short_is_refused_in_one_sentence_and_left_as_it_is(tmp_path: Path, kept: float) -> None:
    folder = DataFolder.open(tmp_path / "data")
    store = Store(folder.database)
    for number in range(300):
        store.add_dem(DemRecord(f"{number:032x}", "hill.npy", float(number), {"words": "ground " * 40}))
    store.close()
    folder.close()
    whole = folder.database.read_bytes()
    cut = whole[: int(kept if kept > 1 else kept * len(whole))]
    folder.database.write_bytes(cut)
    run = subprocess.run(command(), env=environment(folder.root), capture_output=True, text=True, timeout=60)
    assert (run.returncode, run.stdout) == (2, "")
    (sentence,) = run.stderr.strip().splitlines()
    assert sentence.startswith(str(folder.database))
    assert "`sightline store restore` puts a backup in its place." in sentence
    assert folder.database.read_bytes() == cut


def test_a_folder_of_the_release_before_the_marker_opens_also_after_kill_9(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, **QUICK) as server:
        made = make_maps(server, small_ground(server, tmp_path), range(1))
        server.kill()
    # what that release left: no marker, no notes, and a store that is still in its write-ahead log
    (folder / MARKER).unlink()
    for notes in folder.glob("*/*/notes"):
        shutil.rmtree(notes)
    assert (folder / f"{STORE}-wal").stat().st_size
    with running(folder, **QUICK) as server:
        assert are_there(server, made)
        assert (folder / MARKER).is_file()
        assert server.client.get("/health").json()["quarantined"] == 0
        deadline_s = time.monotonic() + 20.0  # notes are written once it is up
        while len(list(folder.glob("results/*/notes/*.json"))) != 1:
            assert time.monotonic() < deadline_s
            time.sleep(0.05)


def test_what_others_keep_beside_and_inside_a_marked_folder_is_never_deleted(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, **QUICK) as server:
        made = make_maps(server, small_ground(server, tmp_path), range(1))
    (folder / "mine").mkdir()
    (folder / "mine" / "file").write_text("beside")
    for name in ("dems", "results", "inputs", "work", "incoming"):
        (folder / name / "my-survey").mkdir()
        (folder / name / "my-survey" / "file").write_text(name)
    with running(folder, **QUICK) as server:
        assert are_there(server, made)
        assert server.client.get("/health").json()["quarantined"] == 5
        assert (folder / "mine" / "file").read_text() == "beside"
        kept = {path.read_text() for path in folder.glob("quarantine/*/*/my-survey/file")}
        assert kept == {"dems", "results", "inputs", "work", "incoming"}
        assert "put into quarantine" in server.log.read_text()
        # whoever clears it need not stop the service, and /health tells so
        shutil.rmtree(folder / "quarantine")
        server.until("/health", lambda health: health["quarantined"] == 0, 20.0)


@pytest.mark.parametrize("way", ["backup", "store put back", "notes"])
def test_a_missing_store_deletes_nothing_and_all_is_taken_back(tmp_path: Path, way: str) -> None:
    folder = tmp_path / "data"
    with running(folder, **QUICK) as server:
        made = make_maps(server, small_ground(server, tmp_path), range(3))
        assert sightline_store("backup", tmp_path / "backup", "--data", folder).returncode == 0
    (folder / STORE).rename(tmp_path / STORE)
    with running(folder, **QUICK) as server:
        assert not are_there(server, made)
        assert server.client.get("/health").json()["quarantined"] == 4  # three results and the DEM
        log = server.log.read_text()
        assert f"{STORE} is missing" in log
        assert "1 DEM and 3 results; nothing was deleted" in log
    if way == "store put back":
        (folder / STORE).unlink()
        (tmp_path / STORE).rename(folder / STORE)
    else:
        done = sightline_store("restore", *([tmp_path / "backup"] if way == "backup" else []), "--data", folder)
        assert done.returncode == 0, done.stderr
    with running(folder, **QUICK) as server:
        assert are_there(server, made)
        assert server.client.get(next(iter(made.values()))[0]["links"]["dem"]).status_code == 200


def test_an_older_store_hides_four_results_until_a_backup_brings_them_back(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, **QUICK) as server:
        dem = small_ground(server, tmp_path)
        two = make_maps(server, dem, range(2))
    shutil.copy(folder / STORE, tmp_path / "older.sqlite3")
    with running(folder, **QUICK) as server:
        four = make_maps(server, dem, range(2, 6))
        assert sightline_store("backup", tmp_path / "backup", "--data", folder).returncode == 0
    shutil.copy(tmp_path / "older.sqlite3", folder / STORE)
    with running(folder, **QUICK) as server:
        assert are_there(server, two)
        assert not are_there(server, four)
        assert server.client.get("/health").json()["quarantined"] == 4
        assert "4 results; nothing was deleted" in server.log.read_text()
        refused = sightline_store("restore", tmp_path / "backup", "--data", folder)
        assert (refused.returncode, len(refused.stderr.strip().splitlines())) == (2, 1)
        assert "in use by another Sightline process" in refused.stderr
    done = sightline_store("restore", tmp_path / "backup", "--data", folder, "--json")
    assert (done.returncode, json.loads(done.stdout)["results"]) == (0, 6)
    with running(folder, **QUICK) as server:
        assert are_there(server, {**two, **four})
        # only the store that was replaced is left there
        assert [path.name for path in folder.glob("quarantine/*/*/*")] == [STORE]


def test_a_result_that_is_away_comes_back_with_its_files_and_a_lost_dem_is_read_again(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, **QUICK) as server:
        dem = small_ground(server, tmp_path)
        made = make_maps(server, dem, range(1))
    (folder / "results").rename(tmp_path / "away")
    shutil.rmtree(folder / "dems")
    with running(folder, **QUICK) as server:
        (address,) = made
        told = server.client.get(address).json()
        assert (told["status"], told["result"]) == ("interrupted", None)
        assert told["problem"]["detail"] == "Its result is missing from the data folder."
        assert "its files are missing from the data folder; upload it again" in server.log.read_text()
        assert small_ground(server, tmp_path) == dem
        make_maps(server, dem, range(1, 2))
    for path in (tmp_path / "away").iterdir():
        path.rename(folder / "results" / path.name)
    with running(folder, **QUICK) as server:
        assert are_there(server, made)


def test_a_backup_while_jobs_end_and_results_are_deleted_is_consistent_in_itself(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, **QUICK) as server:
        dem = small_ground(server, tmp_path)
        kept = make_maps(server, dem, range(4))
        running_job = server.client.post("/visibility-maps", json=long_job(upload_rough_ground(server, tmp_path)))
        stop = threading.Event()

        def go_on() -> None:
            number = 10
            while not stop.is_set():
                (address,) = make_maps(server, dem, range(number, number + 1))
                asked = {"dem_id": dem["id"], "from_points_m": [[0, 0, 500]], "to_points_m": [[9, 9, 500]]}
                server.client.post("/lines-of-sight", json=asked)
                server.client.delete(address)
                number += 1

        # the long job holds the only worker of calculations, so it goes first
        server.until(running_job.headers["Location"], lambda job: job["status"] == "running")
        server.client.delete(running_job.headers["Location"])
        thread = threading.Thread(target=go_on)
        thread.start()
        try:
            for number in range(5):
                done = sightline_store("backup", tmp_path / f"backup-{number}", "--data", folder, "--json")
                assert (done.returncode, json.loads(done.stdout)["missing"]) == (0, []), done.stderr
        finally:
            stop.set()
            thread.join()
        assert server.client.get("/health").json()["status"] == "ok"
    for number in range(5):
        done = sightline_store("check", "--data", tmp_path / f"backup-{number}", "--json")
        assert json.loads(done.stdout) | {"sound": True, "unknown": []} == json.loads(done.stdout)
    done = sightline_store("restore", tmp_path / "backup-4", "--data", tmp_path / "new", "--json")
    assert (done.returncode, json.loads(done.stdout)["missing"]) == (0, [])
    with running(tmp_path / "new", **QUICK) as server:
        assert are_there(server, kept)


def test_a_backup_of_the_store_file_alone_is_enough_where_the_files_are(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, **QUICK) as server:
        made = make_maps(server, small_ground(server, tmp_path), range(2))
        # as people do it: with SQLite's own tool
        live, copy = sqlite3.connect(folder / STORE), sqlite3.connect(tmp_path / "copy.sqlite3")
        live.backup(copy)
        live.close()
        copy.close()
    (folder / STORE).unlink()
    with running(folder, **QUICK):
        pass
    assert sightline_store("restore", tmp_path / "copy.sqlite3", "--data", folder).returncode == 0
    with running(folder, **QUICK) as server:
        assert are_there(server, made)
