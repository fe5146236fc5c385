from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from terrain import write_npz
from tests.service.running import Server, running
from tests.service.small_maps import small_grid


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One real service for all tests that do it no harm; its limits are low enough to be reached."""
    folder = tmp_path_factory.mktemp("http") / "data"
    with running(folder, max_upload_bytes=6_000_000, max_dem_cells=2_000_000, max_pairs=1000) as server:
        yield server


@pytest.fixture(scope="session")
def jacksboro(server: Server) -> dict[str, object]:
    """The bundled real DEM: 353 x 415 posts in UTM, some of them unknown."""
    return server.sample("jacksboro")


@pytest.fixture(scope="session")
def ground(server: Server, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The small ground with its wall and its hole."""
    path = tmp_path_factory.mktemp("ground") / "small.npz"
    write_npz(small_grid(), path)
    return server.upload(path, vertical_datum="EGM96")
