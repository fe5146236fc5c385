"""How a command ends when it cannot do what was asked: one sentence on stderr and an exit code."""

from __future__ import annotations

import os
import sys
from typing import get_args

from cyclopts import CoercionError, CycloptsError, MissingArgumentError, UnknownOptionError, UnusedCliTokensError
from cyclopts.exceptions import UnknownCommandError

from .asking.spoken import spoken

__all__ = ["BAD_INPUT", "FAULT", "exit_code_of", "interrupted", "unheard", "usage"]

FAULT, BAD_INPUT, INTERRUPTED = 1, 2, 130
KINDS = {int: "whole number", float: "number", bool: "yes or no"}


def exit_code_of(error: Exception) -> int | None:
    """Say on stderr what went wrong and return the exit code; None for an error that nobody foresaw."""
    if isinstance(error, CycloptsError):
        return usage(_usage_sentence(error))
    return _domain_exit_code(error)


def usage(sentence: str) -> int:
    """Say what is wrong with a command line; its exit code."""
    return _say(sentence, BAD_INPUT)


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


def _usage_sentence(error: CycloptsError) -> str:
    unused = error.unused_tokens or []
    if isinstance(error, UnknownOptionError):
        return f"No such option: {error.token.keyword or error.token.value}."
    if isinstance(error, UnknownCommandError):
        return f"No such {'option' if unused[0].startswith('-') else 'command'}: {unused[0]}."
    if isinstance(error, UnusedCliTokensError):
        return f"Got unexpected extra argument{'s' if len(unused) > 1 else ''} ({' '.join(unused)})."
    if isinstance(error, CoercionError) and error.token is not None and error.argument is not None:
        kind, value = error.argument.hint, error.token.value
        choices = error.argument.get_choices()
        if choices:
            why = f"{value!r} is not one of {', '.join(repr(one) for one in choices)}"
        else:
            why = f"{value!r} is no {next((KINDS[one] for one in (kind, *get_args(kind)) if one in KINDS), 'value')}"
        return f"Invalid value for '{error.argument.name}': {why}."
    if isinstance(error, MissingArgumentError) and error.argument is not None:
        name, told = error.keyword or error.argument.name, error.argument.parameter.help
        if not name.startswith("-"):
            return f"Missing argument '{name}': {told}"
        asked_for = error.argument.name in unused or error.keyword is not None
        return f"Option '{name}' requires an argument: {told}" if asked_for else f"Missing option '{name}': {told}"
    return str(error)


def _say(sentence: str, code: int) -> int:
    one_line = spoken(" ".join(sentence.split()))
    print(one_line if one_line.endswith((".", "!", "?")) else f"{one_line}.", file=sys.stderr)
    return code
