"""How a command ends when it cannot do what was asked: one sentence on stderr and an exit code."""

from __future__ import annotations

import os
import sys

import typer

__all__ = ["BAD_INPUT", "FAULT", "exit_code_of"]

FAULT, BAD_INPUT, INTERRUPTED = 1, 2, 130
# typer does not export the base of its usage errors, and where they live has changed between its versions
UsageError = typer.BadParameter.__bases__[0]


def exit_code_of(error: BaseException) -> int | None:
    """Say on stderr what went wrong and return the exit code; None for an error that nobody foresaw."""
    if isinstance(error, typer.Exit):
        return int(error.exit_code)
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return _say("Interrupted.", INTERRUPTED)
    if isinstance(error, BrokenPipeError):
        # whoever read our output has left; python would complain again when it flushes at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAULT
    if isinstance(error, UsageError):
        return _say(_usage_sentence(error), BAD_INPUT)
    return _domain_exit_code(error)


def _domain_exit_code(error: BaseException) -> int | None:
    # imported here because an error of theirs cannot come before they were imported, and --help stays quick
    from pydantic import ValidationError

    from service.errors import RequestError, ServiceError, StartError
    from service.schemas import sentence_of
    from terrain import TerrainError
    from visibility import VisibilityError

    if isinstance(error, ValidationError):
        return _say(sentence_of(error), BAD_INPUT)
    if isinstance(error, TerrainError | VisibilityError | RequestError | StartError):
        return _say(str(error), BAD_INPUT)
    if isinstance(error, ServiceError):
        return _say(str(error), FAULT)
    if isinstance(error, OSError):
        return _say(f"{error.filename or 'A file'} could not be used: {error.strerror or error}.", FAULT)
    if isinstance(error, MemoryError):
        return _say("There is not enough memory for this DEM with so many anchors.", FAULT)
    return None


def _usage_sentence(error: BaseException) -> str:
    text = str(getattr(error, "format_message", error.__str__)()).strip()
    return text or "No command was given; sightline --help lists them."


def _say(sentence: str, code: int) -> int:
    one_line = " ".join(sentence.split())
    print(one_line if one_line.endswith((".", "!", "?")) else f"{one_line}.", file=sys.stderr)
    return code
