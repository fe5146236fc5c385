"""What the service and a worker process say to each other: one JSON object per line, in both directions.

service -> worker   {"settings": {...}}                                   first, once
                    {"task": NAME, "token": WORK_FOLDER, "arguments": {...}}
                    {"stop": WORK_FOLDER}                                 that task may end with what it has
worker -> service   {"ready": true}                                       once, when warm
                    {"progress": 0..1}                                    any number
                    {"result": {...}} or {"failure": {"error", "detail", "data"}}
"""

from __future__ import annotations

from typing import Any

import orjson

__all__ = ["MAX_LINE_BYTES", "decode", "encode"]

MAX_LINE_BYTES = 64 * 1024 * 1024


def encode(message: dict[str, Any]) -> bytes:
    """One line; what is no number becomes null."""
    return orjson.dumps(message, option=orjson.OPT_APPEND_NEWLINE)


def decode(line: bytes) -> dict[str, Any]:
    """The message of a line; raises ValueError when the line is not one."""
    message = orjson.loads(line)
    if not isinstance(message, dict):
        raise ValueError(f"A message must be an object, not {type(message).__name__}.")
    return message
