"""A service with keys over HTTP: nobody without one, scopes, the login of the page, streams."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from service.access.callers import Scope
from service.access.keys import add_key, revoke_key
from service.jobs.marker import claimed
from service.live.request import ANCHORS
from tests.service.running import Server, command, environment, running

OPEN_PATHS = ("/", "/docs", "/openapi.json", "/ready", "/page/index.js", "/problems", "/problems/forbidden", "/login")


@dataclass(frozen=True)
class Guarded:
    """A service with keys, and one of each scope."""

    server: Server
    read: str
    calculate: str

    def ask(self, method: str, path: str, key: str | None, **more: object) -> httpx.Response:
        headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        return httpx.request(method, self.server.url + path, headers=headers, trust_env=False, timeout=60.0, **more)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    folder = claimed(tmp_path_factory.mktemp("guarded") / "data")
    texts = [add_key(folder / "keys.json", str(scope), "alpha", (scope,))[1] for scope in (Scope.READ, Scope.CALCULATE)]
    with running(folder, workers=1) as server:
        yield Guarded(server, *texts)


def test_every_operation_but_the_open_ones_wants_a_key_and_openapi_says_so(guarded: Guarded) -> None:
    openapi = guarded.ask("GET", "/openapi.json", None).json()
    assert openapi["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    asked = 0
    for path, item in openapi["paths"].items():
        for method, operation in item.items():
            answer = guarded.ask(method.upper(), path.replace("{", "").replace("}", ""), None)
            if operation.get("security") == []:
                assert answer.status_code in (200, 404), (method, path)
                continue
            assert answer.status_code == 401, (method, path)
            assert answer.headers["WWW-Authenticate"].startswith("Bearer")
            assert answer.json()["type"] == "/problems/unauthenticated"
            assert {"401", "403"} <= set(operation["responses"])
            asked += 1
    assert asked > 60


@pytest.mark.parametrize("path", OPEN_PATHS)
def test_what_tells_nothing_of_anybody_is_open(guarded: Guarded, path: str) -> None:
    assert guarded.ask("GET", path, None).status_code == 200


def test_a_key_that_does_not_hold_is_refused_with_a_sentence(guarded: Guarded) -> None:
    for wrong in ("x", guarded.read[:-1] + "_", "a.b.c"):
        answer = guarded.ask("GET", "/dems", wrong)
        assert (answer.status_code, answer.json()["detail"]) == (
            401,
            "The key is not known, has expired or was revoked.",
        )


def test_reading_does_not_calculate(guarded: Guarded) -> None:
    refused = guarded.ask("POST", "/dems?sample=valley", guarded.read)
    assert refused.status_code == 403
    assert refused.json()["type"] == "/problems/forbidden"
    assert "does not have the scope calculate" in refused.json()["detail"]
    dem = guarded.ask("POST", "/dems?sample=valley", guarded.calculate)
    assert dem.status_code in (200, 201)
    assert guarded.ask("GET", dem.headers["Location"], guarded.read).status_code == 200
    assert guarded.ask("DELETE", dem.headers["Location"], guarded.read).status_code == 403


def test_a_stream_wants_a_key_too_and_watching_only_that_it_may_read(guarded: Guarded) -> None:
    links = guarded.ask("POST", "/detectors", guarded.calculate, json={"anchors": ANCHORS}).json()["links"]
    url = f"{guarded.server.url.replace('http', 'ws', 1)}{links['stream']}"
    for key, query, status in ((None, "", 401), (None, "?watch=true", 401), (guarded.read, "", 403)):
        headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        with pytest.raises(InvalidStatus) as refused:
            connect(url + query, proxy=None, additional_headers=headers)
        assert refused.value.response.status_code == status
    for key, query in ((guarded.read, "?watch=true"), (guarded.calculate, "")):
        with connect(url + query, proxy=None, additional_headers={"Authorization": f"Bearer {key}"}) as stream:
            stream.ping()


def test_the_page_logs_in_with_a_key_and_out_again(guarded: Guarded) -> None:
    with httpx.Client(base_url=guarded.server.url, trust_env=False) as browser:
        own = {"Origin": guarded.server.url, "Sec-Fetch-Site": "same-origin"}
        wrong = browser.post("/login", data={"key": "<b>x</b>"}, headers=own)
        assert wrong.status_code == 401
        assert "The key is not known, has expired or was revoked." in wrong.text
        entered = browser.post("/login", data={"key": guarded.calculate}, headers=own)
        assert (entered.status_code, entered.headers["Location"]) == (303, "/")
        cookie = entered.headers["Set-Cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=strict" in cookie
        assert guarded.calculate not in cookie
        assert browser.get("/dems").status_code == 200
        assert browser.post("/dems?sample=valley", headers=own).status_code in (200, 201)
        # a page elsewhere has the cookie sent by no browser of today, and is refused where it is
        assert browser.post("/dems?sample=valley", headers={"Origin": "http://evil.example"}).status_code == 403
        assert browser.post("/login", data={"key": guarded.read}, headers={"Origin": "null"}).status_code == 403
        browser.cookies.set("sightline_session", browser.cookies["sightline_session"])
        assert browser.post("/logout", headers=own).status_code == 303
        assert browser.get("/dems").status_code == 401


def test_a_form_says_where_it_comes_from(guarded: Guarded) -> None:
    """Under no-referrer a browser sends `Origin: null` with a form, which would be refused."""
    login = guarded.ask("GET", "/login", None)
    assert login.headers["Referrer-Policy"] == "same-origin"
    assert "form-action 'self'" in login.headers["Content-Security-Policy"]


def test_a_key_that_is_revoked_ends_logins_and_requests(guarded: Guarded) -> None:
    place = guarded.server.folder / "keys.json"
    key, text = add_key(place, "guest", "alpha", (Scope.READ,))
    with httpx.Client(base_url=guarded.server.url, trust_env=False) as browser:
        guarded.server.until("/ready", lambda _: guarded.ask("GET", "/dems", text).status_code == 200, 10.0)
        assert browser.post("/login", data={"key": text}).status_code == 303
        assert browser.get("/dems").status_code == 200
        revoke_key(place, key.id)
        guarded.server.until("/ready", lambda _: guarded.ask("GET", "/dems", text).status_code == 401, 10.0)
        assert browser.get("/dems").status_code == 401


def serve(folder: Path, *words: str, **settings: object) -> subprocess.CompletedProcess[str]:
    """A service that is expected to end by itself."""
    return subprocess.run(
        [*command(), *words],
        env=environment(folder, **settings),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_off_loopback_it_does_not_start_without_keys(tmp_path: Path) -> None:
    ended = serve(tmp_path / "data", host="0.0.0.0")
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert "sightline keys add NAME" in ended.stderr
    assert "--insecure" in ended.stderr
    assert not (tmp_path / "data").exists()


def test_a_file_of_keys_that_makes_no_sense_is_no_open_door(tmp_path: Path) -> None:
    folder = claimed(tmp_path / "data")
    (folder / "keys.json").write_text("{}}", encoding="utf-8")
    ended = serve(folder)
    assert ended.returncode == 2
    assert "keys.json cannot be read: it is no file of keys." in ended.stderr


def keys(folder: Path, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "service.cli", "keys", *words, "--data", str(folder)],
        env=dict(os.environ),
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return done.stdout


def test_keys_are_made_listed_and_revoked_at_the_command_line(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    made = json.loads(keys(folder, "add", "rover 7", "--scope", "read", "--tenant", "alpha", "--days", "30", "--json"))
    assert made["key"].startswith(f"sightline_{made['id']}_")
    listed = json.loads(keys(folder, "list", "--json"))["keys"]
    assert [(one["name"], one["tenant"], one["scopes"]) for one in listed] == [("rover 7", "alpha", ["read"])]
    assert "key" not in listed[0]
    assert "sha256" not in listed[0]
    assert "holds no longer" in keys(folder, "revoke", made["id"])
    assert "There are no keys" in keys(folder, "list")
