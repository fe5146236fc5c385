"""The commands of ``sightline``: each is a function of a module of its own, imported when it is called."""

from __future__ import annotations

import sys
from collections.abc import Mapping

from cyclopts import App, Parameter

from .failures import exit_code_of, interrupted, unheard, usage

__all__ = ["COMMANDS", "command_line", "main"]

ABOUT = "Which ranging anchors does a rover see, where, and from what height? Exit codes: 0 done, 2 bad input, 1 fault."
COMMANDS: Mapping[str, str] = {
    "info": "service.cli.info:info",
    "visibility": "service.cli.visibility:visibility",
    "dop": "service.cli.dop:dop",
    "morph": "service.cli.morph:morph",
    "bubble": "service.cli.bubble:bubble",
    "detect": "service.cli.detect:detect",
    "place": "service.cli.place:place",
    "plan": "service.cli.plan:plan",
    "fly": "service.cli.fly:fly",
    "reposition": "service.cli.reposition:reposition",
    "los": "service.cli.los:los",
    "store": "service.cli.store:store",
    "serve": "service.cli.serve:serve",
    "demo": "service.cli.demo:demo",
    "warm-up": "service.cli.serve:warm_up",
}


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
        if not words or words == ["store"]:
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
