"""All products over HTTP, one after the other: asked, followed, listed, downloaded, deleted and refused alike."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.http.answers import JobOut
from service.products import Product
from service.products.registry import PRODUCTS
from tests.service.asked import ASKED
from tests.service.http.test_bad_requests import assert_problem
from tests.service.layer_files import assert_opens
from tests.service.running import Server

EVERY = pytest.mark.parametrize("product", PRODUCTS.values(), ids=list(PRODUCTS))
WAIT = {"Prefer": "wait=60"}


def posted(server: Server, product: Product, ground: dict[str, Any], wait: bool = True, **more: Any) -> httpx.Response:
    body = {"dem_id": ground["id"], **ASKED[product.name], **more}
    return server.client.post(product.path, json=body, headers=WAIT if wait else {}, timeout=120.0)


@pytest.fixture(scope="module")
def made(server: Server, ground: dict[str, Any]) -> dict[str, httpx.Response]:
    """The answer to the question of each product, with a wait."""
    return {name: posted(server, product, ground) for name, product in PRODUCTS.items()}


def listed(server: Server, product: Product) -> dict[str, dict[str, Any]]:
    page = server.client.get(product.path, params={"limit": 200}).json()
    assert page["total"] >= len(page[product.plural])
    return {entry["id"]: entry for entry in page[product.plural]}


@EVERY
def test_within_the_wait_the_answer_is_201_and_is_the_model_of_the_product(
    made: dict[str, httpx.Response], ground: dict[str, Any], product: Product
) -> None:
    answer = made[product.name]
    assert answer.status_code == 201, answer.text
    job = answer.json()
    assert answer.headers["Preference-Applied"] == "wait=60"
    assert answer.headers["Location"] == job["links"]["self"] == f"{product.path}/{job['id']}"
    assert (job["status"], job["progress"], job["attempts"], job["problem"]) == ("succeeded", 1.0, 1, None)
    told = product.answer.model_validate(job["result"]).model_dump(mode="json")
    assert told == job["result"]
    assert job["dem_id"] == job["request"]["dem_id"] == ground["id"]
    if "dem" in told:
        assert (told["dem"]["name"], told["dem"]["sha256"]) == ("small.npz", ground["sha256"])
    if "parameters" in told:
        assert told["parameters"].items() <= job["request"].items()


@EVERY
def test_it_is_found_as_it_was_answered_and_listed_without_what_is_long(
    server: Server, made: dict[str, httpx.Response], product: Product
) -> None:
    job = made[product.name].json()
    assert server.client.get(job["links"]["self"]).json() == job
    entry = listed(server, product)[job["id"]]
    assert entry == {name: value for name, value in job.items() if name in JobOut.model_fields}
    assert {"request", "result", "layers"} <= set(job) - set(entry)


def test_pages_lead_through_the_whole_list_whatever_is_new_meanwhile(server: Server, ground: dict[str, Any]) -> None:
    product = PRODUCTS["visibility-map"]
    asked = [posted(server, product, ground).json()["id"] for _ in range(4)]
    whole = [*listed(server, product)]
    assert whole[:4] == asked[::-1]
    seen, cursor = [], None
    while True:
        query = {"limit": 2} if cursor is None else {"limit": 2, "cursor": cursor}
        page = server.client.get(product.path, params=query).json()
        seen += [entry["id"] for entry in page["visibility_maps"]]
        cursor = page["next"]
        if cursor is None:
            break
        posted(server, product, ground)
    assert seen == whole
    dems = server.client.get("/dems", params={"limit": 1}).json()
    assert (dems["next"] is None) == (dems["total"] == 1)


@EVERY
def test_every_layer_downloads_as_what_it_claims_to_be_and_opens(
    server: Server, made: dict[str, httpx.Response], product: Product
) -> None:
    job = made[product.name].json()
    has = [one.name for one in product.layers if one.is_of(job["request"]) and one.is_in(job["result"])]
    assert [layer["name"] for layer in job["layers"]] == has
    for layer in job["layers"]:
        answer = server.client.get(layer["href"])
        assert answer.status_code == 200, (layer["name"], answer.text)
        assert answer.headers["Content-Type"] == layer["media_type"] == product.layer[layer["name"]].media_type
        assert layer["name"] in answer.headers["Content-Disposition"]
        assert_opens(product.layer[layer["name"]], answer.content)
        again = server.client.get(layer["href"], headers={"If-None-Match": answer.headers["ETag"]})
        assert (again.status_code, again.content) == (304, b"")
        part = server.client.get(layer["href"], headers={"Range": "bytes=0-3"})
        assert (part.status_code, part.content) == (206, answer.content[:4])
        head = server.client.head(layer["href"])
        assert (head.status_code, head.content) == (200, b"")
        assert int(head.headers["Content-Length"]) == len(answer.content)
    for name in {layer.name for layer in product.layers}.difference(has):
        assert server.client.get(f"{job['links']['self']}/layers/{name}").status_code == 404


@pytest.mark.parametrize("product", [one for one in PRODUCTS.values() if one.inline], ids=lambda one: one.name)
def test_what_is_long_is_in_the_answer_and_files_are_layers_under_their_older_paths(
    server: Server, made: dict[str, httpx.Response], product: Product
) -> None:
    job = made[product.name].json()
    assert product.inline is not None
    alone = server.client.get(f"{job['links']['self']}/layers/{product.inline.layer}")
    assert alone.json() == job[product.inline.name] != []
    assert job["files"] == [layer["href"].replace("/layers/", "/files/") for layer in job["layers"]]
    for file, layer in zip(job["files"], job["layers"], strict=True):
        assert server.client.get(file).content == server.client.get(layer["href"]).content
    assert_problem(server.client.get(f"{job['links']['self']}/files/secret.csv"), 404, "not-found", "secret.csv")


@EVERY
def test_without_a_wait_it_is_taken_in_followed_and_deleted_with_its_layers(
    server: Server, made: dict[str, httpx.Response], ground: dict[str, Any], product: Product
) -> None:
    taken = posted(server, product, ground, wait=False)
    assert (taken.status_code, int(taken.headers["Retry-After"]) >= 1) == (202, True), taken.text
    early = taken.json()
    assert early["status"] in ("queued", "running")
    assert (early["result"], early["layers"]) == (None, [])
    assert product.inline is None or early[product.inline.name] is None
    here = taken.headers["Location"]
    over = server.until_over(here)
    assert (over["status"], over["progress"]) == ("succeeded", 1.0)
    before = made[product.name].json()
    assert over["id"] != before["id"]
    for one in (over, before):  # the same question has the same answer
        del one["result"]["timing"]
    assert over["result"] == before["result"]
    assert over["id"] in listed(server, product)
    assert server.client.delete(here).status_code == 204
    for gone in (here, over["layers"][0]["href"]):
        assert_problem(server.client.get(gone), 404, "not-found", over["id"])
    assert_problem(server.client.delete(here), 404, "not-found", over["id"])
    assert over["id"] not in listed(server, product)
    # what another job holds in common with it stays
    assert server.client.get(before["layers"][0]["href"]).status_code == 200


@EVERY
def test_what_is_not_there_is_404(server: Server, made: dict[str, httpx.Response], product: Product) -> None:
    here = made[product.name].headers["Location"]
    assert_problem(server.client.get(f"{here}/layers/secret.tif"), 404, "not-found", "secret.tif")
    assert server.client.get(f"{here}/layers/..%2f..%2fsightline.sqlite3").status_code == 404
    layer = product.layers[0].name
    for path in (f"{product.path}/none", f"{product.path}/none/layers/{layer}"):
        assert_problem(server.client.get(path), 404, "not-found", "none")
    other = next(one for one in PRODUCTS.values() if one is not product)
    # a thing of one kind is none of another
    assert_problem(server.client.get(here.replace(product.path, other.path)), 404, "not-found", here.split("/")[-1])


@pytest.mark.parametrize("product", [one for one in PRODUCTS.values() if one.searches], ids=lambda one: one.name)
def test_a_search_that_is_over_cannot_be_ended_early(
    server: Server, made: dict[str, httpx.Response], product: Product
) -> None:
    here = made[product.name].headers["Location"]
    assert_problem(server.client.post(f"{here}/stop"), 409, "not-ready", "succeeded")
    assert_problem(server.client.post(f"{product.path}/none/stop"), 404, "not-found", "none")


@EVERY
def test_an_unknown_dem_is_404_and_ids_do_not_lead_out_of_the_folder(
    server: Server, ground: dict[str, Any], product: Product
) -> None:
    for dem_id in ("0" * 32, "..", "../../etc", "x", "\u0000", "é"):
        assert_problem(posted(server, product, ground, dem_id=dem_id), 404, "not-found", "DEM")


@EVERY
def test_a_field_that_is_not_known_is_named_and_no_job_exists(
    server: Server, ground: dict[str, Any], product: Product
) -> None:
    before = server.client.get(product.path).json()["total"]
    assert_problem(posted(server, product, ground, reciever=3), 422, "validation", "reciever")
    assert_problem(posted(server, product, ground, dem_id=7), 422, "validation", "dem_id")
    assert server.client.get(product.path).json()["total"] == before


@pytest.mark.parametrize("name", [one.name for one in PRODUCTS.values() if "run_on" in one.parameters.model_fields])
def test_a_cluster_that_is_not_set_up_is_refused_before_there_is_a_job(
    server: Server, ground: dict[str, Any], name: str
) -> None:
    product = PRODUCTS[name]
    before = server.client.get(product.path).json()["total"]
    answer = posted(server, product, ground, wait=False, run_on="cluster")
    assert_problem(answer, 422, "request", "SIGHTLINE_DASK_SCHEDULER")
    assert server.client.get(product.path).json()["total"] == before


BODIES = [b"", b"{", b"not json", b"\xff\xfe\x00", b"[" * 100_000, b'{"a":' * 50_000, b"null", b"[]", b'"words"', b"3"]
NO_NUMBERS = [f'{{"dem_id": "D", "{field}": {number}}}'.encode() for field in ("anchors", "pairs", "points_m")
              for number in ("NaN", "Infinity", "-Infinity", "1e999")]  # fmt: skip


@EVERY
def test_bodies_that_are_no_json_objects_are_refused(server: Server, product: Product) -> None:
    for body in [*BODIES, *NO_NUMBERS]:
        answer = server.client.post(product.path, content=body, headers={"Content-Type": "application/json"})
        assert answer.status_code in (400, 422), (body[:40], answer.text)
        assert answer.headers["Content-Type"] == "application/problem+json"
        assert answer.json()["type"] in ("/problems/validation", "/problems/not-json")
    assert server.client.get("/health").json()["status"] == "ok"


@EVERY
@pytest.mark.parametrize("media_type", ["text/csv", "application/x-www-form-urlencoded"])
def test_a_body_that_does_not_say_that_it_is_json_is_refused_with_415(
    server: Server, product: Product, media_type: str
) -> None:
    answer = server.client.post(product.path, content=b"{}", headers={"Content-Type": media_type})
    assert_problem(answer, 415, "media-type", "application/json")


@EVERY
def test_a_json_body_over_the_limit_is_refused_with_413(server: Server, product: Product) -> None:
    name, megabytes = ("SIGHTLINE_MAX_PAIRS_BYTES", 64) if product.long_body else ("SIGHTLINE_MAX_JSON_BYTES", 2)
    body = b'{"dem_id": "' + b"x" * (megabytes * 1024 * 1024) + b'"}'
    answer = server.client.post(product.path, content=body, headers={"Content-Type": "application/json"})
    problem = assert_problem(answer, 413, "body-too-large", name)
    assert problem["limit"] == megabytes * 1024 * 1024
