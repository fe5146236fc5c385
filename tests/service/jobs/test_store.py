"""The job store: what is written is read again, in the order and the states that it should."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import psycopg
import pytest

from service.database import Database
from service.errors import DataFolderError, InUseError, NotFoundError
from service.jobs.records import DemRecord, Failure, JobRecord, JobStatus, Place
from service.jobs.store import Store

MAPS = "visibility-map"


@pytest.fixture
def store(opened: Callable[[], Database]) -> Iterator[Store]:
    store = Store(opened())
    store.add_dem(DemRecord("d1", "hill.tif", 1.0, {"rows": 3}))
    yield store
    store.close()


def queued(job_id: str, created_at_s: float = 1.0) -> JobRecord:
    return JobRecord(job_id, MAPS, "d1", {"anchors": 1}, JobStatus.QUEUED, created_at_s)


def test_a_dem_is_remembered_as_it_was_first(store: Store, opened: Callable[[], Database]) -> None:
    store.add_dem(DemRecord("d1", "other.tif", 2.0, {"rows": 4}))
    assert store.dem("d1") == DemRecord("d1", "hill.tif", 1.0, {"rows": 3})
    store.close()
    again = Store(opened())
    assert again.dem("d1").name == "hill.tif"
    again.close()


def test_what_is_not_there_is_named(store: Store) -> None:
    for look in (lambda: store.dem("x"), lambda: store.remove_dem("x"), lambda: store.job(MAPS, "x")):
        with pytest.raises(NotFoundError, match="'x'"):
            look()
    store.add_job(queued("j1"))
    with pytest.raises(NotFoundError):
        store.job("lines-of-sight", "j1")


def test_a_job_goes_through_its_states(store: Store) -> None:
    store.add_job(queued("j1"))
    store.start_job("j1")
    running = store.job(MAPS, "j1")
    assert (running.status, running.attempts, running.started_at_s is not None) == (JobStatus.RUNNING, 1, True)
    store.requeue_job("j1")
    assert store.job(MAPS, "j1").attempts == 1
    store.start_job("j1")
    store.requeue_job("j1", forget_attempt=True)
    assert store.job(MAPS, "j1").attempts == 1
    store.finish_job("j1", JobStatus.SUCCEEDED, digest="abc", summary={"share": 0.5})
    done = store.job(MAPS, "j1")
    assert (done.status, done.digest, done.summary, done.active) == (JobStatus.SUCCEEDED, "abc", {"share": 0.5}, False)


def test_a_failure_comes_back_whole(store: Store) -> None:
    failure = Failure("service.LimitError", "Too much.", {"limit": 3})
    store.add_job(queued("j1"))
    store.finish_job("j1", JobStatus.FAILED, failure=failure)
    assert store.job(MAPS, "j1").failure == failure


def test_a_job_on_a_dem_that_is_gone_is_not_taken(store: Store) -> None:
    store.remove_dem("d1")
    with pytest.raises(NotFoundError):
        store.add_job(queued("j1"))
    assert store.jobs(MAPS, 10, 0) == ([], 0)


def test_a_dem_in_use_stays(store: Store) -> None:
    store.add_job(queued("j1"))
    with pytest.raises(InUseError, match="1 job that is not finished"):
        store.remove_dem("d1")
    store.finish_job("j1", JobStatus.CANCELLED)
    store.remove_dem("d1")


def test_lists_come_newest_first_and_page_by_page(store: Store) -> None:
    for number in range(5):
        store.add_job(queued(f"j{number}", created_at_s=float(number)))
    page, total = store.jobs(MAPS, 2, 1)
    assert ([job.id for job in page], total) == (["j3", "j2"], 5)
    assert [job.id for job in store.active_jobs()] == ["j0", "j1", "j2", "j3", "j4"]


def test_a_result_that_is_shared_is_freed_with_its_last_job(store: Store) -> None:
    for job_id in ("j1", "j2"):
        store.add_job(queued(job_id))
        store.finish_job(job_id, JobStatus.SUCCEEDED, digest="abc", summary={})
    assert (store.known().dems, store.known().digests) == ({"d1"}, {"abc"})
    assert store.remove_job("j1") is None
    assert store.remove_job("j2") == "abc"
    assert store.remove_job("j2") is None


def test_a_job_whose_files_are_away_has_no_result_until_they_are_back(store: Store) -> None:
    store.add_job(queued("j1"))
    store.finish_job("j1", JobStatus.SUCCEEDED, digest="abc", summary={"share": 0.5})
    missing = Failure("service.JobInterruptedError", "Its result is missing.")
    assert store.look_for_results(store.known(), frozenset({"def"}), missing) == ["j1"]
    away = store.job(MAPS, "j1")
    assert (away.status, away.digest, away.summary, away.failure) == (JobStatus.INTERRUPTED, None, None, missing)
    assert store.look_for_results(store.known(), frozenset({"abc", "def"}), missing) == []
    back = store.job(MAPS, "j1")
    assert (back.status, back.digest, back.summary, back.failure) == (JobStatus.SUCCEEDED, "abc", {"share": 0.5}, None)


def test_pages_that_follow_on_each_other_are_the_list_also_where_jobs_were_made_at_once(store: Store) -> None:
    moments = [3.0, 1.0, 2.0, 2.0, 2.0, 1.0, 4.0]
    for number, moment in enumerate(moments):
        store.add_job(queued(f"j{number}", moment))
        store.add_dem(DemRecord(f"dem{number}", "hill.tif", 10.0 + moment, {}))
    whole, total = store.jobs(MAPS, 100)
    assert total == 7
    assert [job.id for job in whole] == ["j6", "j0", "j2", "j3", "j4", "j1", "j5"]
    found, after = [], None
    while page := store.jobs(MAPS, 2, after=after)[0]:
        found += page
        after = Place(page[-1].created_at_s, page[-1].id)
        # what is deleted, and what is new, leaves out and repeats nothing of what is behind
        store.remove_job(page[-1].id)
        store.add_job(queued(f"new{after.id}", 9.0))
    assert found == whole
    page, total = store.dems(3, after=Place(12.0, "dem3"))
    assert ([dem.id for dem in page], total) == (["dem4", "dem1", "dem5"], 8)


def test_how_many_there_are_is_told_after_every_change(store: Store) -> None:
    assert store.jobs(MAPS, 1)[1] == 0
    store.add_job(queued("j1"))
    store.add_job(queued("j2"))
    with pytest.raises((sqlite3.IntegrityError, psycopg.IntegrityError)):
        store.add_job(queued("j2"))
    with pytest.raises(NotFoundError):
        store.add_job(JobRecord("j3", MAPS, "no-such-dem", {"parameters": {}}, JobStatus.QUEUED, 1.0))
    assert (store.jobs(MAPS, 1)[1], store.jobs("dop-map", 1)[1]) == (2, 0)
    store.remove_job("j1")
    store.remove_job("j1")
    assert store.jobs(MAPS, 1)[1] == 1


def test_who_reads_waits_for_no_change_and_sees_what_was_there_before_it(store: Store) -> None:
    store.add_job(queued("j1"))
    read = list[tuple[list[str], int]]()

    def look() -> None:
        jobs, total = store.jobs(MAPS, 10)
        read.append(([job.id for job in jobs], total))

    looking = threading.Thread(target=look, daemon=True)
    with store.transaction() as connection:
        connection.execute("UPDATE jobs SET id = 'j2'")
        looking.start()
        looking.join(30.0)
        assert read == [(["j1"], 1)]
    look()
    assert read[1:] == [(["j2"], 1)]


def test_threads_do_not_get_in_each_others_way(store: Store) -> None:
    def add(start: int) -> None:
        for number in range(start, start + 20):
            store.add_job(queued(f"j{number}"))

    threads = [threading.Thread(target=add, args=(start,)) for start in range(0, 100, 20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert store.jobs(MAPS, 1, 0)[1] == 100


def test_a_file_that_is_no_store_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "store.sqlite3"
    path.write_bytes(b"not a database at all" * 100)
    with pytest.raises(DataFolderError, match="cannot be used as the job store"):
        Store(path)


def test_a_store_with_damaged_pages_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    store = Store(tmp_path / "store.sqlite3")
    store.add_dem(DemRecord("d1", "hill.tif", 1.0, {"rows": 3}))
    for number in range(500):
        store.add_job(queued(f"job-{number}"))
    store.close()
    path = tmp_path / "store.sqlite3"
    content = bytearray(path.read_bytes())
    content[3 * 4096 : 5 * 4096] = b"\xff" * 2 * 4096
    path.write_bytes(content)
    with pytest.raises(DataFolderError, match=r"store restore|cannot be used as the job store"):
        Store(path)
    assert path.read_bytes() == content
