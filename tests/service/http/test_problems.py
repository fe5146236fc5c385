"""Errors as problems: every error has its row, and a fault shows nothing of itself."""

from __future__ import annotations

import asyncio
import logging
import sqlite3
import sys
from types import ModuleType
from typing import Any

import httpx
import orjson
import pytest
from fastapi import FastAPI

from detection import errors as of_detection
from navigation import errors as of_navigation
from planning import errors as of_planning
from service import errors as of_service
from service.http import problems
from service.http.problem_kinds import PROBLEMS
from service.http.problems import FailedJob, answer_with_problems, problem_of
from service.jobs.process import TaskFailed
from service.jobs.records import Failure
from terrain import errors as of_terrain
from visibility import errors as of_visibility

TREES = [of_terrain, of_visibility, of_detection, of_navigation, of_planning, of_service]


@pytest.mark.parametrize("tree", TREES, ids=lambda tree: tree.__name__)
def test_every_exported_error_has_a_row_of_its_own(tree: ModuleType) -> None:
    assert {getattr(tree, name) for name in tree.__all__} <= set(PROBLEMS)


def test_names_are_stable_words_and_each_has_one_meaning() -> None:
    by_name: dict[str, set[tuple[int, str]]] = {}
    for kind in PROBLEMS.values():
        assert kind.name == kind.name.lower().replace(" ", "-")
        assert 400 <= kind.status <= 599
        by_name.setdefault(kind.name, set()).add((kind.status, kind.title))
    assert {name for name, meanings in by_name.items() if len(meanings) > 1} == set()


def test_a_failure_from_a_worker_gives_the_same_problem_as_the_error_itself() -> None:
    error = of_terrain.DemTooLargeError("Too large.", cells=9, limit_cells=3)
    assert problem_of(Failure.of(error), "/dems") == {
        "type": "/problems/dem-too-large",
        "title": "The DEM has too many cells",
        "status": 422,
        "detail": "Too large.",
        "instance": "/dems",
        "cells": 9,
        "limit_cells": 3,
    }


def test_a_new_error_of_a_domain_is_at_least_that_domains_problem() -> None:
    problem = problem_of(Failure("visibility.BrandNewError", "Too new."), None)
    assert (problem["status"], problem["type"], problem["detail"]) == (422, "/problems/visibility", "Too new.")


def test_a_failure_without_a_row_shows_nothing_of_itself(caplog: pytest.LogCaptureFixture) -> None:
    problem = problem_of(Failure("service.Unheard", "secret path /etc"), None)
    assert problem["status"] == 500
    assert "secret" not in str(problem)
    assert "service.Unheard" in caplog.text


def answer_to(error: Exception) -> httpx.Response:
    """What an app answers when a route raises the error."""
    app = FastAPI()
    answer_with_problems(app)

    @app.get("/raise")
    async def fail() -> None:
        raise error

    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            return await client.get("/raise")

    return asyncio.run(ask())


def of_sqlite(code: int) -> sqlite3.OperationalError:
    """As the database itself raises it."""
    error = sqlite3.OperationalError("secret")
    error.sqlite_errorcode = code
    return error


@pytest.mark.parametrize(
    ("error", "status", "kind"),
    [
        (of_terrain.DemFormatError("Not a DEM."), 422, "dem-format"),
        (of_visibility.AnchorError("Too low."), 422, "anchor"),
        (of_service.NotFoundError("DEM", "x"), 404, "not-found"),
        (of_service.BusyError("Full", limit_name="max_queued_jobs", limit=1), 503, "busy"),
        (TaskFailed(Failure("visibility.AnchorError", "Too low.")), 422, "anchor"),
        (FailedJob(Failure("service.StorageFullError", "Full."), "/visibility-maps/1"), 507, "storage-full"),
        (of_sqlite(sqlite3.SQLITE_FULL), 507, "storage-full"),
        (of_sqlite(sqlite3.SQLITE_BUSY), 503, "store-locked"),
        (of_sqlite(sqlite3.SQLITE_BUSY_SNAPSHOT), 503, "store-locked"),
        (of_sqlite(sqlite3.SQLITE_IOERR_WRITE), 503, "data-folder"),
        (of_sqlite(sqlite3.SQLITE_READONLY_DBMOVED), 503, "data-folder"),
        (of_sqlite(sqlite3.SQLITE_ERROR), 500, "internal"),
        (OSError(28, "No space left on device"), 507, "storage-full"),
        (ZeroDivisionError("secret"), 500, "internal"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Exception) else str(value),
)
def test_whatever_is_raised_becomes_a_problem(error: Exception, status: int, kind: str) -> None:
    answer = answer_to(error)
    assert answer.status_code == status
    assert answer.headers["Content-Type"] == problems.MEDIA_TYPE
    assert answer.json()["type"] == f"/problems/{kind}"
    if status == 503:
        assert int(answer.headers["Retry-After"]) > 0


def test_a_fault_is_logged_under_the_reference_that_the_answer_shows(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.ERROR):
        answer: Any = answer_to(RuntimeError("the secret of /etc/passwd"))
    assert "secret" not in answer.text
    assert "Traceback" not in answer.text
    reference = answer.json()["reference"]
    assert reference in answer.json()["detail"]
    record = next(record for record in caplog.records if reference in record.getMessage())
    assert "the secret" in str(record.exc_info)


def test_a_failure_carries_only_what_json_can_have() -> None:
    error = of_terrain.DemTooLargeError("large: \ud800", cells=10**400, limit_cells=-(10**30))
    failure = Failure.of(error)
    assert failure.detail == "large: ?"
    assert orjson.loads(orjson.dumps(dict(failure.data))) == {"cells": sys.float_info.max, "limit_cells": -1e30}
