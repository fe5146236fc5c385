"""Parcels of a map over a raster larger than memory: one anchor each, worked out anywhere, left as files until used.

A parcel is whole in itself. Who works it out opens the raster by its path and reads the anchor's window alone; what a
killed worker had under way is done again by another, and what was finished lies on disk.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import shapely

from service.errors import RequestError
from visibility import Anchor
from visibility.sight.fast_errors import FastErrors
from visibility.sight.in_reach import Raster, Reach, ReachOptions, in_reach

from .ground import posts_asked_about

__all__ = ["Parcel", "ParcelFacts", "remove_parcel", "stored", "work_out"]


UNSEEN = "The folder {} is not one that this machine and the workers share; put --out where all of them see it."


@dataclass(frozen=True, slots=True)
class Parcel:
    """One anchor, the posts in its reach, and where its answer is put: a folder that whoever needs it sees.

    shape: the area that is asked about, metres; None without one.
    """

    number: int
    dem: Raster
    anchor: Anchor
    reach: Reach
    options: ReachOptions
    folder: str
    shape: shapely.Polygon | None = None


@dataclass(frozen=True, slots=True)
class ParcelFacts:
    """What is told of a finished parcel: posts in reach by what is seen from them, and how far to trust that."""

    number: int
    visible_posts: int
    hidden_posts: int
    unknown_posts: int
    curvature: str
    errors: FastErrors | None
    error_statement: str
    warnings: tuple[str, ...]
    version: str


def work_out(parcel: Parcel) -> ParcelFacts:
    """Calculate a parcel and leave its arrays in its folder, each whole or not at all.

    Raises RequestError where the folder is not there, and what ``in_reach`` raises.
    """
    if not Path(parcel.folder).is_dir():
        raise RequestError(UNSEEN.format(parcel.folder))
    found = in_reach(parcel.dem, parcel.anchor, parcel.reach, parcel.options)
    for name, array in (("altitude", found.altitude_m), ("seen", found.seen)):
        path = _path(parcel, name)
        unfinished = path.with_suffix(f".{os.getpid()}")
        with unfinished.open("wb") as file:
            np.save(file, array, allow_pickle=False)
        unfinished.replace(path)
    reach = parcel.reach
    rows, cols = (reach.first_row, reach.last_row + 1), (reach.first_col, reach.last_col + 1)
    within = posts_asked_about(parcel.dem, parcel.anchor, parcel.shape, rows, cols)
    visible, hidden, unknown = (int(np.count_nonzero(within & (found.seen == seen))) for seen in (1, 0, 255))
    return ParcelFacts(
        parcel.number,
        visible_posts=visible,
        hidden_posts=hidden,
        unknown_posts=unknown,
        curvature=found.curvature,
        errors=found.errors,
        error_statement=found.error_statement,
        warnings=found.warnings,
        version=found.version,
    )


def stored(parcel: Parcel) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """(altitude_m, seen) of a finished parcel, as long as its file is needed mapped and not read whole.

    Raises RequestError where the folder of whoever worked it out is not this one.
    """
    try:
        altitude_m = np.load(_path(parcel, "altitude"), mmap_mode="r", allow_pickle=False)
        return altitude_m, np.load(_path(parcel, "seen"), mmap_mode="r", allow_pickle=False)
    except FileNotFoundError as error:
        raise RequestError(UNSEEN.format(parcel.folder)) from error


def remove_parcel(parcel: Parcel) -> None:
    """Free the disk that a parcel takes; nothing where it was never finished."""
    for name in ("altitude", "seen"):
        _path(parcel, name).unlink(missing_ok=True)


def _path(parcel: Parcel, name: str) -> Path:
    return Path(parcel.folder) / f"parcel-{parcel.number}-{name}.npy"
