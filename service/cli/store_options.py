"""``sightline store``: its commands and their options; the work is done in store.py."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import AsJson

__all__ = ["DataOption", "store_commands"]

DataOption = Annotated[
    Path | None,
    typer.Option(
        "--data", metavar="DIR", help="The data folder. (default SIGHTLINE_DATA_FOLDER, or sightline-data here)"
    ),
]

store_commands = typer.Typer(
    name="store",
    no_args_is_help=True,
    help="Check, back up and restore the folder that the service keeps DEMs, jobs and results in.",
)


@store_commands.command()
def check(data: DataOption = None, as_json: AsJson = False) -> None:
    """Tell what a data folder or a backup holds, and what is missing, damaged, unknown or in quarantine.

    Nothing is changed, and a service may be running. Exit code 1 when something that the store knows is not sound.
    """
    from .store import show_check

    show_check(data, as_json)


@store_commands.command()
def backup(
    target: Annotated[Path, typer.Argument(metavar="BACKUP", help="A new or empty folder for the backup.")],
    data: DataOption = None,
    as_json: AsJson = False,
) -> None:
    """Copy store and files into a new folder, also while a service is running."""
    from .store import make_backup

    make_backup(target, data, as_json)


@store_commands.command()
def restore(
    source: Annotated[
        Path | None,
        typer.Argument(
            metavar="[BACKUP]",
            help="A backup, or the file of a store alone; without it what lies in quarantine is taken back.",
        ),
    ] = None,
    data: DataOption = None,
    as_json: AsJson = False,
) -> None:
    """Put a backup into a data folder that no service uses; what it replaces goes to quarantine."""
    from .store import restore_backup

    restore_backup(source, data, as_json)
