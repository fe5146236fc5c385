"""What tests of the service share: stores in either database."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.database import Database
from service.jobs.store_place import StorePlace
from tests.service.postgres import PostgresServer, postgres_server


@pytest.fixture(scope="session")
def postgres() -> Iterator[PostgresServer]:
    with postgres_server() as server:
        yield server


@pytest.fixture(params=["sqlite", "postgresql"])
def opened(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[], Database]:
    """Opens the one store of the test, in a file or on a server; again and again if asked."""
    url = None if request.param == "sqlite" else request.getfixturevalue("postgres").new_database()
    return StorePlace(tmp_path, url).open
