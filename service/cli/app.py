"""The commands of ``sightline``, each imported when it is called; and how one ends that cannot do what was asked."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import get_args

from cyclopts import (
    App,
    CoercionError,
    CycloptsError,
    MissingArgumentError,
    Parameter,
    UnknownOptionError,
    UnusedCliTokensError,
)
from cyclopts.exceptions import UnknownCommandError

from .asking.numbers import converted
from .asking.spoken import spoken

__all__ = ["BAD_INPUT", "COMMANDS", "FAULT", "command_line", "exit_code_of", "interrupted", "main", "unheard", "usage"]

FAULT, BAD_INPUT, INTERRUPTED = 1, 2, 130
KINDS = {int: "whole number", float: "number", bool: "yes or no"}
ABOUT = "Which ranging anchors does a rover see, where, and from what height? Exit codes: 0 done, 2 bad input, 1 fault."
COMMANDS: Mapping[str, str] = {
    "info": "service.cli.info:info",
    "visibility": "service.cli.visibility:visibility",
    "dop": "service.cli.dop:dop",
    "morph": "service.cli.morph:morph",
    "bubble": "service.cli.bubble:bubble",
    "detect": "service.cli.detect:detect",
    "log": "service.cli.field.log:log",
    "navigate": "service.cli.field.navigate:navigate",
    "baseline": "service.cli.field.baseline:baseline",
    "protect": "service.cli.field.protect:protect",
    "sites": "service.cli.sites:sites",
    "bridge": "service.cli.field.bridge:bridge",
    "receiver": "service.cli.field.receiver:receiver",
    "canopy": "service.cli.field.canopy:canopy",
    "targets": "service.cli.field.targets:targets",
    "place": "service.cli.place:place",
    "plan": "service.cli.plan:plan",
    "fly": "service.cli.fly:fly",
    "reposition": "service.cli.reposition:reposition",
    "los": "service.cli.los:los",
    "store": "service.cli.operating.store:store",
    "ground": "service.cli.ground:ground",
    "missions": "service.cli.operating.missions:missions",
    "keys": "service.cli.operating.keys:keys",
    "serve": "service.cli.operating.serve:serve",
    "demo": "service.cli.demo:demo",
    "warm-up": "service.cli.operating.serve:warm_up",
}


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
    from service.errors import NotFoundError, RequestError, ServiceError, StartError
    from service.parts.sentences import sentence_of

    if isinstance(error, ValidationError):
        return _say(sentence_of(error), BAD_INPUT)
    if isinstance(error, (*domain_errors().values(), RequestError, NotFoundError, StartError)):
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


def command_line(more: Mapping[str, str] | None = None) -> App:
    """All commands, and those of other packages. more: name to ``package.module:function`` of each."""
    app = App(
        name="sightline",
        help=ABOUT,
        help_format="plaintext",
        version=_version,
        version_flags=["--version"],
        suppress_keyboard_interrupt=False,
        default_parameter=Parameter(
            negative=(),
            allow_leading_hyphen=True,  # --start -120,40
            allow_repeating=True,
            json_dict=False,
            json_list=False,
            show_default=_shown,
            converter=converted,
        ),
    )
    for number, (name, place) in enumerate({**COMMANDS, **(more or {})}.items()):
        app.command(place, name=name, sort_key=number)
    return app


def main(more: Mapping[str, str] | None = None) -> None:
    """Run the command line and leave with its exit code. more: commands of other packages, as for command_line."""
    app, words = command_line(more), sys.argv[1:]
    try:
        if not words or words[0] in ("--help", "-h"):
            for name in {**COMMANDS, **(more or {})}:
                _ = app[name]  # imported, so that the list has what each of them says of itself
        if not words or words in (["store"], ["ground"], ["keys"], ["bridge"], ["receiver"], ["targets"]):
            app.help_print(words)
            code = usage("No command was given; sightline --help lists them.")
        else:
            app(words, exit_on_error=False, print_error=False, result_action="return_value")
            code = 0
        sys.stdout.flush()
    except BrokenPipeError:
        code = unheard()
    except KeyboardInterrupt:
        code = interrupted()
    except Exception as error:
        ended = exit_code_of(error)
        if ended is None:
            raise
        code = ended
    sys.exit(code)


def _version() -> str:
    from importlib.metadata import version

    return f"sightline {version('sightline')}"


def _shown(default: object) -> str | None:
    """A default in a help text; what is off or empty unless it is given needs none."""
    return None if default is None or default is False or default == () else str(default)
