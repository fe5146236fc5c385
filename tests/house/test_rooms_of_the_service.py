"""The rooms of the service know one another in one direction, and their JSON has types."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.house.repository import ROOT, imported_modules, modules

# room: the rooms that it may import besides itself; a module at the root of the service is a room of its own
MAY_KNOW = {
    "errors": set(),
    "error_roots": set(),
    "logs": set(),
    "machine": set(),
    "settings": {"logs", "machine"},
    "database": {"errors", "settings"},
    "estimates": {"errors", "settings"},
    "warm_up": {"settings", "products"},
    "access": {"errors", "settings"},
    "parts": {"errors"},
    "files": {"errors", "parts"},
    "drawing": {"errors", "parts"},
    "ground": {"errors", "settings", "parts", "files", "drawing"},
    "live": {"access", "errors", "settings", "parts", "files", "drawing"},
    "products": {"errors", "settings", "estimates", "parts", "files", "drawing"},
    "probes": {"errors", "estimates", "parts", "files", "products", "ground"},
    "missions": {"access", "database", "errors", "parts", "files"},
    "jobs": {
        "access",
        "database",
        "errors",
        "error_roots",
        "logs",
        "machine",
        "settings",
        "warm_up",
        "parts",
        "files",
        "drawing",
        "live",
        "products",
        "ground",
        "probes",
        "missions",
    },
    "http": {
        "access",
        "errors",
        "error_roots",
        "logs",
        "machine",
        "settings",
        "parts",
        "files",
        "live",
        "products",
        "ground",
        "probes",
        "missions",
        "jobs",
    },
    "cli": {
        "access",
        "errors",
        "error_roots",
        "settings",
        "warm_up",
        "parts",
        "files",
        "drawing",
        "live",
        "products",
        "ground",
        "missions",
        "jobs",
        "http",
    },
}
# what stores, calculates and serves products knows what a product is, and the list of them, but none of them by name
BY_THE_LIST_ALONE = ("jobs", "http")
PRODUCTS_IN_GENERAL = {"service.products", "service.products.registry"}

UNTYPED = re.compile(r"\bdict\[str, Any\]")
MOST_UNTYPED = 20
MOST_MODULES_OF_A_ROOM = 20


def room_of(name: str) -> str:
    return name.split(".")[1]


def modules_of(room: str) -> list[Path]:
    return [module for module in modules("service") if module.parts[1].removesuffix(".py") == room]


def ours(module: Path) -> set[str]:
    return {name for name in imported_modules(module) if name.startswith("service.")}


def test_every_room_of_the_service_is_known_to_the_house() -> None:
    found = {module.parts[1].removesuffix(".py") for module in modules("service")} - {"__init__"}
    assert found == set(MAY_KNOW)


@pytest.mark.parametrize("room", MAY_KNOW)
def test_a_room_imports_only_what_it_may_know(room: str) -> None:
    for module in modules_of(room):
        known = {room_of(name) for name in ours(module)}
        assert known <= {room, *MAY_KNOW[room]}, module


def test_no_two_rooms_know_each_other() -> None:
    assert [(one, other) for one, known in MAY_KNOW.items() for other in known if one in MAY_KNOW[other]] == []


@pytest.mark.parametrize("room", BY_THE_LIST_ALONE)
def test_products_are_known_by_their_list_alone(room: str) -> None:
    for module in modules_of(room):
        named = {name for name in ours(module) if room_of(name) == "products"}
        assert named <= PRODUCTS_IN_GENERAL, module


@pytest.mark.parametrize("room", MAY_KNOW)
def test_a_room_has_no_more_modules_than_a_reader_keeps_in_mind(room: str) -> None:
    folders = {module.parent for module in modules_of(room)}
    crowded = {folder.as_posix(): len(list((ROOT / folder).glob("*.py"))) for folder in folders}
    assert {folder: count for folder, count in crowded.items() if count > MOST_MODULES_OF_A_ROOM} == {}


def untyped_lines() -> list[str]:
    return [
        f"{module}:{number}: {line.strip()}"
        for module in modules("service")
        for number, line in enumerate((ROOT / module).read_text(encoding="utf-8").splitlines(), 1)
        if UNTYPED.search(line)
    ]


def test_json_without_a_type_is_rare() -> None:
    assert len(untyped_lines()) <= MOST_UNTYPED


def test_json_without_a_type_says_in_its_line_what_it_is_and_why() -> None:
    """As in ``fields: dict[str, Any]  # JSON of OpenAPI: the type is FastAPI's own``."""
    assert [line for line in untyped_lines() if not re.search(r"# JSON of [^:]+: \S", line)] == []
