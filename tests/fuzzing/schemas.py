"""Values out of a JSON schema, mostly at its edges: extreme numbers, texts that break things, what is left out."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any

from hypothesis import strategies as st

Schema = Mapping[str, Any]

NUMBERS = (
    *(0, 1, -1, 2, 0.5, -0.0, 1e-9, 1e-300, 5e-324, 1e6, -1e6, 1e12, -1e12, 1e18, 1.7e308, -1.7e308),
    *(2**31 - 1, 2**31, -(2**31), 2**32, 2**53, 2**63 - 1, 2**63, 2**64, 10**30, 359.999, 360, 180, 90, -90, 89.9999),
)
USUAL_TEXTS = (
    r"D1|$|$$|$\frac{1}{0}$|\|{}|%s%n|=1+1|+1|-1|@x|'|a,b;c|..|../../etc/passwd|/|C:\x|con|<b>&amp;</b>|None|nan|1e999|"
    r"[red]|http://127.0.0.1:1/x|é|日本|שלום|مرحبا|😀|𝒳|İ|ß|2007-01-27T06:00:00Z|0001-01-01T00:00:00Z|9999-12-31T23:59:59Z|"
    r"2007-01-27|9999-12-31|0001-01-01"
)
TEXTS = (
    *USUAL_TEXTS.split("|"),
    *("", " ", '"', "\t=1", "a\nb", "a\r\nb", "\0", "\x1b[31m", "\x7f", "\x85"),
    *("\u2028", "\ufeff", "\ufffe", "\u202eab"),
    *("x" * 64, "x" * 65, "x" * 5000, "e\u0301" * 30, "0" * 64, "*" * 40),
)
OTHERS: tuple[Any, ...] = (None, True, False, [], {}, [[]], [None], {"": None}, "0", 0, [[[[[[]]]]]])
MOST_DEEP = 6


def texts() -> st.SearchStrategy[str]:
    """Texts of every unpleasant kind; surrogates are no text and no JSON."""
    return st.one_of(st.sampled_from(TEXTS), st.text(max_size=20))


def numbers(schema: Schema) -> st.SearchStrategy[Any]:
    """Numbers at the bounds of the schema, a little inside and a little outside, and extreme ones."""
    low, high = (
        schema.get("minimum", schema.get("exclusiveMinimum")),
        schema.get("maximum", schema.get("exclusiveMaximum")),
    )
    edges = [one for bound in (low, high) if bound is not None for one in (bound, bound * 0.999, bound + 1, bound - 1)]
    within = [one for one in (*NUMBERS, *edges) if (low is None or one >= low) and (high is None or one <= high)]
    usual: st.SearchStrategy[Any] = st.sampled_from(within)
    if schema.get("type") == "integer":
        whole = [int(one) for one in within if math.isfinite(one) and one == int(one)]
        usual = st.sampled_from(whole)
    return st.one_of(usual, usual, usual, st.sampled_from((*NUMBERS, *edges)))


def values(schema: Schema, document: Schema, deep: int = 0) -> st.SearchStrategy[Any]:
    """Values that mostly are what the schema says."""
    schema = resolved(schema, document)
    for word in ("anyOf", "oneOf", "allOf"):
        if word in schema:
            return st.one_of([values(one, document, deep) for one in schema[word]])
    if "const" in schema:
        return st.just(schema["const"])
    if "enum" in schema:
        return st.sampled_from(schema["enum"])
    kind = schema.get("type")
    if kind in ("number", "integer"):
        return numbers(schema)
    if kind == "string":
        return texts()
    if kind == "boolean":
        return st.booleans()
    if kind == "null":
        return st.none()
    if kind == "array" and deep < MOST_DEEP:
        return _arrays(schema, document, deep)
    if kind == "object" and deep < MOST_DEEP:
        return _objects(schema, document, deep)
    return st.sampled_from(OTHERS)


def _arrays(schema: Schema, document: Schema, deep: int) -> st.SearchStrategy[Any]:
    if "prefixItems" in schema:
        return st.tuples(*[values(one, document, deep + 1) for one in schema["prefixItems"]]).map(list)
    least = min(schema.get("minItems", 0), 40)
    most = max(min(schema.get("maxItems", 4), 6), least)
    return st.lists(values(schema.get("items", {}), document, deep + 1), min_size=least, max_size=most)


@st.composite
def _objects(draw: st.DrawFn, schema: Schema, document: Schema, deep: int) -> dict[str, Any]:
    properties, required = schema.get("properties", {}), schema.get("required", [])
    optional = [name for name in properties if name not in required]
    chosen = draw(st.lists(st.sampled_from(optional), max_size=4, unique=True)) if optional else []
    return {
        name: draw(values(properties[name], document, deep + 1)) for name in (*required, *chosen) if name in properties
    }


@st.composite
def changed(draw: st.DrawFn, example: Any, schema: Schema, document: Schema) -> Any:
    """A good example in which up to three fields are other values of their schema, left out, or something else."""
    found = copy.deepcopy(example)
    for _ in range(draw(st.integers(1, 3))):
        found = draw(_changed_once(found, resolved(schema, document), document))
    return found


@st.composite
def _changed_once(draw: st.DrawFn, example: Any, schema: Schema, document: Schema) -> Any:
    schema = _branch(example, resolved(schema, document), document)
    if isinstance(example, dict) and schema.get("properties"):
        here = [name for name in schema["properties"] if name in example]
        name = draw(st.sampled_from(here if here and draw(st.integers(0, 7)) else list(schema["properties"])))
        inner = schema["properties"][name]
        if name in example and isinstance(example[name], (dict, list)) and draw(st.integers(0, 3)):
            return {**example, name: draw(_changed_once(example[name], inner, document))}
        if name in example and draw(st.integers(0, 9)) == 0:
            return {key: value for key, value in example.items() if key != name}
        return {**example, name: draw(values(inner, document, 1))}
    if isinstance(example, list) and example:
        at = draw(st.integers(0, len(example) - 1))
        inner = schema.get("items") or (schema.get("prefixItems") or [{}])[0]
        how = draw(st.integers(0, 5))
        if how == 0:
            return [*example, example[at]]
        if how == 1:
            return [*example[:at], *example[at + 1 :]]
        return [*example[:at], draw(_changed_once(example[at], inner, document)), *example[at + 1 :]]
    return draw(values(schema, document, 1) if draw(st.integers(0, 9)) else st.sampled_from(OTHERS))


def _branch(example: Any, schema: Schema, document: Schema) -> Schema:
    """Of a union the first that an example of this type can be."""
    kinds = {dict: "object", list: "array"}
    for one in schema.get("anyOf", schema.get("oneOf", [])):
        inner = _branch(example, resolved(one, document), document)
        if inner.get("type") == kinds.get(type(example), inner.get("type")):
            return inner
    return schema


def resolved(schema: Schema, document: Schema) -> Schema:
    """The schema behind a reference."""
    while "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]]
    return schema
