"""Kernels read what they are told by name: fields of NamedTuples and records, named columns, never column numbers."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.house.repository import ROOT, kernel_modules

MOST_ARGUMENTS = 8

# along (east, north, up or altitude), or (row, col, altitude), 0, 1 and 2 are as good as names
VECTORS = {
    *("a", "b", "c", "step", "anchor", "anchors", "anchors_m", "anchor_m", "corner", "corners_m", "direction"),
    *("edge_1", "edge_2", "start", "end", "moves", "nearest_m", "normal", "normals", "origin", "place", "place_m"),
    *("places", "places_m", "point", "point_m", "points", "points_m", "position", "receiver_m"),
}
# of these the first element is asked for, which is no column
SEQUENCES = {
    *("bounds", "depths", "doubt", "items", "kept", "keys", "known", "marks", "nodes", "p", "q", "sets", "start"),
    "times_s",
}


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
        first_of_table = len(indices) > 1 and len(numbers) == 1 and indices[0] is not None and _number(indices[0]) == 0
        first_of_sequence = len(indices) == 1 and numbers == [0] and name in SEQUENCES
        vector = name in VECTORS and bool(numbers) and max(numbers) <= 2
        if numbers and name != "shape" and not (first_of_table or first_of_sequence or vector):
            yield ast.unparse(node)


def functions_of_many_arguments(tree: ast.AST) -> Iterator[str]:
    """Every function of a tree that takes more than MOST_ARGUMENTS."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            taken = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
            if len(taken) > MOST_ARGUMENTS:
                yield f"{node.name} of {len(taken)} arguments"


@pytest.mark.parametrize("module", kernel_modules(), ids=str)
def test_a_kernel_reads_no_column_by_its_number(module: Path) -> None:
    assert list(column_numbers(_tree(module))) == []


@pytest.mark.parametrize("module", kernel_modules(), ids=str)
def test_a_kernel_takes_eight_arguments_at_most(module: Path) -> None:
    assert list(functions_of_many_arguments(_tree(module))) == []


@pytest.mark.parametrize(
    ("source", "numbers"),
    [
        ("task[5]", 1),
        ("field[5][0]", 2),
        ("picked[uint64(2), q]", 1),
        ("reals[number, 3] + point[1]", 1),
        ("x[-1]", 1),
        ("x.shape[0] + hull[0, SHARE] + point[2] + found.reason + table[SURE, a]", 0),
    ],
)
def test_a_column_number_is_seen_where_there_is_one(source: str, numbers: int) -> None:
    assert len(list(column_numbers(ast.parse(source)))) == numbers
