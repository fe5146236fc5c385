"""Range logs of messages: JSON Lines, an epoch in each, as a rover sends them over a stream."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from detection import RangeEpoch
from service.errors import RequestError
from service.files.range_log import PLAIN, LogForm, read_range_log
from service.files.range_log_epochs import epochs_of
from service.live.request import EpochIn
from service.parts.sentences import sentence_of

__all__ = ["SUFFIXES", "EpochLog", "read_epochs"]

SUFFIXES = (".jsonl", ".ndjson")


@dataclass(frozen=True, slots=True)
class EpochLog:
    """The epochs of a log, and what was passed over in it, in sentences."""

    epochs: list[RangeEpoch]
    warnings: list[str]


def read_epochs(path: Path, epoch_s: float = 0.0, form: LogForm = PLAIN) -> EpochLog:
    """The epochs of a log of either kind: messages by the ending of its name, else CSV.

    epoch_s: how rows of CSV belong together, see ``epochs_of``. form: what of them is otherwise than documented.
    Raises RequestError.
    """
    if path.suffix.lower() not in SUFFIXES:
        log = read_range_log(path, form)
        return EpochLog(epochs_of(log.rows, epoch_s), log.warnings)
    if epoch_s:
        raise RequestError(f"--epoch is for CSV; in {path.name} each line is an epoch.")
    if form != PLAIN:
        raise RequestError(f"--columns and units are for CSV; {path.name} holds messages, in seconds and metres.")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RequestError(f"The log {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The log {str(path)!r} cannot be read: {error.strerror}.") from error
    epochs = [_epoch(f"{path.name}, line {number}", line) for number, line in enumerate(lines, 1) if line.strip()]
    return EpochLog(epochs, [])


def _epoch(where: str, line: str) -> RangeEpoch:
    try:
        return EpochIn.model_validate_json(line).epoch()
    except ValidationError as error:
        raise RequestError(f"{where}: {sentence_of(error)}") from error
