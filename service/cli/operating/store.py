"""``sightline store``: looking after the folder that the service keeps its data in."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from ..app import FAULT
from ..asking.options import option
from ..output import facts_table, print_json, print_tables, print_warnings, progress_bar

if TYPE_CHECKING:
    from service.jobs.copies.checking import Check
    from service.jobs.store_place import StorePlace

__all__ = ["store"]

SHOWN = 5
DataFolder = Annotated[
    Path | None, option("The data folder. (default SIGHTLINE_DATA_FOLDER, or sightline-data here)", "DIR")
]
AsJson = Annotated[bool, Parameter(name="--json", help="Print JSON on standard output and nothing else.")]

store = App(
    name="store", help="Check, back up, restore and vacuum the folder that the service keeps DEMs, jobs and results in."
)


@store.command
def check(*, data: DataFolder = None, as_json: AsJson = False) -> None:
    """Tell what a data folder or a backup holds, and what is missing, damaged, unknown or in quarantine.

    Nothing is changed, and a service may be running. Exit code 1 when something that the store knows is not sound.
    """
    from service.jobs.copies.checking import check as checked

    with progress_bar("Checking the data folder") as progress:
        found = checked(_place(data), progress)
    if as_json:
        print_json(found.summary())
    else:
        print_tables(facts_table(f"{found.kind.capitalize()} {found.folder}", _facts(found)))
        print_warnings(_complaints(found))
    if not found.sound:
        sys.exit(FAULT)


@store.command
def backup(
    target: Annotated[
        Path, Parameter(name="BACKUP", allow_leading_hyphen=False, help="A new or empty folder for the backup.")
    ],
    /,
    *,
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Copy store and files into a new folder, also while a service is running."""
    from service.jobs.copies.backups import back_up

    place = _place(data)
    root = place.root
    with progress_bar("Backing up") as progress:
        made = back_up(place, target, progress)
    if as_json:
        print_json({"data_folder": str(root), "backup": str(target), **made.summary()})
    else:
        print_tables(facts_table(f"Backup {target}", [("of", str(root)), *_counts(made.known.counts())]))
        print_warnings(_missing(made.missing, "not in the data folder, so not in the backup either"))
    if made.missing:
        sys.exit(FAULT)


@store.command
def restore(
    source: Annotated[
        Path | None,
        Parameter(
            name="BACKUP",
            allow_leading_hyphen=False,
            help="A backup, or the file of a store alone; without it what lies in quarantine is taken back.",
        ),
    ] = None,
    /,
    *,
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Put a backup into a data folder that no service uses; what it replaces goes to quarantine."""
    from service.jobs.copies.backups import restore as restored

    place = _place(data)
    root = place.root
    with progress_bar("Restoring") as progress:
        done = restored(source, place, progress)
    if as_json:
        print_json({"data_folder": str(root), "backup": None if source is None else str(source), **done.summary()})
    else:
        facts = [
            ("from", "its quarantine" if source is None else str(source)),
            *_counts(done.known.counts()),
            ("were in place", f"{len(done.kept):,}"),
            ("from the backup", f"{len(done.from_backup):,}"),
            ("from quarantine", f"{len(done.from_quarantine):,}"),
            ("put into quarantine", "nothing" if done.quarantine is None else str(done.quarantine)),
        ]
        print_tables(facts_table(f"Data folder {root}", facts))
        print_warnings(_missing(done.missing, "neither in place nor in backup or quarantine, or damaged"))
    if done.missing:
        sys.exit(FAULT)


@store.command
def vacuum(*, data: DataFolder = None, as_json: AsJson = False) -> None:
    """Give the room of deleted jobs in the store's file back to the disk; no service may use the folder."""
    from service.jobs.copies.backups import vacuum as vacuumed

    place = _place(data)
    root = place.root
    before, after = vacuumed(place)
    if as_json:
        print_json({"data_folder": str(root), "bytes_before": before, "bytes_after": after})
    else:
        facts = [("before", f"{before / 1e6:,.1f} MB"), ("after", f"{after / 1e6:,.1f} MB")]
        print_tables(facts_table(f"Store in {root}", facts))


def _place(data: Path | None) -> StorePlace:
    from service.jobs.store_place import StorePlace
    from service.settings import Settings

    return StorePlace.of(Settings(), data)


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


def _missing(paths: Sequence[str], what: str) -> list[str]:
    if not paths:
        return []
    more = f" and {len(paths) - SHOWN:,} more" if len(paths) > SHOWN else ""
    return [f"{', '.join(paths[:SHOWN])}{more}: {what}."]
