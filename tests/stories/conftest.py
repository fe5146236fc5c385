from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.service.browser import Browser, browsing
from tests.service.running import Server, running
from tests.stories.planner import open_planner


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One real service for all tests that do it no harm."""
    folder = tmp_path_factory.mktemp("stories") / "data"
    with running(folder) as server:
        yield server


@pytest.fixture(scope="session")
def jacksboro(server: Server) -> dict[str, object]:
    """The bundled real DEM: 353 x 415 posts in UTM, some of them unknown."""
    return server.sample("jacksboro")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A real Chromium for the tests of a module."""
    with browsing(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture
def page(browser: Browser, server: Server) -> Iterator[Browser]:
    """The planner as it opens for the first time; at the end it has complained about nothing."""
    open_planner(browser, server)
    browser.complaints.clear()
    yield browser
    assert browser.complaints == []
