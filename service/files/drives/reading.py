"""The log of a drive from any number of files."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from service.errors import RequestError
from service.files.logs.form import LogForm
from service.files.logs.opening import kind_of

from .rows import DriveRows
from .streams import read_drive_streams
from .tables import read_drive_table

__all__ = ["read_drive"]


def read_drive(paths: Sequence[Path], form: LogForm, anchor_ids: Collection[str] = ()) -> DriveRows:
    """What the files hold together: tables (a folder stands for those in it), or logs of messages, by what they hold.

    form: what of them is otherwise than documented. Raises RequestError, also where none has inertial readings.
    """
    into = DriveRows()
    for path in paths:
        if path.is_dir() and kind_of(path) is None:
            tables = sorted(path.glob("*.csv"))
            if not tables:
                raise RequestError(f"The folder {path.name} holds no table of a log.")
        else:
            tables = [path]
        for one in tables:
            if kind_of(one) is None:
                read_drive_table(one, form, anchor_ids, into)
            else:
                read_drive_streams(one, form, into)
    if not into.times_s:
        names = ", ".join(path.name for path in paths)
        raise RequestError(
            f"Nothing in {names} is inertial readings: three columns of forces and three of turn rates, such as "
            "acc_x … gyro_z, or messages of an inertial unit."
        )
    if into.no_sigmas:
        into.told.append(f"Sigmas of fixes that are not above zero: {into.no_sigmas}; the settings' are taken.")
    into.unroll_week()
    return into
