"""Whatever is asked of any resource, with extreme numbers and texts, is answered: never a 500, never a dead worker.

Operations and bodies come from the service's own OpenAPI, so that what is new is asked as well. SIGHTLINE_FUZZ sets how
many requests of each operation; before a release it is 700, which makes more than ten thousand.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.http.app import create_app
from service.settings import Settings
from tests.fuzzing.grounds import BUDGET, CHANGES, made_ids
from tests.fuzzing.schemas import changed, resolved, texts, values
from tests.service.running import Server, running

EXAMPLES = int(os.environ.get("SIGHTLINE_FUZZ", "12"))
DOCUMENT = create_app(Settings()).openapi()
MOST_WITHOUT_BODY = 40
# of preconditions, kinds of content and the like
HEADERS = ("*", '"1"', 'W/"1"', "-1", "1e400", ", ,")


def operations() -> list[tuple[str, str]]:
    return [
        (method, path)
        for path, item in DOCUMENT["paths"].items()
        for method in item
        if not path.endswith("/stop") or method != "get"
    ]


def body_schema(method: str, path: str) -> dict[str, Any] | None:
    content = DOCUMENT["paths"][path][method].get("requestBody", {}).get("content", {})
    return content.get("application/json", {}).get("schema")


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("fuzzing") / "data"
    with running(folder, max_job_s=60, max_file_task_s=60, max_worker_memory_bytes=2 * 1024**3) as server:
        yield server


@pytest.fixture(scope="module")
def known(server: Server, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    return made_ids(server, tmp_path_factory.mktemp("grounds"), DOCUMENT)


def assert_no_fault(answer: Any) -> None:
    assert answer.status_code < 500 or answer.status_code in (503, 507), f"{answer.request.url}: {answer.text[:2000]}"
    if answer.status_code >= 400:
        assert answer.headers["Content-Type"] == "application/problem+json", answer.text[:500]
        assert answer.json()["detail"], answer.text[:500]


@pytest.mark.timeout(7200)
@pytest.mark.parametrize(("method", "path"), operations(), ids=lambda value: str(value))
def test_a_request_is_answered_or_refused(server: Server, known: dict[str, list[str]], method: str, path: str) -> None:
    statuses: Counter[int] = Counter()
    operation, schema = DOCUMENT["paths"][path][method], body_schema(method, path)

    model: dict[str, Any] = {} if schema is None else dict(resolved(schema, DOCUMENT))
    changes = CHANGES.get(schema["$ref"].rsplit("/", 1)[1], {}) if schema else {}
    examples = [{**example, **changes} for example in model.get("examples", [])]
    for example in examples:
        here = {"dem_id": known["dem_id"][0]} if "dem_id" in model.get("required", ()) else {}
        good_path = path.replace("/paths/{job_id}", "/paths/{path_id}")
        for name, ids in known.items():
            good_path = good_path.replace("{" + name + "}", ids[0])
        wanted = {"Prefer": "wait=60", "If-Match": "*"}
        answer = server.client.request(method, good_path, json={**example, **here}, headers=wanted)
        if path == "/dems":  # this service's library of ground is empty
            assert answer.json()["type"] == ("/problems/not-found" if "tile" in example else "/problems/no-ground")
            continue
        assert answer.status_code in (200, 201, 204), answer.text[:500]
        for href in files_of(answer):
            # the mission of the documentation stands on a ground that is not here
            assert server.client.get(href).status_code in ((200, 409) if path == "/missions" else (200,)), href

    @settings(
        max_examples=EXAMPLES if schema else min(EXAMPLES, MOST_WITHOUT_BODY),
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    @given(data=st.data())
    def ask(data: st.DataObject) -> None:
        asked_path, query, headers = path, {}, {"Prefer": "wait=30"}
        for parameter in operation.get("parameters", []):
            name, place = parameter["name"], parameter["in"]
            ids = known["path_id"] if path.startswith("/paths/") else known.get(name, known["map_id"])
            if place == "path":
                some = data.draw(st.one_of(st.sampled_from(ids), texts()) if method != "delete" else texts())
                asked_path = asked_path.replace("{" + name + "}", quote(some, safe="") or "-")
            elif place == "query" and data.draw(st.booleans()):
                query[name] = str(data.draw(values(parameter["schema"], DOCUMENT)))
            elif place == "header" and data.draw(st.booleans()):
                headers[name] = data.draw(st.sampled_from(HEADERS))
        if schema is None:
            assert_no_fault(server.client.request(method, asked_path, params=query, headers=headers))
            return
        fresh = values(schema, DOCUMENT)
        body = data.draw(st.one_of(*[changed(one, schema, DOCUMENT) for one in examples for _ in range(3)], fresh))
        if isinstance(body, dict) and "dem_id" in model["properties"]:
            body["dem_id"] = data.draw(st.sampled_from([known["dem_id"][0]] * 3 + known["dem_id"]))
        if isinstance(body, dict) and "map_id" in body and data.draw(st.booleans()):
            body["map_id"] = data.draw(st.sampled_from(known["map_id"]))
        if isinstance(body, dict) and "budget" in model["properties"]:
            body.setdefault("budget", BUDGET)
        answer = server.client.request(method, asked_path, json=body, params=query, headers=headers)
        assert_no_fault(answer)
        statuses[answer.status_code] += 1
        if answer.status_code == 201:
            assert_files_are_there(server, answer, data)
        if answer.status_code == 202 or answer.status_code == 201:
            server.client.delete(answer.headers["Location"])

    ask()
    print(f"{method} {path}: {dict(statuses)}")
    assert server.client.get("/health").json()["status"] == "ok"


def files_of(answer: httpx.Response) -> list[str]:
    """Where the files of a result are."""
    made = answer.json() if answer.headers.get("Content-Type") == "application/json" else None
    told = made if isinstance(made, dict) else {}
    files = [file if isinstance(file, str) else file["href"] for file in told.get("files", [])]
    return [layer["href"] for layer in told.get("layers", [])] + files


def assert_files_are_there(server: Server, made: httpx.Response, data: st.DataObject) -> None:
    """Some of the files of a result can be had."""
    hrefs = files_of(made)
    for href in data.draw(st.lists(st.sampled_from(hrefs), max_size=3, unique=True)) if hrefs else []:
        assert_no_fault(server.client.get(href))
