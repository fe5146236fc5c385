"""Ground that takes long to make is followed, shared and ended, as all long work of the service is."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.access.callers import CALLER, Caller, Scope
from service.errors import JobCancelledError, RequestError
from service.ground.coverage import posts_about
from service.http.grounds import Grounds
from service.jobs.records import DemRecord
from terrain import Box, GroundLibrary, index_ground, plan_mosaic
from tests.service.http.test_bad_requests import assert_problem
from tests.service.http.test_ground import HEIGHTS, METRES, MIDDLE, tiles
from tests.service.running import Server
from tests.terrain.tiles.cutting import cut_tif

__all__ = ["tiles"]
DEM = DemRecord("d", "ground", 0.0, {})


def test_without_waiting_it_is_taken_in_and_followed_to_the_dem(server: Server, tiles: Path) -> None:
    area = {**MIDDLE, "radius_m": 750.0}
    asked = server.client.post("/dems", json={"area": area}, headers={"Prefer": "wait=0"})
    assert asked.status_code == 202, asked.text
    told = asked.json()
    assert (told["status"], told["links"]["self"]) == ("running", f"/dems/{told['id']}")
    assert asked.headers["Location"] == told["links"]["self"]
    assert (asked.headers["Retry-After"], asked.headers["Preference-Applied"]) == ("1", "wait=0")
    until = time.monotonic() + 60.0
    answer = server.client.get(asked.headers["Location"])
    while answer.status_code == 202 and time.monotonic() < until:
        assert 0.0 <= answer.json()["progress"] <= 1.0
        time.sleep(0.05)
        answer = server.client.get(asked.headers["Location"])
    assert answer.status_code == 200, answer.text
    assert (answer.json()["id"], answer.json()["driver"]) == (told["id"], "mosaic")
    again = server.client.post("/dems", json={"area": area}, headers={"Prefer": "wait=0"})
    assert (again.status_code, again.json()["id"]) == (200, told["id"])


def test_ground_under_way_can_be_ended(server: Server, tiles: Path) -> None:
    body = {"area": MIDDLE, "cell_m": 1.2}
    asked = server.client.post("/dems", json=body, headers={"Prefer": "wait=0"})
    assert asked.status_code == 202, asked.text
    told = asked.json()
    ended = server.client.delete(told["links"]["self"])
    assert (ended.status_code, ended.json()["status"]) == (200, "cancelled"), ended.text
    assert server.client.get(told["links"]["self"]).status_code == 404
    again = server.client.delete(told["links"]["self"])
    assert (again.status_code, again.json()["status"]) == (200, "cancelled"), "as of a job that was ended"
    assert told["id"] not in [dem["id"] for dem in server.client.get("/dems").json()["dems"]]


def test_what_names_a_dem_under_way_is_told_so(server: Server, tiles: Path) -> None:
    body = {"area": MIDDLE, "cell_m": 0.9}
    asked = server.client.post("/dems", json=body, headers={"Prefer": "wait=0"})
    assert asked.status_code == 202, asked.text
    here = asked.json()["links"]["self"]
    anchors = [{"id": "A", "lon_deg": MIDDLE["lon_deg"], "lat_deg": MIDDLE["lat_deg"], "above_ground_m": 50.0}]
    dem = {"dem_id": asked.json()["id"], "anchors": anchors}
    answers = [
        server.client.post("/visibility-maps", json=dem),
        server.client.post("/probe", json={**dem, "points": [{"lon_deg": 11.62, "lat_deg": 46.0}]}),
        server.client.get(f"{here}/levels"),
        server.client.get(f"{here}/hillshade.png"),
    ]
    if server.client.get(here).status_code == 202:  # it was under way all the time
        for answer in answers:
            assert_problem(answer, 409, "dem-under-way", f"is being made; ask again once GET {here} answers 200")
            assert answer.headers["Retry-After"] == "1"
    server.client.delete(here)


def test_more_posts_than_the_limit_are_refused_at_once(server: Server, tiles: Path) -> None:
    answer = server.client.post("/dems", json={"area": MIDDLE, "cell_m": 0.05})
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/dem-too-large"), answer.text


def test_what_was_never_asked_for_is_not_found(server: Server) -> None:
    for method in ("GET", "DELETE"):
        assert server.client.request(method, "/dems/0123456789abcdef0123456789abcdef").status_code == 404


def test_how_many_posts_a_plan_has_is_known_before_any_is_read(tmp_path: Path) -> None:
    """120 × 150 posts of 30 m: an area of 3 km by 2 km has 100 × 67 of them."""
    cut_tif(tmp_path, HEIGHTS, METRES, shared=True)
    library, _ = index_ground(GroundLibrary(), [tmp_path])
    area = Box(700_500.0, 5_097_000.0, 703_500.0, 5_099_000.0, "EPSG:32632")
    plan = plan_mosaic(library.tiles, area)
    assert posts_about(plan, None) == pytest.approx(100 * 67, rel=0.15)
    assert posts_about(plan, 60.0) == pytest.approx(50 * 33, rel=0.15)


def run(story: Callable[[Grounds], Any]) -> None:
    asyncio.run(story(Grounds()))


def test_two_who_ask_for_the_same_wait_for_one_making() -> None:
    async def story(grounds: Grounds) -> None:
        made, go = [], asyncio.Event()

        async def make(tell: Callable[[float], None]) -> DemRecord:
            made.append(1)
            tell(0.25)
            await go.wait()
            return DEM

        one, other = grounds.begin("d", make), grounds.begin("d", make)
        assert await one.wait(0.0) is None
        await asyncio.sleep(0)
        assert (one is other, one.progress, grounds.known("d")) == (True, 0.25, one)
        go.set()
        assert await asyncio.gather(one.wait(None), other.wait(5.0)) == [DEM, DEM]
        assert made == [1]
        assert grounds.known("d") is None  # from now on the store knows it

    run(story)


def test_what_a_tenant_has_under_way_is_not_there_for_another() -> None:
    async def story(grounds: Grounds) -> None:
        async def make(tell: Callable[[float], None]) -> DemRecord:
            await asyncio.sleep(3600.0)
            return DEM

        CALLER.set(Caller("alpha", "test", (Scope.CALCULATE,), "0" * 12))
        ground = grounds.begin("d", make)
        CALLER.set(Caller("beta", "test", (Scope.CALCULATE,), "0" * 12))
        assert grounds.known("d") is None
        assert await grounds.end("d") is None
        assert grounds.begin("d", make) is not ground
        await grounds.stop()
        assert ground.making.cancelled()

    run(story)


def test_who_waits_for_one_that_is_ended_hears_so() -> None:
    async def story(grounds: Grounds) -> None:
        async def make(tell: Callable[[float], None]) -> DemRecord:
            await asyncio.sleep(3600.0)
            return DEM

        ground = grounds.begin("d", make)
        waiting = asyncio.create_task(ground.wait(None))
        await asyncio.sleep(0)
        assert await grounds.end("d") is ground
        with pytest.raises(JobCancelledError):
            await waiting
        assert await grounds.end("d") is ground, "it stays ended, however often that is said"

    run(story)


def test_why_one_failed_is_told_until_it_is_asked_for_again() -> None:
    async def story(grounds: Grounds) -> None:
        async def fail(tell: Callable[[float], None]) -> DemRecord:
            raise RequestError("half a file")

        async def make(tell: Callable[[float], None]) -> DemRecord:
            return DEM

        ground = grounds.begin("d", fail)
        for _ in range(2):
            with pytest.raises(RequestError, match="half a file"):
                await ground.wait(None)
            with pytest.raises(RequestError, match="half a file"):
                ground.outcome()
            assert grounds.known("d") is ground
        assert await grounds.begin("d", make).wait(None) is DEM
        await grounds.stop()

    run(story)
