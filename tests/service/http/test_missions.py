"""Missions over HTTP: kept, listed, saved against a version, gone back to, shared as files."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from service.missions.bundle import MISSION_FILE
from tests.service.running import Server, running


def ground_of(dem: dict[str, Any]) -> dict[str, str]:
    return {"dem_id": dem["id"], "name": dem["name"], "sha256": dem["sha256"]}


def mission_on(dem: dict[str, Any], name: str = "Valley") -> dict[str, Any]:
    west, south = dem["bounds_of_posts_m"]["west"], dem["bounds_of_posts_m"]["south"]
    place = {"east_m": west + 900.0, "north_m": south + 900.0}
    anchor = {"id": "D1", "kind": "drone", "height_m": 120.0, "height_from": "above_ground_m", **place}
    return {"format": "sightline-mission", "version": 1, "name": name, "ground": ground_of(dem), "anchors": [anchor]}


def kept(server: Server, mission: dict[str, Any], **query: str) -> dict[str, Any]:
    answer = server.client.post("/missions", json=mission, params=query)
    assert answer.status_code == 201, answer.text
    assert answer.headers["location"] == answer.json()["links"]["self"]
    assert answer.headers["etag"] == '"1"'
    return dict(answer.json())


def save(server: Server, told: dict[str, Any], mission: dict[str, Any], version: str, **query: str) -> Any:
    return server.client.put(told["links"]["self"], json=mission, headers={"If-Match": version}, params=query)


def test_a_mission_is_kept_as_it_was_sent_and_is_listed_without_its_document(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    told = kept(server, mission_on(jacksboro, "First crossing"), by="Ada")
    opened = server.client.get(told["links"]["self"])
    assert opened.headers["etag"] == '"1"'
    document = opened.json()["mission"]
    assert document | mission_on(jacksboro, "First crossing") | {"anchors": document["anchors"]} == document
    assert document["rover"]["max_slope_deg"] == 25.0, "what was left out has its first value"
    summary = {"id": told["id"], "name": "First crossing", "version": 1, "anchors": 1, "saved_by": "Ada"}
    assert opened.json() | summary | {"dem_id": jacksboro["id"]} == opened.json()
    page = server.client.get("/missions?limit=1").json()
    assert page["total"] >= 1
    assert page["missions"][0] | summary == page["missions"][0]
    assert "mission" not in page["missions"][0]
    assert server.client.get(told["links"]["self"], headers={"If-None-Match": '"1"'}).status_code == 304


def test_whoever_saves_on_an_older_version_is_told_by_whom_when_and_which(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    told = kept(server, mission_on(jacksboro))
    saved = save(server, told, mission_on(jacksboro, "by Ada"), '"1"', by="Ada")
    assert (saved.status_code, saved.headers["etag"], saved.json()["version"]) == (200, '"2"', 2)
    late = save(server, told, mission_on(jacksboro, "by Bob"), '"1"', by="Bob")
    problem = late.json()
    assert (late.status_code, problem["type"]) == (412, "/problems/edit-conflict")
    assert problem["detail"].startswith("The mission was saved as version 2 by Ada on ")
    assert "yours builds on version 1" in problem["detail"]
    assert (problem["version"], problem["saved_by"]) == (2, "Ada")
    assert server.client.get(told["links"]["self"]).json()["name"] == "by Ada"
    unsaid = server.client.put(told["links"]["self"], json=mission_on(jacksboro))
    assert (unsaid.status_code, unsaid.json()["type"]) == (428, "/problems/no-precondition")
    assert save(server, told, mission_on(jacksboro, "by Bob"), "*", by="Bob").json()["version"] == 3


def test_saving_what_is_there_already_makes_no_version(server: Server, jacksboro: dict[str, Any]) -> None:
    told = kept(server, mission_on(jacksboro))
    again = save(server, told, mission_on(jacksboro), '"1"')
    assert (again.status_code, again.json()["version"]) == (200, 1)
    named = save(server, told, mission_on(jacksboro), '"1"', version_name="as briefed")
    assert named.json()["version"] == 2


def test_versions_are_listed_opened_named_and_gone_back_to(server: Server, jacksboro: dict[str, Any]) -> None:
    told = kept(server, mission_on(jacksboro, "one"))
    save(server, told, mission_on(jacksboro, "two"), '"1"')
    first = server.client.get(f"{told['links']['self']}/versions").json()["versions"][-1]
    assert server.client.get(first["links"]["self"]).json()["mission"]["name"] == "one"
    named = server.client.put(f"{first['links']['self']}/name", json={"name": "before the rain"}).json()
    assert named["name"] == "before the rain"
    restored = server.client.post(first["links"]["restore"], headers={"If-Match": '"2"'})
    assert (restored.status_code, restored.headers["etag"]) == (200, '"3"')
    versions = server.client.get(told["links"]["versions"]).json()["versions"]
    assert [(one["version"], one["name"]) for one in versions] == [(3, None), (2, None), (1, "before the rain")]
    assert server.client.get(told["links"]["self"]).json()["mission"]["name"] == "one"
    late = server.client.post(first["links"]["restore"], headers={"If-Match": '"2"'})
    assert late.status_code == 412


def test_a_mission_is_deleted_with_its_versions(server: Server, jacksboro: dict[str, Any]) -> None:
    told = kept(server, mission_on(jacksboro))
    assert server.client.delete(told["links"]["self"], headers={"If-Match": '"7"'}).status_code == 412
    assert server.client.delete(told["links"]["self"]).status_code == 204
    for path in (told["links"]["self"], told["links"]["versions"], f"{told['links']['self']}/versions/1"):
        assert server.client.get(path).status_code == 404
    assert save(server, told, mission_on(jacksboro), '"1"').status_code == 404


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"anchors": [{"id": "D1"}]}, "anchors[0].east_m: Field required"),
        ({"colour": "red"}, "colour"),
        ({"version": 2}, "version"),
        ({"ground": None}, "needs its ground"),
        ({"rover": {"max_slope_deg": 120.0}}, "max_slope_deg"),
    ],
)
def test_what_is_no_mission_is_refused_in_one_sentence(
    server: Server, jacksboro: dict[str, Any], change: dict[str, Any], words: str
) -> None:
    answer = server.client.post("/missions", json=mission_on(jacksboro) | change)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]


@pytest.mark.parametrize("name", ["a\x00b", "two\nlines", "\x1b[31mred", "turned \u202e round", "\ufeffmarked"])
def test_names_that_hide_something_are_refused(server: Server, jacksboro: dict[str, Any], name: str) -> None:
    answer = server.client.post("/missions", json=mission_on(jacksboro, name))
    assert answer.status_code == 422
    assert "a name has no control characters" in answer.json()["detail"]
    told = kept(server, mission_on(jacksboro, "Grüne Höhe 山 🚁"))
    for query in ({"version_name": name}, {"by": name}):
        assert save(server, told, mission_on(jacksboro, "other"), '"1"', **query).status_code == 422
    named = server.client.put(f"{told['links']['self']}/versions/1/name", json={"name": name})
    assert named.status_code == 422
    assert server.client.get(told["links"]["self"]).json()["name"] == "Grüne Höhe 山 🚁"


def test_two_anchors_of_one_id_are_refused(server: Server, jacksboro: dict[str, Any]) -> None:
    mission = mission_on(jacksboro)
    answer = server.client.post("/missions", json=mission | {"anchors": 2 * mission["anchors"]})
    assert "must be unique; repeated: D1" in answer.json()["detail"]


def test_a_mission_goes_to_another_service_with_its_ground_and_back(
    server: Server, ground: dict[str, Any], tmp_path: Path
) -> None:
    told = kept(server, mission_on(ground, "Wall"))
    packed = server.client.get(f"{told['links']['self']}/files/mission.zip")
    assert packed.headers["content-type"] == "application/zip"
    plain = server.client.get(f"{told['links']['self']}/files/mission.json").content
    assert json.loads(plain) == server.client.get(told["links"]["self"]).json()["mission"]
    with running(tmp_path / "data", workers=1, spare_workers=0, rehearse="maps") as other:
        alone = other.client.post("/missions", content=plain, headers={"Content-Type": "application/json"}).json()
        assert (alone["dem_id"], alone["ground"]) == (None, ground["name"])
        whole = other.client.post("/missions", files={"file": ("wall.zip", packed.content)})
        assert whole.status_code == 201, whole.text
        (sentence,) = whole.json()["told"]
        assert "came along" in sentence
        dem = other.client.get(f"/dems/{whole.json()['dem_id']}").json()
        assert (dem["sha256"], dem["name"]) == (ground["sha256"], ground["name"])
        # the mission that came without its ground stands on it now
        assert other.client.get(alone["links"]["self"]).json()["dem_id"] == dem["id"]
        again = other.client.get(f"{whole.json()['links']['self']}/files/mission.zip").content
        assert zipfile.ZipFile(io.BytesIO(again)).read(MISSION_FILE) == zipfile.ZipFile(
            io.BytesIO(packed.content)
        ).read(MISSION_FILE)
    back = server.client.post("/missions", content=again, headers={"Content-Type": "application/zip"}).json()
    assert "was here already" in back["told"][0]
    assert back["dem_id"] == ground["id"]


def zipped(**members: bytes) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name.replace("__", "."), content)
    return made.getvalue()


@pytest.mark.parametrize(
    ("content", "status", "words"),
    [
        (b"no mission at all", 400, "not valid JSON"),
        (zipped(readme__txt=b"hello"), 422, "holds no mission.json"),
        (zipped(mission__json=b"{}", other__txt=b"hello"), 422, "'other.txt'"),
        (zipped(mission__json=b" " * 3_000_000), 422, "mission.json unpacks to more than the limit"),
        (zipped(mission__json=b"{}")[:-30], 400, "not valid JSON"),
    ],
)
def test_a_file_that_is_no_mission_is_refused(server: Server, content: bytes, status: int, words: str) -> None:
    answer = server.client.post("/missions", content=content, headers={"Content-Type": "application/zip"})
    assert answer.status_code == status, answer.text
    assert words in answer.json()["detail"]


def test_missions_outlive_a_kill_and_have_limits(tmp_path: Path) -> None:
    quick: dict[str, Any] = {"workers": 1, "spare_workers": 0, "rehearse": "maps"}
    with running(tmp_path / "data", **quick) as first:
        told = kept(first, {"name": "kept"})
        save(first, told, {"name": "kept on"}, '"1"', by="Ada", version_name="as driven")
        first.kill()
    limits = {"max_missions": 1, "max_mission_bytes": 2048, "max_mission_versions": 2}
    with running(tmp_path / "data", **quick, **limits) as second:
        opened = second.client.get(told["links"]["self"]).json()
        assert (opened["name"], opened["version"], opened["version_name"]) == ("kept on", 2, "as driven")
        full = second.client.post("/missions", json={"name": "one too many"})
        assert (full.status_code, full.json()["limit_name"]) == (422, "max_missions")
        long = save(
            second, told, {"name": "x" * 100, "route": {"way_points": 99 * [{"east_m": 1.0, "north_m": 2.0}]}}, "*"
        )
        assert (long.status_code, "SIGHTLINE_MAX_MISSION_BYTES" in long.json()["detail"]) == (413, True)
        for number in range(5):
            assert save(second, told, {"name": f"draft {number}"}, "*").status_code == 200
        versions = second.client.get(told["links"]["versions"]).json()["versions"]
        # the first and the newest without names, and the one with a name
        assert [(one["version"], one["name"]) for one in versions] == [(7, None), (2, "as driven"), (1, None)]


@pytest.mark.parametrize(
    ("name", "saved"),
    [
        ("Drill 7", "filename*=utf-8''Drill%207.mission.json"),
        ("Drill-7", 'filename="Drill-7.mission.json"'),
        ('a/b\\c:"d".', 'filename="a_b_c_d_.mission.json"'),
        ("Übung", "filename*=utf-8''%C3%9Cbung.mission.json"),
        ("..", 'filename="mission.mission.json"'),
    ],
)
def test_a_downloaded_mission_is_saved_under_its_name(server: Server, name: str, saved: str) -> None:
    told = kept(server, {"format": "sightline-mission", "version": 1, "name": name})
    answer = server.client.get(f"{told['links']['self']}/files/mission.json")
    assert answer.headers["Content-Disposition"] == f"attachment; {saved}"
    assert answer.json()["name"] == name
