"""The data folder: one user at a time, tidy at start, whole files or none."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from service.errors import DataFolderError, DataFolderInUseError
from service.jobs.folder import DataFolder, digest_of, is_full, move_into_place
from service.jobs.kept_files import load_grid, save_grid
from service.jobs.records import Known
from terrain import ElevationGrid, Provenance

HEX = "0123456789abcdef" * 2


def test_only_one_may_use_it_until_it_is_closed(tmp_path: Path) -> None:
    folder = DataFolder.open(tmp_path / "data")
    with pytest.raises(DataFolderInUseError, match="in use by another"):
        DataFolder.open(tmp_path / "data")
    folder.close()
    DataFolder.open(tmp_path / "data").close()


def test_a_place_that_is_no_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(DataFolderError, match="cannot be used"):
        DataFolder.open(tmp_path / "file")


def known(**names: set[str]) -> Known:
    given = {name: frozenset(names.get(name, ())) for name in ("dems", "jobs", "jobs_over", "digests", "inputs")}
    return Known(**given)


def test_what_was_unfinished_is_swept_away_at_start_and_the_rest_stays(tmp_path: Path) -> None:
    folder = DataFolder.open(tmp_path / "data")
    for place in (folder.work(HEX), folder.incoming / HEX, folder.work(f"removed-{HEX}"), folder.result("abc")):
        place.mkdir()
        (place / "file").write_bytes(b"x")
    folder.close()
    folder = DataFolder.open(tmp_path / "data")
    assert list(folder.incoming.iterdir()) == []
    assert list((folder.root / "work").iterdir()) == []
    assert (folder.result("abc") / "file").exists()
    assert folder.count_quarantined() == 0
    folder.close()


def test_what_the_store_does_not_know_goes_to_quarantine_and_comes_back_when_it_does(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = DataFolder.open(tmp_path / "data")
    for place in (folder.result("abc"), folder.dem("d1"), folder.inputs("j1"), folder.inputs("over")):
        place.mkdir()
        (place / "file").write_bytes(b"x")
    digest = digest_of(folder.result("abc"))
    folder.result("abc").rename(folder.result(digest))
    folder.set_aside_unknown(known(dems={"d1"}, jobs_over={"over"}))
    assert ": 1 result and 1 input of a job; nothing was deleted" in caplog.text
    assert not folder.result(digest).exists()
    assert not folder.inputs("over").exists(), "its job is over, so nobody needs it"
    assert (folder.dem("d1") / "file").exists()
    assert folder.count_quarantined() == 2
    folder.take_back(known(digests={digest}, inputs={"j1"}))
    assert (folder.result(digest) / "file").read_bytes() == b"x"
    assert (folder.inputs("j1") / "file").read_bytes() == b"x"
    assert not (folder.root / "quarantine").exists()
    folder.close()


def test_a_damaged_result_in_quarantine_stays_there(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder = DataFolder.open(tmp_path / "data")
    folder.result(HEX).mkdir()
    folder.set_aside_unknown(known())
    folder.take_back(known(digests={HEX}))
    assert not folder.result(HEX).exists()
    assert "damaged and stays where it is" in caplog.text
    folder.close()


def test_what_others_put_among_passing_things_goes_to_quarantine(tmp_path: Path) -> None:
    DataFolder.open(tmp_path / "data").close()
    for name in ("incoming", "work"):
        (tmp_path / "data" / name / "mine.txt").write_text(name)
    folder = DataFolder.open(tmp_path / "data")
    (place,) = (folder.root / "quarantine").iterdir()
    assert {path.parent.name: path.read_text() for path in place.glob("*/mine.txt")} == {
        "incoming": "incoming",
        "work": "work",
    }
    folder.close()


def test_a_write_ahead_log_whose_store_is_gone_is_kept(tmp_path: Path) -> None:
    DataFolder.open(tmp_path / "data").close()
    (tmp_path / "data" / "sightline.sqlite3-wal").write_bytes(b"newest changes")
    folder = DataFolder.open(tmp_path / "data")
    (kept,) = (folder.root / "quarantine").glob("*/store/*")
    assert kept.read_bytes() == b"newest changes"
    folder.close()


def test_removing_what_is_not_there_is_no_error(tmp_path: Path) -> None:
    folder = DataFolder.open(tmp_path / "data")
    folder.remove(folder.result("nothing"))
    folder.close()


def test_moving_into_place_keeps_what_stands_there(tmp_path: Path) -> None:
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
    move_into_place(tmp_path / "first", tmp_path / "results" / "abc")
    move_into_place(tmp_path / "second", tmp_path / "results" / "abc")
    assert (tmp_path / "results" / "abc" / "file").read_text() == "first"
    assert not (tmp_path / "second").exists()


def test_the_digest_follows_names_and_contents(tmp_path: Path) -> None:
    digests = set()
    for number, (name, content) in enumerate([("a", "1"), ("a", "2"), ("b", "1"), ("a", "1")]):
        (tmp_path / str(number)).mkdir()
        (tmp_path / str(number) / name).write_text(content)
        digests.add(digest_of(tmp_path / str(number)))
    assert len(digests) == 3


def test_a_full_disk_is_told_from_other_faults() -> None:
    assert is_full(OSError(errno.ENOSPC, "No space left on device"))
    assert is_full(OSError(errno.EFBIG, "File too large"))
    assert is_full(OSError("1000000 requested and 124984 written"))
    assert not is_full(OSError(errno.EACCES, "Permission denied"))
    assert not is_full(OSError("something else"))


@pytest.mark.parametrize("crs", ["EPSG:32611", None])
def test_a_grid_comes_back_as_it_was(tmp_path: Path, crs: str | None) -> None:
    heights_m = np.arange(12, dtype=np.float32).reshape(3, 4)
    heights_m[1, 2] = np.nan
    provenance = Provenance("hill.tif", "GTiff", ("Feet to metres.",), ("One void.",))
    grid = ElevationGrid(heights_m, 30.0, 25.0, 5.0, -7.0, crs, vertical_datum="EGM96", provenance=provenance)
    save_grid(grid, tmp_path / "dem")
    again = load_grid(tmp_path / "dem")
    assert again.digest == grid.digest
    assert again.provenance == provenance
    assert again.vertical_datum == "EGM96"
    assert not again.heights_m.flags.writeable


def test_what_another_version_drew_is_another_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = DataFolder(tmp_path)
    path = folder.layer("a" * 32, "map.png")
    monkeypatch.setattr("service.jobs.folder.VERSION", "999.0")
    assert folder.layer("a" * 32, "map.png") != path
    assert folder.layer("a" * 32, "map.png").parent.name == "999.0"
