"""What becomes of a service whose data folder is locked, deleted or replaced while it runs."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path
from typing import Any

import httpx

from tests.service.running import Server, running

ANCHOR = {"id": "D1", "lon_deg": -84.2392, "lat_deg": 36.3300, "above_ground_m": 150.0}


def ask(server: Server, dem: dict[str, Any]) -> httpx.Response:
    return server.client.post("/visibility-maps", json={"dem_id": dem["id"], "anchors": [ANCHOR]})


def is_degraded(health: dict[str, Any]) -> bool:
    return health["status"] == "degraded" and not health["store_writable"]


def test_a_database_that_another_program_holds_is_told_as_that_and_can_still_be_read(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=1) as server:
        dem = server.sample()
        other = sqlite3.connect(server.folder / "sightline.sqlite3", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        try:
            refused = ask(server, dem)
            assert refused.status_code == 503
            assert refused.json()["type"] == "/problems/store-locked"
            assert "database of the job store is locked by another program" in refused.json()["detail"]
            assert int(refused.headers["Retry-After"]) > 0
            assert server.client.get(dem["links"]["self"]).json() == dem
            server.until("/health", is_degraded, 20.0)
        finally:
            other.close()
        server.until("/health", lambda health: health["status"] == "ok", 20.0)
        assert ask(server, dem).status_code == 202


LINE = {"from_points_m": [[748_000.0, 4_024_000.0, 2000.0]], "to_points_m": [[748_100.0, 4_024_000.0, 2000.0]]}


def test_a_data_folder_that_is_deleted_is_told_by_health_and_refuses_all_that_writes(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=1) as server:
        dem = server.sample()
        shutil.rmtree(server.folder)
        small = b"ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2\n3 4\n"
        for refused in (
            ask(server, dem),
            server.client.post("/dems", params={"filename": "a.asc", "crs": "local"}, content=small),
            server.client.post("/dems", params={"sample": "valley"}),
            server.client.post("/lines-of-sight", json={"dem_id": dem["id"], **LINE}),
        ):
            assert refused.status_code == 503, refused.text
            assert refused.json()["type"] == "/problems/data-folder"
            assert "data folder" in refused.json()["detail"]
            assert refused.json()["detail"].endswith("restart the service.")
        server.until("/health", is_degraded, 20.0)
        assert server.client.get("/ready").status_code == 503
        assert server.client.get("/dems").status_code == 503


def test_a_data_folder_that_is_replaced_is_not_written(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=1) as server:
        dem = server.sample()
        shutil.copytree(server.folder, tmp_path / "copy")
        server.folder.rename(tmp_path / "moved")
        (tmp_path / "copy").rename(server.folder)
        refused = ask(server, dem)
        assert refused.status_code == 503
        assert "is not the one that the service started with" in refused.json()["detail"]
        server.until("/health", is_degraded, 20.0)
