"""The OpenAPI document is complete, and the service does what it says."""

from __future__ import annotations

import asyncio
import json
import re
import threading
from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis import GenerationMode

from service.http.app import create_app
from service.http.meta import Document
from service.http.problems import MEDIA_TYPE
from service.settings import Settings
from tests.service.running import Server

METHODS = ("get", "post", "put", "patch", "delete", "head")
UNIT = re.compile(
    r"metre|degree|second|hertz|bytes|0\.\.1|no unit|number|how (many|often)|columns|rows|cells|posts|entries|lines|"
    r"anchors|dBm?|dBi|Hz|1/m|jobs|processes|radii|port|status",
    re.IGNORECASE,
)


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return create_app(Settings()).openapi()


def operations(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        for method, operation in item.items():
            if method in METHODS:
                yield path, method, operation


def test_every_operation_has_summary_description_and_tag(document: dict[str, Any]) -> None:
    tags = {tag["name"] for tag in document["tags"]}
    for path, method, operation in operations(document):
        assert operation["summary"], (method, path)
        assert operation["description"], (method, path)
        assert set(operation["tags"]) <= tags, (method, path)


def test_schemas_have_names_of_their_own(document: dict[str, Any]) -> None:
    # of two models with one name the document would tell the modules they come from
    assert [name for name in document["components"]["schemas"] if "__" in name] == []


def test_every_operation_tells_what_its_problems_look_like(document: dict[str, Any]) -> None:
    for path, method, operation in operations(document):
        errors = {status: answer for status, answer in operation["responses"].items() if int(status) >= 400}
        assert "500" in errors, (method, path)
        for status, answer in errors.items():
            assert list(answer["content"]) == [MEDIA_TYPE], (method, path, status)
            assert answer["content"][MEDIA_TYPE]["schema"] == {"$ref": "#/components/schemas/Problem"}
            assert "/problems/" in answer["description"]


def test_json_is_not_told_as_bytes(document: dict[str, Any]) -> None:
    for path, method, operation in operations(document):
        for status, answer in operation["responses"].items():
            for media_type, content in answer.get("content", {}).items():
                if "json" in media_type:
                    assert content["schema"].get("type") != "string", (method, path, status, media_type)


def test_requests_and_answers_come_with_examples(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    for name in (
        "VisibilityMapIn",
        "DopMapIn",
        "DopMapOut",
        "MorphingMapIn",
        "MorphingMapOut",
        "PathIn",
        "PathOut",
        "FlightIn",
        "FlightOut",
        "PlacementIn",
        "PlacementOut",
        "RepositioningIn",
        "RepositioningOut",
        "LinesOfSightIn",
        "SafetyBubblesIn",
        "AnchorIn",
        "DemOut",
        "VisibilityMapOut",
        "DetectionIn",
        "DetectorIn",
        "EpochIn",
        "EpochsIn",
        "DetectorSettingsIn",
        "Problem",
        "Health",
    ):
        assert schemas[name]["examples"], name
    assert "HTTPValidationError" not in schemas


def test_every_number_tells_its_unit_in_name_or_description(document: dict[str, Any]) -> None:
    without = []
    for name, schema in document["components"]["schemas"].items():
        for field, described in schema.get("properties", {}).items():
            kinds = {described.get("type"), *(option.get("type") for option in described.get("anyOf", []))}
            if kinds & {"number", "integer"}:
                named = re.search(r"_(m|s|deg|hz|bytes)$", field)
                if not named and not UNIT.search(described.get("description", "")):
                    without.append(f"{name}.{field}")
    assert without == []


def taken(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every schema that a request is held against, with the words for where it stands."""
    schemas = document["components"]["schemas"]
    seen = set[str]()

    def within(where: str, schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
        name = schema.get("$ref", "").removeprefix("#/components/schemas/")
        if name in seen:
            return
        if name:
            seen.add(name)
            where, schema = name, schemas[name]
        yield where, schema
        parts = [*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("allOf", ())]
        parts += [schema[of] for of in ("items", "additionalProperties") if isinstance(schema.get(of), dict)]
        for part in [*parts, *schema.get("prefixItems", ())]:
            yield from within(where, part)
        for field, part in schema.get("properties", {}).items():
            yield from within(f"{where}.{field}", part)

    for path, method, operation in operations(document):
        for parameter in operation.get("parameters", ()):
            yield from within(f"{method} {path}?{parameter['name']}", parameter["schema"])
        for content in operation.get("requestBody", {}).get("content", {}).values():
            yield from within(f"{method} {path}", content["schema"])


def test_every_whole_number_that_is_taken_fits_into_64_bits(document: dict[str, Any]) -> None:
    # those that do not end as a fault in SQLite, orjson and numba
    whole = {where: schema for where, schema in taken(document) if schema.get("type") == "integer"}
    assert len(whole) > 20
    low, high = ("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum")
    without = [
        where
        for where, schema in whole.items()
        if not {"enum", "const"} & set(schema)
        and not (
            any(schema.get(name, -(2**64)) >= -(2**63) for name in low)
            and any(schema.get(name, 2**64) <= 2**63 for name in high)
        )
    ]
    assert without == []


def test_every_reference_leads_somewhere(document: dict[str, Any]) -> None:
    references = set(re.findall(r"#/components/schemas/(\w+)", str(document)))
    assert references <= set(document["components"]["schemas"])


def test_what_an_answer_has_made_is_linked_to_all_that_goes_on_with_it(document: dict[str, Any]) -> None:
    """All paths below a collection that POST adds to, by the id in its answer."""
    paths = document["paths"]
    for path, item in paths.items():
        below = {
            operation["operationId"]
            for other, within in paths.items()
            if other.startswith(f"{path}/{{")
            for operation in within.values()
        }
        if "post" not in item or not below:
            continue
        made = [answer for status, answer in item["post"]["responses"].items() if status in ("200", "201", "202")]
        assert made, path
        for answer in made:
            assert below <= set(answer["links"]), path
            for name in below:
                link = answer["links"][name]
                assert link["operationId"] == name
                assert list(link["parameters"].values()) == ["$response.body#/id"]
    on_a_ground = paths["/dems"]["post"]["responses"]["201"]["links"]
    assert {"ask_for_visibility_map", "ask_for_dop_map", "read_places", "get_heights"} <= set(on_a_ground)


def test_the_document_is_made_once_and_not_by_the_event_loop() -> None:
    threads: list[int] = []

    def described() -> dict[str, Any]:
        threads.append(threading.get_ident())
        return {"openapi": "3.1.0"}

    async def ask() -> tuple[list[dict[str, Any]], list[bytes]]:
        document = Document(described)
        made = await asyncio.gather(*(document.made() for _ in range(5)), document.made())
        return made, [await document.written(root) for root in ("", "", "/sight")]

    made, written = asyncio.run(ask())
    assert made == [{"openapi": "3.1.0"}] * 6
    assert [json.loads(one) for one in written] == [
        {"openapi": "3.1.0"},
        {"openapi": "3.1.0"},
        {"openapi": "3.1.0", "servers": [{"url": "/sight"}]},
    ]
    assert len(threads) == 1
    assert threads[0] != threading.get_ident()


SCHEMA = schemathesis.openapi.from_dict(create_app(Settings()).openapi())
# a body beyond its limit is refused with 413, before anybody looks at what else is wrong with it
SCHEMA.config.checks.negative_data_rejection.expected_statuses.append("413")
OPERATIONS = {operation.label: operation for operation in (found.ok() for found in SCHEMA.get_all_operations())}


# A request may fit its schema and yet make no sense: two heights for one point, a file that is no DEM, no such id.
NOT_HELD = [schemathesis.checks.positive_data_acceptance]


# Where the only parameters are words in the path, nothing can be wrong with them.
CAN_BE_WRONG = [label for label, operation in OPERATIONS.items() if operation.query or operation.body]


@pytest.mark.parametrize(
    ("label", "mode"),
    [
        *((label, GenerationMode.POSITIVE) for label in OPERATIONS),
        *((label, GenerationMode.NEGATIVE) for label in CAN_BE_WRONG),
    ],
)
def test_whatever_is_sent_the_answer_is_as_documented(server: Server, label: str, mode: GenerationMode) -> None:
    @given(case=OPERATIONS[label].as_strategy(generation_mode=mode))
    @settings(max_examples=25, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
    def check(case: schemathesis.Case) -> None:
        case.call_and_validate(base_url=server.url, excluded_checks=NOT_HELD)

    check()
    assert server.client.get("/health").json()["status"] == "ok"
