"""store check, backup and restore: what they tell, what they refuse, and that nothing is lost on the way."""

import json
import shutil
import sqlite3

import pytest

from service.jobs.folder import DataFolder
from service.jobs.marker import MARKER, STORE
from service.jobs.store import Store
from tests.service.folders import DEM, contents, job_id, small_data_folder


@pytest.fixture
def data(tmp_path):
    """A data folder with one DEM and six results."""
    small_data_folder(tmp_path / "data", 6)
    return tmp_path / "data"


def results(root):
    return {path.name for path in (root / "results").iterdir()}


def jobs_in(root):
    with sqlite3.connect(root / STORE) as connection:
        found = {row[0] for row in connection.execute("SELECT id FROM jobs WHERE status = 'succeeded'")}
    connection.close()
    return found


def told(ended):
    assert ended.stdout, ended.stderr
    return json.loads(ended.stdout)


@pytest.mark.parametrize(
    "words", [("--help",), ("check", "--help"), ("backup", "--help"), ("restore", "--help"), ("vacuum", "--help")]
)
def test_each_has_help(sightline, words):
    ended = sightline("store", *words)
    assert (ended.code, ended.stderr) == (0, "")
    assert "Usage: sightline store" in ended.stdout


def test_a_sound_folder_is_told_as_that(sightline, data):
    ended = sightline("store", "check", "--data", data, "--json")
    assert ended.code == 0
    found = told(ended)
    assert (found["sound"], found["in_use"], found["counts"]) == (
        True,
        False,
        {"dems": 1, "jobs": 6, "results": 6, "missions": 0},
    )
    assert (found["missing"], found["damaged"], found["unknown"], found["quarantine"]) == ([], [], [], [])
    assert "sound" in sightline("store", "check", "--data", data).stdout


def test_a_check_changes_nothing(sightline, data):
    before = contents(data)
    sightline("store", "check", "--data", data)
    assert contents(data) == before


def test_a_check_finds_what_is_missing_damaged_and_unknown(sightline, data):
    gone, harmed = sorted(results(data))[:2]
    shutil.rmtree(data / "results" / gone)
    (data / "results" / harmed / "count.npy").write_bytes(b"something else")
    (data / "dems" / DEM / "heights_m.npy").write_bytes(b"no heights")
    (data / "inputs" / "theirs").mkdir()
    ended = sightline("store", "check", "--data", data, "--json")
    assert ended.code == 1
    found = told(ended)
    assert found["missing"] == [f"results/{gone}"]
    assert found["damaged"] == [f"dems/{DEM}", f"results/{harmed}"]
    assert found["unknown"] == ["inputs/theirs"]


def test_a_check_tells_a_service_that_uses_the_folder(sightline, data):
    folder = DataFolder.open(data)
    assert told(sightline("store", "check", "--data", data, "--json"))["in_use"] is True
    folder.close()


def test_a_missing_store_is_told(sightline, data):
    (data / STORE).unlink()
    ended = sightline("store", "check", "--data", data)
    assert ended.code == 1
    assert "is missing" in ended.stdout


def test_a_backup_makes_its_own_folder_alone(sightline, data, tmp_path):
    ended = sightline("store", "backup", tmp_path / "nonexist" / "x" / "y", "--data", data)
    assert (ended.code, ended.stdout) == (2, "")
    assert f"y cannot be made: there is no folder {tmp_path / 'nonexist' / 'x'}." in ended.stderr
    assert not (tmp_path / "nonexist").exists()


def test_a_backup_comes_back_as_it_was_also_in_a_new_folder(sightline, data, tmp_path):
    made = sightline("store", "backup", tmp_path / "backup", "--data", data, "--json")
    assert (made.code, told(made)["results"], told(made)["missing"]) == (0, 6, [])
    assert told(sightline("store", "check", "--data", tmp_path / "backup", "--json"))["sound"] is True
    back = sightline("store", "restore", tmp_path / "backup", "--data", tmp_path / "new", "--json")
    assert (back.code, back.stderr) == (0, "")
    assert (told(back)["from_backup"], told(back)["quarantine"]) == (7, None)
    for part in ("dems", "results"):
        assert contents(tmp_path / "new" / part) == contents(data / part)
    assert jobs_in(tmp_path / "new") == jobs_in(data)


def test_what_the_restored_store_does_not_know_goes_to_quarantine_and_the_replaced_store_brings_it_back(
    sightline, data, tmp_path
):
    sightline("store", "backup", tmp_path / "backup", "--data", data)
    small_data_folder(data, 2, first=6)
    all_of_them = results(data)
    back = told(sightline("store", "restore", tmp_path / "backup", "--data", data, "--json"))
    assert (back["kept"], back["from_backup"], back["quarantined"]) == (7, 0, {"store": 1, "results": 2})
    assert len(results(data)) == len(jobs_in(data)) == 6
    replaced = tmp_path / "data" / "quarantine"
    (store,) = replaced.glob(f"*/store/{STORE}")
    again = told(sightline("store", "restore", store, "--data", data, "--json"))
    assert (again["kept"], again["from_quarantine"], again["missing"]) == (7, 2, [])
    assert results(data) == all_of_them
    assert len(jobs_in(data)) == 8


@pytest.mark.parametrize("lost", ["missing", "older"])
def test_results_that_no_store_knows_are_taken_back_by_their_notes(sightline, data, tmp_path, lost):
    all_of_them, all_jobs = contents(data / "results"), jobs_in(data)
    if lost == "missing":
        (data / STORE).unlink()
    else:
        small_data_folder(tmp_path / "other", 2)
        shutil.copyfile(tmp_path / "other" / STORE, data / STORE)
    folder = DataFolder.open(data)
    store = Store(folder.database)
    folder.set_aside_unknown(store.known())
    store.close()
    folder.close()
    assert len(results(data)) == (0 if lost == "missing" else 2)
    back = sightline("store", "restore", "--data", data, "--json")
    assert back.code == 0
    assert told(back)["from_quarantine"] == (7 if lost == "missing" else 4)
    assert contents(data / "results") == all_of_them
    assert jobs_in(data) == all_jobs


def test_a_note_of_something_else_is_passed_over(sightline, data, caplog):
    (data / STORE).unlink()
    one, other, third = sorted(results(data))[:3]
    (note,) = (data / "results" / one / "notes").iterdir()
    row = json.loads(note.read_text())
    note.write_text(json.dumps({**row, "id": "../../etc"}))
    (note,) = (data / "results" / other / "notes").iterdir()
    note.write_text("[1, 2")
    (note,) = (data / "results" / third / "notes").iterdir()
    note.write_text(json.dumps({**json.loads(note.read_text()), "created_at_s": {"not": "a number"}}))
    back = sightline("store", "restore", "--data", data, "--json")
    assert (back.code, told(back)["results"], told(back)["quarantined"]["results"]) == (0, 3, 3)
    assert caplog.text.count("makes no sense") == 3


def test_a_damaged_result_is_replaced_from_the_backup_and_kept_in_quarantine(sightline, data, tmp_path):
    sightline("store", "backup", tmp_path / "backup", "--data", data)
    harmed = sorted(results(data))[0]
    (data / "results" / harmed / "count.npy").write_bytes(b"something else")
    back = told(sightline("store", "restore", tmp_path / "backup", "--data", data, "--json"))
    assert (back["kept"], back["from_backup"]) == (6, 1)
    (aside,) = (data / "quarantine").glob(f"*/results/{harmed}/count.npy")
    assert aside.read_bytes() == b"something else"
    assert told(sightline("store", "check", "--data", data, "--json"))["sound"] is True


def test_a_damaged_store_is_replaced_and_kept(sightline, data, tmp_path):
    sightline("store", "backup", tmp_path / "backup", "--data", data)
    (data / STORE).write_bytes(b"not a database")
    back = sightline("store", "restore", tmp_path / "backup", "--data", data, "--json")
    assert (back.code, told(back)["kept"]) == (0, 7)
    (aside,) = (data / "quarantine").glob(f"*/store/{STORE}")
    assert aside.read_bytes() == b"not a database"


def test_what_is_nowhere_is_told_by_backup_and_restore(sightline, data, tmp_path):
    gone = sorted(results(data))[0]
    shutil.rmtree(data / "results" / gone)
    made = sightline("store", "backup", tmp_path / "backup", "--data", data)
    assert made.code == 1
    assert f"results/{gone}: not in the data folder" in made.stdout
    back = sightline("store", "restore", tmp_path / "backup", "--data", tmp_path / "new", "--json")
    assert (back.code, told(back)["missing"]) == (1, [f"results/{gone}"])


def test_a_backup_goes_on_while_the_store_is_written(sightline, data, tmp_path):
    live = Store(data / STORE)
    with live._transaction() as connection:
        connection.execute("DELETE FROM jobs")
        made = sightline("store", "backup", tmp_path / "backup", "--data", data, "--json")
        assert (made.code, told(made)["results"]) == (0, 6)
    live.close()


@pytest.mark.parametrize("command", ["check", "backup", "restore"])
@pytest.mark.parametrize("folder", ["project", "nothing", "empty", "file"])
def test_what_is_no_data_folder_is_refused_in_one_sentence_and_not_touched(sightline, tmp_path, command, folder):
    (tmp_path / "project" / "results").mkdir(parents=True)
    (tmp_path / "project" / "results" / "run.csv").write_text("theirs")
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("theirs")
    before = contents(tmp_path)
    words = [tmp_path / "backup"] if command == "backup" else []
    ended = sightline("store", command, *words, "--data", tmp_path / folder)
    assert (ended.code, ended.stdout, len(ended.stderr.strip().splitlines())) == (2, "", 1)
    assert str(tmp_path / folder) in ended.stderr
    assert contents(tmp_path) == before


def test_restoring_refuses_somebodys_folder_and_does_not_touch_it(sightline, data, tmp_path):
    sightline("store", "backup", tmp_path / "backup", "--data", data)
    (tmp_path / "project" / "dems").mkdir(parents=True)
    (tmp_path / "project" / "dems" / "hill.tif").write_text("theirs")
    before = contents(tmp_path / "project")
    ended = sightline("store", "restore", tmp_path / "backup", "--data", tmp_path / "project")
    assert (ended.code, ended.stdout) == (2, "")
    assert contents(tmp_path / "project") == before


def test_restoring_refuses_what_is_no_backup(sightline, data, tmp_path):
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "file").write_text("theirs")
    (tmp_path / "text").write_text("no store")
    sightline("store", "backup", tmp_path / "unfinished", "--data", data)
    marker = tmp_path / "unfinished" / MARKER
    marker.write_text(marker.read_text().replace("true", "false"))
    before = contents(data)
    for source, sentence in (
        ("project", "is no backup of Sightline"),
        ("text", "cannot be read"),
        ("nothing", "There is no backup at"),
        ("unfinished", "was not finished"),
        ("data", "is the data folder itself"),
    ):
        ended = sightline("store", "restore", tmp_path / source, "--data", data)
        assert (ended.code, ended.stdout, len(ended.stderr.strip().splitlines())) == (2, "", 1), source
        assert sentence in ended.stderr
    assert contents(data) == before


def test_restoring_a_store_that_leads_out_of_the_folder_is_refused(sightline, data, tmp_path):
    with sqlite3.connect(data / STORE) as connection:
        connection.execute("UPDATE jobs SET digest = '../../etc' WHERE id = ?", (job_id(0),))
    connection.close()
    ended = sightline("store", "restore", data / STORE, "--data", tmp_path / "new")
    assert ended.code == 2
    assert "it calls something '../../etc'" in ended.stderr
    assert not (tmp_path / "new").exists()


def test_restoring_while_a_service_uses_either_folder_is_refused(sightline, data, tmp_path):
    sightline("store", "backup", tmp_path / "backup", "--data", data)
    folder = DataFolder.open(data)
    for source, target in ((tmp_path / "backup", data), (data, tmp_path / "new")):
        ended = sightline("store", "restore", source, "--data", target)
        assert ended.code == 2
        assert "in use" in ended.stderr
    folder.close()


def test_a_backup_overwrites_nothing_and_does_not_lie_in_its_own_folder(sightline, data, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("theirs")
    for target, sentence in (("full", "is not empty"), ("data/results/x", "in the data folder itself")):
        ended = sightline("store", "backup", tmp_path / target, "--data", data)
        assert (ended.code, ended.stdout) == (2, "")
        assert sentence in ended.stderr
    assert (tmp_path / "full" / "file").read_text() == "theirs"
    assert len(results(data)) == 6


def test_the_folder_comes_from_the_environment_where_it_is_not_named(sightline, data, monkeypatch):
    monkeypatch.setenv("SIGHTLINE_DATA_FOLDER", str(data))
    assert told(sightline("store", "check", "--json"))["folder"] == str(data)
