"""A service whose store is on a PostgreSQL server that goes away, comes back, and loses nothing."""

from __future__ import annotations

import signal
from pathlib import Path

from tests.service.postgres import postgres_server
from tests.service.running import running

ANCHOR = {"id": "D1", "lon_deg": -84.2392, "lat_deg": 36.3300, "above_ground_m": 150.0}


def test_the_server_of_the_store_is_killed_and_nothing_is_lost(tmp_path: Path) -> None:
    with postgres_server() as postgres:
        settings = {"workers": 1, "rehearse": "maps", "database_url": postgres.new_database()}
        with running(tmp_path / "data", **settings) as server:
            dem = server.sample()
            asked = {"dem_id": dem["id"], "anchors": [ANCHOR]}
            first = server.client.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"}).json()
            assert first["status"] == "succeeded"
            begun = server.client.post("/visibility-maps", json={**asked, "anchors": [{**ANCHOR, "id": "D2"}]}).json()
            postgres.stop(signal.SIGQUIT)
            refused = server.client.post("/visibility-maps", json=asked)
            assert (refused.status_code, refused.json()["type"]) == (503, "/problems/store-server")
            assert int(refused.headers["Retry-After"]) > 0
            server.until("/health", lambda health: not health["store_writable"], 20.0)
            assert server.client.get("/ready").status_code == 503
            postgres.start()
            server.until("/health", lambda health: health["status"] == "ok", 20.0)
            assert server.until_over(begun["links"]["self"])["status"] == "succeeded"
            server.kill()
        with running(tmp_path / "data", **settings) as server:
            listed = server.client.get("/visibility-maps").json()
            assert [job["id"] for job in listed["visibility_maps"]] == [begun["id"], first["id"]]
            assert server.client.get(first["links"]["self"]).json()["result"] == first["result"]
            assert server.client.get("/dems").json()["total"] == 1
            assert not (tmp_path / "data" / "sightline.sqlite3").exists()
