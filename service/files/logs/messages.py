"""Logs of messages: streams of one name, what is in a message by its path, and all that a reader of them offers."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, cast

import numpy as np

__all__ = ["Message", "MessageLog", "Stream", "leaves_of", "listed", "number_at", "value_at"]

STEP = re.compile(r"([^.\[\]]+)|\[(\d*)\]")
MOST_LEAVES = 80
DEEPEST = 6


@dataclass(frozen=True, slots=True)
class Message:
    """One message. time_s: by the log's own clock; body: a mapping, or an object with fields."""

    stream: str
    time_s: float
    body: object


@dataclass(frozen=True, slots=True)
class Stream:
    """Messages of one name. kind: their type, where it is another name; first: the body of the first of them."""

    name: str
    kind: str
    count: int
    first: object


@dataclass(frozen=True, slots=True)
class MessageLog:
    """A log that was opened. family: ros, mavlink, ulog, dataflash; format: its name for people.

    read: the messages of the streams named, in the order of their times. told: what could not be read, in sentences.
    """

    family: str
    format: str
    streams: tuple[Stream, ...]
    read: Callable[[Collection[str]], Iterator[Message]]
    told: list[str] = field(default_factory=list)


def value_at(body: object, path: str) -> object | None:
    """What stands at a path, None where nothing does; a list for a path with []."""
    if isinstance(body, Mapping) and path in body:
        return cast(object, body[path])
    at: Any = body  # whatever the log's library makes of a message
    steps = list(STEP.finditer(path))
    for number, step in enumerate(steps):
        if at is None:
            return None
        name, place = step[1], step[2]
        if name is not None:
            at = at.get(name) if isinstance(at, Mapping) else getattr(at, name, None)
        elif (each := listed(at)) is None:
            return None
        elif place:
            at = each[int(place)] if int(place) < len(each) else None
        else:
            rest = path[step.end() :].lstrip(".")
            return [value_at(one, rest) for one in each] if number + 1 < len(steps) else each
    return None if at is None else cast(object, at)


def number_at(body: object, path: str) -> float | None:
    """The number at a path, the mean of several that are separated by commas or in a list; None where none is."""
    values = [value_at(body, one.strip()) for one in path.split(",")]
    if len(values) == 1 and (several := listed(values[0])) is not None:
        values = several
    numbers = [number for value in values if (number := _number(value)) is not None]
    return sum(numbers) / len(numbers) if numbers else None


def _number(value: Any) -> float | None:
    """None for what is no number, times of ROS with parts that are none among them."""
    if isinstance(value, str | bytes) or value is None:
        return None
    try:
        if hasattr(value, "sec"):  # a time of ROS
            return float(value.sec) + 1e-9 * float(getattr(value, "nanosec", 0))
        if isinstance(value, Mapping) and {"sec", "secs"} & set(value):
            parts = (value.get(key) for key in ("nanosec", "nsec", "nsecs"))
            seconds = value.get("sec", value.get("secs"))
            return float(seconds) + 1e-9 * float(next((part for part in parts if part is not None), 0))
        return float(value)
    except (TypeError, ValueError):
        return None


def listed(value: object) -> list[object] | None:
    """A list, a tuple or an array as a list; None for what is none of them."""
    if isinstance(value, np.ndarray):
        return list(value.tolist()) if value.ndim else None
    return list(value) if isinstance(value, list | tuple) else None


def leaves_of(body: object, prefix: str = "", depth: int = 0) -> list[tuple[str, object]]:
    """(path, value) of what a message holds, its beginning where that is much."""
    found: list[tuple[str, object]] = []
    for name, value in _parts(body):
        path = f"{prefix}.{name}" if prefix else name
        if depth < DEEPEST and _parts(value):
            found += leaves_of(value, path, depth + 1)
        elif (each := listed(value)) is not None:
            if each and _parts(each[0]):
                found += leaves_of(each[0], f"{path}[]", depth + 1)
            else:
                found.append((f"{path}[]", each[:4]))
        else:
            found.append((path, value))
    return found[:MOST_LEAVES]


def _parts(value: object) -> list[tuple[str, object]]:
    if isinstance(value, Mapping):
        return [(str(name), one) for name, one in value.items()]
    if is_dataclass(value) and not isinstance(value, type):
        return [(one.name, getattr(value, one.name)) for one in fields(value) if not one.name.startswith("__")]
    return []
