"""Each package's error tree is drawn at the head of its errors.py, and the drawing is the truth."""

from __future__ import annotations

import importlib
import inspect

import pytest

from tests.house.repository import PACKAGES, ROOT

WITH_ERRORS = [package for package in PACKAGES if (ROOT / package / "errors.py").is_file()]


def drawn_tree(docstring: str) -> dict[str, str | None]:
    """Each drawn class name with the name of its parent, None at a root."""
    parents: dict[str, str | None] = {}
    ancestors: list[tuple[int, str]] = []
    for line in docstring.splitlines():
        name = line.lstrip("│├└─ ").split(" ")[0]
        depth = len(line) - len(line.lstrip("│├└─ "))
        if not name.isidentifier() or not name.endswith("Error"):
            continue
        while ancestors and ancestors[-1][0] >= depth:
            ancestors.pop()
        parents[name] = ancestors[-1][1] if ancestors else None
        ancestors.append((depth, name))
    return parents


@pytest.mark.parametrize("package", WITH_ERRORS)
def test_the_drawing_names_every_error_under_its_true_parent(package: str) -> None:
    module = importlib.import_module(f"{package}.errors")
    errors = {
        name: value
        for name, value in vars(module).items()
        if inspect.isclass(value) and issubclass(value, Exception) and value.__module__ == module.__name__
    }
    drawn = drawn_tree(module.__doc__ or "")
    assert set(drawn) == set(errors) == set(module.__all__)
    for name, parent in drawn.items():
        if parent is not None:
            assert parent in {base.__name__ for base in errors[name].__bases__}, name


@pytest.mark.parametrize("package", WITH_ERRORS)
def test_one_root_error_catches_everything_the_package_raises_on_purpose(package: str) -> None:
    drawn = drawn_tree(importlib.import_module(f"{package}.errors").__doc__ or "")
    assert list(drawn.values()).count(None) == 1


@pytest.mark.parametrize("package", [name for name in WITH_ERRORS if name != "service"])
def test_every_error_is_offered_by_the_package_root(package: str) -> None:
    root = importlib.import_module(package)
    assert set(importlib.import_module(f"{package}.errors").__all__) <= set(root.__all__)
