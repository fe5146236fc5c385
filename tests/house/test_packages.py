"""Each package root is the public list of what the package offers, and the distribution carries every package."""

from __future__ import annotations

import importlib
import re
import types
from fnmatch import fnmatch
from pathlib import Path

import pytest

from tests.house.repository import PACKAGES, ROOT, modules, pyproject


def reading_order(name: str) -> tuple[int, str]:
    """CONSTANTS first, then Classes, then functions, each alphabetically."""
    kind = 0 if name.isupper() else 1 if name[0].isupper() else 2
    return kind, name


@pytest.mark.parametrize("package", PACKAGES)
def test_the_root_lists_its_public_names_completely_and_in_order(package: str) -> None:
    root = importlib.import_module(package)
    listed = list(getattr(root, "__all__", []))
    public = {
        name
        for name, value in vars(root).items()
        if not name.startswith("_") and not isinstance(value, types.ModuleType) and name != "annotations"
    }
    assert set(listed) == public
    assert listed == sorted(listed, key=reading_order)
    assert len(listed) == len(set(listed))


@pytest.mark.parametrize("package", PACKAGES)
def test_every_module_exports_only_names_that_exist(package: str) -> None:
    for path in modules(package):
        if path.name == "__main__.py":
            continue
        dotted = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
        module = importlib.import_module(dotted)
        missing = [name for name in getattr(module, "__all__", []) if not hasattr(module, name)]
        assert not missing, f"{dotted}.__all__ names {missing}"


def packages_on_disk() -> set[str]:
    return {".".join(path.parent.parts) for package in PACKAGES for path in modules(package)}


def test_the_distribution_carries_every_package_on_disk() -> None:
    how = pyproject()["tool"]["setuptools"]["packages"]["find"]
    assert how["namespaces"] is False
    others = {".".join(path.parent.relative_to(ROOT).parts) for path in (ROOT / "tests").rglob("__init__.py")}
    every = {*packages_on_disk(), *others, "benchmarks"}
    assert {name for name in every if any(fnmatch(name, like) for like in how["include"])} == packages_on_disk()


def test_every_package_folder_is_a_package() -> None:
    assert [name for name in packages_on_disk() if not (ROOT / Path(*name.split(".")) / "__init__.py").is_file()] == []


def test_every_top_level_package_is_known_to_the_house() -> None:
    known = {*PACKAGES, "tests", "benchmarks", "docs", "build"}
    found = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert found <= known


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_says_that_it_is_typed(package: str) -> None:
    assert (ROOT / package / "py.typed").is_file()


def test_visibility_has_few_names_at_its_root_and_shows_each_in_the_pages_for_python() -> None:
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    names = importlib.import_module("visibility").__all__
    assert [name for name in names if not re.search(rf"\b{name}\b", page)] == []
    assert len(names) <= 32, "the others belong to its rooms"


def rooms_of_visibility() -> list[str]:
    return sorted(path.parent.name for path in (ROOT / "visibility").glob("*/__init__.py"))


@pytest.mark.parametrize("room", rooms_of_visibility())
def test_a_room_of_visibility_lists_its_public_names_in_order(room: str) -> None:
    module = importlib.import_module(f"visibility.{room}")
    listed = list(module.__all__)
    assert listed
    assert listed == sorted(set(listed), key=reading_order)
    assert [name for name in listed if not hasattr(module, name)] == []
