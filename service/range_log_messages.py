"""Range logs of messages: JSON Lines, an epoch in each, as a rover sends them over a stream."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from detection import RangeEpoch
from service.errors import RequestError
from service.schemas.detections import EpochIn
from service.schemas.sentences import sentence_of

from .range_log import read_range_log
from .range_log_epochs import epochs_of

__all__ = ["SUFFIXES", "read_epochs"]

SUFFIXES = (".jsonl", ".ndjson")


def read_epochs(path: Path, epoch_s: float = 0.0) -> list[RangeEpoch]:
    """The epochs of a log of either kind: messages by the ending of its name, else CSV.

    epoch_s: how rows of CSV belong together, see ``epochs_of``. Raises RequestError.
    """
    if path.suffix.lower() not in SUFFIXES:
        return epochs_of(read_range_log(path), epoch_s)
    if epoch_s:
        raise RequestError(f"--epoch is for CSV; in {path.name} each line is an epoch.")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RequestError(f"The log {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The log {str(path)!r} cannot be read: {error.strerror}.") from error
    return [_epoch(f"{path.name}, line {number}", line) for number, line in enumerate(lines, 1) if line.strip()]


def _epoch(where: str, line: str) -> RangeEpoch:
    try:
        return EpochIn.model_validate_json(line).epoch()
    except ValidationError as error:
        raise RequestError(f"{where}: {sentence_of(error)}") from error
