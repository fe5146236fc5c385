"""``sightline store``: looking after a data folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import typer

from service.jobs.backups import back_up, restore
from service.jobs.checking import Check, check
from service.settings import Settings

from .failures import FAULT
from .output import facts_table, print_json, print_tables, print_warnings, progress_bar

__all__ = ["make_backup", "restore_backup", "show_check"]

SHOWN = 5


def show_check(data: Path | None, as_json: bool) -> None:
    """Print what a check finds; leaves with 1 when the folder is not sound. Raises DataFolderError."""
    with progress_bar("Checking the data folder") as progress:
        found = check(_folder(data), progress)
    if as_json:
        print_json(found.summary())
    else:
        print_tables(facts_table(f"{found.kind.capitalize()} {found.folder}", _facts(found)))
        print_warnings(_complaints(found))
    if not found.sound:
        raise typer.Exit(FAULT)


def make_backup(target: Path, data: Path | None, as_json: bool) -> None:
    """Back up, and tell what was; leaves with 1 when the store knows something that is not there."""
    root = _folder(data)
    with progress_bar("Backing up") as progress:
        made = back_up(root, target, progress)
    if as_json:
        print_json({"data_folder": str(root), "backup": str(target), **made.summary()})
    else:
        print_tables(facts_table(f"Backup {target}", [("of", str(root)), *_counts(made.known.counts())]))
        print_warnings(_missing(made.missing, "not in the data folder, so not in the backup either"))
    if made.missing:
        raise typer.Exit(FAULT)


def restore_backup(source: Path | None, data: Path | None, as_json: bool) -> None:
    """Restore, and tell what was; leaves with 1 when the store knows something that is nowhere."""
    root = _folder(data)
    with progress_bar("Restoring") as progress:
        done = restore(source, root, progress)
    told = done.summary()
    if as_json:
        print_json({"data_folder": str(root), "backup": None if source is None else str(source), **told})
    else:
        facts = [
            ("from", "its quarantine" if source is None else str(source)),
            *_counts(done.known.counts()),
            ("were in place", f"{told['kept']:,}"),
            ("from the backup", f"{told['from_backup']:,}"),
            ("from quarantine", f"{told['from_quarantine']:,}"),
            ("put into quarantine", str(done.quarantine or "nothing")),
        ]
        print_tables(facts_table(f"Data folder {root}", facts))
        print_warnings(_missing(done.missing, "neither in place nor in backup or quarantine, or damaged"))
    if done.missing:
        raise typer.Exit(FAULT)


def _folder(data: Path | None) -> Path:
    return (Settings().data_folder if data is None else data).absolute()


def _counts(counts: Mapping[str, int]) -> list[tuple[str, str]]:
    return [(name if name != "dems" else "DEMs", f"{number:,}") for name, number in counts.items()]


def _facts(found: Check) -> list[tuple[str, str]]:
    held: list[tuple[str, str]] = [
        ("in quarantine", f"{aside.path}: {_parts(aside.parts)}, {aside.bytes / 1e6:,.1f} MB")
        for aside in found.quarantine
    ]
    state = "sound" if found.sound else "not sound"
    in_use = "yes" if found.in_use else "no"
    return [("state", state), ("a service uses it", in_use), *_counts(found.counts), *held]


def _parts(parts: Mapping[str, int]) -> str:
    return ", ".join(f"{number:,} × {part}" for part, number in parts.items())


def _complaints(found: Check) -> list[str]:
    told: list[str] = [] if found.store_problem is None else [found.store_problem]
    told += _missing(found.missing, "missing")
    told += _missing(found.damaged, "damaged")
    told += _missing(found.unknown, "not known to the store; the next start puts it into quarantine")
    return told


def _missing(paths: Any, what: str) -> list[str]:
    if not paths:
        return []
    more = f" and {len(paths) - SHOWN:,} more" if len(paths) > SHOWN else ""
    return [f"{', '.join(paths[:SHOWN])}{more}: {what}."]
