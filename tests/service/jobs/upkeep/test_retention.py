"""Results are kept by age and by size as the settings say, the oldest go first, and pinned ones stay."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.database import Database
from service.errors import NotFoundError
from service.jobs.folder import DataFolder, digest_of
from service.jobs.records import DemRecord, JobRecord, JobStatus
from service.jobs.recovery import note_job
from service.jobs.store import Store
from service.jobs.upkeep.retention import Retention
from service.settings import Settings

MAPS = "visibility-map"
DEM = "d" * 32
HOUR_S = 3600.0


class Place:
    """A store and its folder, with results of given ages and sizes."""

    def __init__(self, root: Path, database: Database) -> None:
        self.folder = DataFolder.open(root)
        self.store = Store(database)
        self.store.add_dem(DemRecord(DEM, "hill.tif", 1.0, {}))

    def finished(self, number: int, hours_ago: float, bytes_: int = 1000, digest: int | None = None) -> str:
        job_id, named = f"{number:032x}", f"{number if digest is None else digest:032x}"
        self.store.add_job(JobRecord(job_id, MAPS, DEM, {"parameters": {}}, JobStatus.QUEUED, float(number)))
        result = self.folder.result(named)
        result.mkdir(exist_ok=True)
        (result / "visible.npy").write_bytes(b"\0" * bytes_)
        self.store.finish_job(job_id, JobStatus.SUCCEEDED, digest=named, summary={})
        self.age(job_id, hours_ago)
        return job_id

    def age(self, job_id: str, hours_ago: float) -> None:
        with self.store.transaction() as connection:
            ended_at_s = time.time() - hours_ago * HOUR_S
            connection.execute("UPDATE jobs SET finished_at_s = ? WHERE id = ?", (ended_at_s, job_id))

    def retention(self, *, keep_s: float | None = None, max_bytes: int | None = None) -> Retention:
        settings = Settings(keep_results_s=keep_s, max_results_bytes=max_bytes)
        retention = Retention(settings, self.store, self.folder)
        while retention.measure():
            pass
        return retention

    def left(self) -> set[int]:
        return {int(job.id, 16) for job in self.store.jobs(MAPS, 200, 0)[0]}

    def results(self) -> set[int]:
        return {int(path.name, 16) for path in (self.folder.root / "results").iterdir()}


@pytest.fixture
def place(tmp_path: Path, opened: Callable[[], Database]) -> Iterator[Place]:
    place = Place(tmp_path / "data", opened())
    yield place
    place.store.close()
    place.folder.close()


def test_without_settings_everything_is_kept_for_good(place: Place) -> None:
    place.finished(1, hours_ago=1e6)
    assert place.retention().sweep() == 0
    assert (place.left(), place.results()) == ({1}, {1})
    assert place.retention().expires_at_s(place.store.job(MAPS, f"{1:032x}")) is None


def test_what_is_too_old_goes_with_its_files_and_that_was_told(place: Place) -> None:
    old, young = place.finished(1, hours_ago=3.0), place.finished(2, hours_ago=1.0)
    retention = place.retention(keep_s=2 * HOUR_S)
    told = {job_id: retention.expires_at_s(place.store.job(MAPS, job_id)) for job_id in (old, young)}
    assert told[old] == pytest.approx(time.time() - HOUR_S, abs=60.0)
    assert told[young] == pytest.approx(time.time() + HOUR_S, abs=60.0)
    assert retention.sweep() == 1
    assert (place.left(), place.results()) == ({2}, {2})
    assert retention.sweep() == 0


def test_jobs_that_failed_or_were_cancelled_go_by_age_too_and_active_ones_never(place: Place) -> None:
    for number, status in ((1, JobStatus.FAILED), (2, JobStatus.CANCELLED)):
        place.finished(number, hours_ago=0.0)
        place.store.finish_job(f"{number:032x}", status)
        place.age(f"{number:032x}", 3.0)
    place.store.add_job(JobRecord(f"{3:032x}", MAPS, DEM, {"parameters": {}}, JobStatus.QUEUED, 1.0))
    assert place.retention(keep_s=HOUR_S).sweep() == 2
    assert place.left() == {3}


def test_the_oldest_go_until_the_rest_fits(place: Place) -> None:
    for number in range(1, 6):
        place.finished(number, hours_ago=10.0 - number, bytes_=1000 * number)
    retention = place.retention(max_bytes=9500)
    assert retention.results_bytes == 15_000
    assert retention.sweep() == 3
    assert (place.left(), place.results(), retention.results_bytes) == ({4, 5}, {4, 5}, 9000)
    assert retention.sweep() == 0


def test_what_is_drawn_later_counts(place: Place) -> None:
    place.finished(1, hours_ago=1.0)
    retention = place.retention(max_bytes=5000)
    layer = place.folder.layer(f"{1:032x}", "map.png")
    layer.parent.mkdir(parents=True)
    layer.write_bytes(b"\0" * 9000)
    retention.measure_again(f"{1:032x}")
    assert retention.measure() == 1
    assert retention.results_bytes == 10_000
    assert retention.sweep() == 1


def test_pinned_ones_stay_whatever_their_age_and_size_until_they_are_unpinned(place: Place) -> None:
    pinned = place.finished(1, hours_ago=100.0)
    place.finished(2, hours_ago=100.0)
    retention = place.retention(keep_s=HOUR_S, max_bytes=0)
    assert retention.pin(MAPS, pinned, True).pinned
    assert retention.expires_at_s(place.store.job(MAPS, pinned)) is None
    while retention.sweep():
        pass
    assert (place.left(), place.results()) == ({1}, {1})
    assert not retention.pin(MAPS, pinned, False).pinned
    retention.sweep()
    assert place.left() == set()


def test_a_pin_is_noted_so_that_a_store_that_was_lost_knows_it_again(place: Place) -> None:
    job_id = place.finished(1, hours_ago=1.0)
    note_job(place.store, place.folder, job_id, job_id)
    place.retention().pin(MAPS, job_id, True)
    note = place.folder.result(job_id) / "notes" / f"{job_id}.json"
    assert json.loads(note.read_text())["pinned"] == 1


def test_a_result_that_a_pinned_job_shares_is_passed_over(place: Place) -> None:
    pinned = place.finished(1, hours_ago=5.0)
    place.finished(2, hours_ago=9.0, digest=1)
    place.finished(3, hours_ago=1.0)
    retention = place.retention(max_bytes=1500)
    retention.pin(MAPS, pinned, True)
    assert retention.results_bytes == 2000
    retention.sweep()
    assert (place.left(), place.results()) == ({1, 2}, {1})


def test_many_go_a_few_at_a_time(place: Place) -> None:
    for number in range(25):
        place.finished(number, hours_ago=3.0, digest=7)
    retention = place.retention(keep_s=HOUR_S)
    swept = [retention.sweep() for _ in range(4)]
    assert swept == [10, 10, 5, 0]
    assert (place.left(), place.results()) == (set(), set())


def test_nothing_that_is_not_there_can_be_pinned(place: Place) -> None:
    with pytest.raises(NotFoundError):
        place.retention().pin(MAPS, "x", True)


def test_a_result_that_no_store_knew_leaves_quarantine_after_a_week_and_nothing_else_does(place: Place) -> None:
    def put(name: str, content: bytes, note: bool = False) -> Path:
        path = place.folder.root / "results" / name
        path.mkdir()
        (path / "count.npy").write_bytes(content)
        if name == "whole":
            path = path.rename(path.with_name(digest_of(path)))
        if note:
            (path / "notes").mkdir()
            (path / "notes" / f"{1:032x}.json").write_text("{}")
        return path

    killed = put("whole", b"killed within its commit")
    known_once, strange = put("whole", b"of a store that is away", note=True), put("their-own", b"theirs")
    place.folder.set_aside_unknown(place.store.known())
    retention, day_s = place.retention(), 86_400.0

    def held() -> set[str]:
        return {path.name for path in place.folder.root.glob("quarantine/*/results/*")}

    assert held() == {killed.name, known_once.name, strange.name}
    assert (retention.clear_quarantine(), retention.clear_quarantine(time.time() + 6.9 * day_s)) == (0, 0)
    assert retention.clear_quarantine(time.time() + 7.1 * day_s) == 1
    assert held() == {known_once.name, strange.name}
    assert retention.clear_quarantine(time.time() + 400 * day_s) == 0
