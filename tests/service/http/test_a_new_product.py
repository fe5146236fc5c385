"""A new product is one object: named in a setting it is asked for, followed, downloaded and deleted as all others.

Its command is one function, named where the command line is started.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from service.cli import main
from service.http.app import create_app
from service.jobs.worker import rehearse
from service.products.registry import PRODUCTS, all_products
from service.settings import Settings
from tests.service.running import Server, running
from tests.service.small_maps import small_grid
from tests.service.toy_product import TOO_MUCH_M, warmed

TOY = "tests.service.toy_product:HIGH_GROUND"
TOY_COMMAND = {"high-ground": "tests.service.toy_command:high_ground"}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("toy") / "data"
    with running(folder, workers=1, rehearse="maps", more_products=json.dumps([TOY])) as started:
        yield started


@pytest.fixture(scope="module")
def dem_id(server: Server, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("dem") / "small.npz"
    np.savez(path, heights_m=small_grid().heights_m, cell_east_m=30.0, cell_north_m=20.0)
    return str(server.upload(path, crs="local")["id"])


def test_it_is_asked_for_followed_downloaded_and_deleted(server: Server, dem_id: str) -> None:
    asked = server.client.post("/high-grounds", json={"dem_id": dem_id, "above_m": 40.0}, headers={"Prefer": "wait=60"})
    assert asked.status_code == 201, asked.text
    here = asked.headers["Location"]
    told = server.client.get(here).json()
    assert told["result"]["posts"] == int((small_grid().heights_m > 40.0).sum())
    assert [layer["name"] for layer in told["layers"]] == ["posts.csv"]
    assert server.client.get(f"{here}/layers/posts.csv").text == f"posts\n{told['result']['posts']}\n"
    assert [one["id"] for one in server.client.get("/high-grounds").json()["high_grounds"]] == [told["id"]]
    assert server.client.delete(here).status_code == 204
    assert server.client.get(here).status_code == 404


def test_what_it_refuses_is_a_problem_before_a_job_exists(server: Server, dem_id: str) -> None:
    refused = server.client.post("/high-grounds", json={"dem_id": dem_id, "above_m": -1.0})
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/terrain")
    unknown = server.client.post("/high-grounds", json={"dem_id": dem_id, "above_m": 1.0, "below_m": 2.0})
    assert (unknown.status_code, unknown.json()["type"]) == (422, "/problems/validation")
    assert server.client.get("/high-grounds").json()["total"] == 0


def test_what_takes_too_much_by_its_estimate_is_refused_before_a_job_exists(server: Server, dem_id: str) -> None:
    refused = server.client.post("/high-grounds", json={"dem_id": dem_id, "above_m": TOO_MUCH_M})
    told = refused.json()
    assert (refused.status_code, told["type"]) == (422, "/problems/limit")
    assert told["limit_name"] == "max_worker_memory_bytes"
    assert told["detail"].startswith(f"{small_grid().heights_m.size:,} cells would take about 9.3e+08 GiB of memory")
    assert server.client.get("/high-grounds").json()["total"] == 0


def test_workers_warm_it_up_with_the_others() -> None:
    warmed.clear()
    rehearse("maps", all_products((TOY,)), first=False)
    assert len(warmed) == 1
    rehearse("maps", PRODUCTS, first=False)
    assert len(warmed) == 1


def test_openapi_has_its_routes_its_tag_and_its_models() -> None:
    document = create_app(Settings(more_products=(TOY,))).openapi()
    assert {path for path in document["paths"] if path.startswith("/high-grounds")} == {
        "/high-grounds",
        "/high-grounds/{job_id}",
        "/high-grounds/{job_id}/events",
        "/high-grounds/{job_id}/pin",
        "/high-grounds/{job_id}/request",
        "/high-grounds/{job_id}/layers/{layer}",
    }
    assert "High ground" in [tag["name"] for tag in document["tags"]]
    assert {"HighGroundIn", "HighGroundOut", "HighGroundList", "HighGroundSummary"} <= set(
        document["components"]["schemas"]
    )


def test_two_products_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="one name or one path"):
        all_products((TOY, TOY))


def sightline(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr(sys, "argv", ["sightline", *map(str, words)])
    with pytest.raises(SystemExit) as left:
        main(TOY_COMMAND)
    return int(str(left.value.code))


@pytest.mark.parametrize("by_file", [False, True])
def test_it_is_asked_for_on_the_command_line(
    by_file: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    dem, request, out = tmp_path / "small.npz", tmp_path / "request.json", tmp_path / "out"
    np.savez(dem, heights_m=small_grid().heights_m, cell_east_m=30.0, cell_north_m=20.0)
    request.write_text(json.dumps({"dem_id": "D", "above_m": 40.0}))
    asked = ("--request", request) if by_file else ("--above", 40)
    posts = int((small_grid().heights_m > 40.0).sum())
    for _ in range(2):  # the second run replaces what the first one wrote
        assert sightline(monkeypatch, "high-ground", dem, *asked, "--out", out, "--json") == 0
        said = capfd.readouterr()
        told = json.loads(said.out)
        assert (told["posts"], said.err != "") == (posts, by_file)
        assert {Path(name).name for name in told["files"]} == {"high_ground.json", "posts.csv"}
        assert (out / "posts.csv").read_text() == f"posts\n{posts}\n"
    assert sightline(monkeypatch, "high-ground", dem, *asked) == 0
    assert str(posts) in capfd.readouterr().out


def test_its_command_refuses_in_one_sentence_and_has_help(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert sightline(monkeypatch, "high-ground", tmp_path / "none.npz", "--above", "high") == 2
    assert capfd.readouterr().err == "Invalid value for '--above': 'high' is no number.\n"
    assert sightline(monkeypatch, "--help") == 0
    assert "Tell how much of a DEM lies higher than a height." in " ".join(capfd.readouterr().out.split())
