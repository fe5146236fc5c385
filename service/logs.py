"""How the service logs: lines for people or JSON for programs, each with the request that it belongs to."""

from __future__ import annotations

import json
import logging
import sys
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Literal

import orjson

__all__ = ["LogFormat", "request_id", "set_up_logging"]

LogFormat = Literal["text", "json"]

# Tasks that a request begins, its job among them, inherit it.
request_id: ContextVar[str | None] = ContextVar("request_id", default=None)

# what every record has; all else was given as ``extra`` and is told as a field
OF_EVERY_RECORD = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName", "color_message"}


def set_up_logging(log_format: LogFormat) -> None:
    """Log to standard error in that format, in place of whatever was set up before."""
    # nobody reads these of a record, and each costs something for every line
    logging.logThreads = logging.logProcesses = logging.logMultiprocessing = False
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_Json() if log_format == "json" else _Text())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)


def _fields(record: logging.LogRecord) -> dict[str, object]:
    """What a line tells beside its sentence, by name."""
    told = {name: value for name, value in vars(record).items() if name not in OF_EVERY_RECORD}
    asked_by = request_id.get()
    return told if asked_by is None else {"request_id": asked_by, **told}


class _Text(logging.Formatter):
    """One line for people: when, how bad, who, the sentence, and the fields in brackets."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s %(message)s")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - logging's name
        fields = " ".join(f"{name}={value}" for name, value in _fields(record).items())
        return f"{super().formatMessage(record)} [{fields}]" if fields else super().formatMessage(record)


class _Json(logging.Formatter):
    """One JSON object per line; times are UTC, ISO 8601."""

    def format(self, record: logging.LogRecord) -> str:
        line: dict[str, object] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **_fields(record),
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        try:
            return orjson.dumps(line, default=str).decode()
        except TypeError:  # a name of a file that is no text
            return json.dumps(line, default=str)
