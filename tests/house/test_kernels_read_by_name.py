"""Kernels read what they are told by name: fields of NamedTuples and records, named columns, never column numbers."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.house.repository import PACKAGES, ROOT, modules

MOST_ARGUMENTS = 8

# along (east, north, up), 0 to 2 are as good as names; so are rows and columns of a shape
VECTORS = {
    *(
        "a",
        "b",
        "c",
        "anchor",
        "anchors",
        "anchors_m",
        "anchor_m",
        "point",
        "points_m",
        "place",
        "places_m",
        "receiver_m",
    ),
}
# what is not converted yet: how many literal subscripts a module still has, and which functions take too many arguments
NOT_YET: dict[str, int] = {}
TOO_MANY_YET: dict[str, int] = {}


def kernel_modules() -> list[Path]:
    return [module for package in PACKAGES for module in modules(package) if "kernels" in module.parts]


def _tree(module: Path) -> ast.Module:
    return ast.parse((ROOT / module).read_text(encoding="utf-8"), str(module))


def _number(node: ast.expr) -> int | None:
    """The number that an index is written as, be it in a conversion such as ``uint64(2)``."""
    if isinstance(node, ast.Call) and len(node.args) == 1:
        node = node.args[0]
    if isinstance(node, ast.UnaryOp):
        node = node.operand
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, int) else None


def _subscripted(node: ast.expr) -> str:
    """The name that stands at the beginning of a subscript: ``posts`` of ``posts[i][0]``, ``shape`` of ``x.shape``."""
    if isinstance(node, ast.Subscript):
        return _subscripted(node.value)
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def column_numbers(tree: ast.AST) -> Iterator[str]:
    """Every subscript of a tree that reads a column by its number."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Subscript):
            continue
        name = _subscripted(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        numbers = [number for number in map(_number, indices) if number is not None]
        if numbers and name != "shape" and not (name in VECTORS and max(numbers) <= 2):
            yield ast.unparse(node)


if __name__ == "__main__":
    for m in kernel_modules():
        found = list(column_numbers(_tree(m)))
        if found and "planning" not in str(m):
            print(m, Counter(found))
