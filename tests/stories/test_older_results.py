"""Results that an older Sightline stored are still found, listed and downloaded."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from tests.service.running import running

ANCHOR = {"id": "D1", "lon_deg": -84.2392, "lat_deg": 36.3300, "above_ground_m": 150.0}
POINTS = [{"east_m": 748_000.0, "north_m": 4_024_000.0, "altitude_m": 2000.0 + n} for n in range(2)]


def forget(database: Path, field: str) -> None:
    """Take a field out of every stored result, as if it were written before the field existed."""
    connection = sqlite3.connect(database)
    for job_id, summary in connection.execute("SELECT id, summary FROM jobs").fetchall():
        older: dict[str, Any] = json.loads(summary)
        del older[field]
        connection.execute("UPDATE jobs SET summary = ? WHERE id = ?", (json.dumps(older), job_id))
    connection.commit()
    connection.close()


@pytest.mark.parametrize(
    ("place", "asked", "field", "file"),
    [
        ("/visibility-maps", {"anchors": [ANCHOR]}, "undecided_posts", "layers/count.tif"),
        ("/lines-of-sight", {"pairs": [{"from": POINTS[0], "to": POINTS[1]}]}, "curvature", "files/lines.json"),
    ],
)
def test_a_result_without_a_field_that_came_later_is_told_as_it_is(
    tmp_path: Path, place: str, asked: dict[str, Any], field: str, file: str
) -> None:
    with running(tmp_path / "data", workers=1) as server:
        request = {"dem_id": server.sample()["id"], **asked}
        answer = server.client.post(place, json=request, headers={"Prefer": "wait=60"})
        assert answer.status_code == 201, answer.text
        path, new = answer.headers["Location"], answer.json()
    forget(tmp_path / "data" / "sightline.sqlite3", field)
    with running(tmp_path / "data", workers=1) as server:
        older = server.client.get(path)
        assert older.status_code == 200, older.text
        expected = {name: value for name, value in new["result"].items() if name != field}
        assert older.json() == {**new, "result": expected}
        (listed,) = server.client.get(place).json()[place.strip("/").replace("-", "_")]
        assert listed["result"] == expected
        assert server.client.get(f"{path}/{file}").status_code == 200
