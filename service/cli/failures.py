"""How a command ends when it cannot do what was asked: one sentence on stderr and an exit code."""

from __future__ import annotations

import os
import sys

import typer

__all__ = ["BAD_INPUT", "FAULT", "INTERRUPTED", "exit_code_of", "interrupted", "unheard"]

FAULT, BAD_INPUT, INTERRUPTED = 1, 2, 130
# typer does not export the base of its usage errors, and where they live has changed between its versions
UsageError = typer.BadParameter.__bases__[0]


def exit_code_of(error: Exception) -> int | None:
    """Say on stderr what went wrong and return the exit code; None for an error that nobody foresaw."""
    if isinstance(error, typer.Abort):
        return interrupted()
    if isinstance(error, UsageError):
        return _say(_usage_sentence(error), BAD_INPUT)
    return _domain_exit_code(error)


def interrupted() -> int:
    """Say that somebody stopped the command; its exit code."""
    return _say("Interrupted.", INTERRUPTED)


def unheard() -> int:
    """Leave without a word when whoever read our output has gone, as ``head`` does; the exit code."""
    # what is still buffered would otherwise fail once more when Python ends
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return FAULT


def _domain_exit_code(error: Exception) -> int | None:
    # pydantic and what uses it take a while to import, and --help stays quick
    from pydantic import ValidationError

    from service.error_roots import domain_errors
    from service.errors import RequestError, ServiceError, StartError
    from service.parts.sentences import sentence_of

    if isinstance(error, ValidationError):
        return _say(sentence_of(error), BAD_INPUT)
    if isinstance(error, (*domain_errors().values(), RequestError, StartError)):
        return _say(str(error), BAD_INPUT)
    if isinstance(error, ServiceError):
        return _say(str(error), FAULT)
    if isinstance(error, IsADirectoryError):
        return _say(f"{error.filename} is a folder where a file is needed; move it away or name another.", BAD_INPUT)
    if isinstance(error, OSError):
        return _say(f"{error.filename or 'A file'} could not be used: {error.strerror or error}.", FAULT)
    if isinstance(error, MemoryError):
        return _say("There is not enough memory for this DEM with so many anchors.", FAULT)
    return None


def _usage_sentence(error: Exception) -> str:
    text = str(getattr(error, "format_message", error.__str__)()).strip()
    # what is missing is told with what it is; typer exports no class for that either
    if type(error).__name__ == "MissingParameter" and (told := getattr(getattr(error, "param", None), "help", "")):
        text = f"{text.rstrip('.')}: {told}"
    return text or "No command was given; sightline --help lists them."


def _say(sentence: str, code: int) -> int:
    one_line = " ".join(sentence.split())
    print(one_line if one_line.endswith((".", "!", "?")) else f"{one_line}.", file=sys.stderr)
    return code
