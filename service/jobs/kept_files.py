"""The files that belong to what a store knows: which there should be, whether they are sound, and copies of them."""

from __future__ import annotations

import shutil
from pathlib import Path

from .dem_files import digest_of_files
from .folder import digest_of, make_durable
from .notes import NOTES

__all__ = ["copy_files", "is_sound"]


def is_sound(part: str, path: Path, dem_digests: dict[str, str]) -> bool:
    """Whether a DEM, a result or a job's inputs is there and holds what it held when it was written.

    dem_digests: SHA-256 of each DEM's grid, as the store has it; a result's name says what it holds.
    """
    if not path.is_dir():
        return False
    try:
        if part == "results":
            return digest_of(path) == path.name
        if part == "dems":
            return digest_of_files(path) == dem_digests.get(path.name)
        return any(path.iterdir())
    except (OSError, ValueError, TypeError, KeyError):
        return False


def copy_files(source: Path, target: Path) -> bool:
    """Copy a folder's own files and its notes, without what was drawn; False when it goes away meanwhile, or is gone.

    Raises OSError.
    """
    (target / NOTES).mkdir(parents=True)
    try:
        for path in (*source.iterdir(), *(source / NOTES).glob("*.json")):
            if path.is_file():
                shutil.copyfile(path, target / path.relative_to(source))
    except FileNotFoundError:
        shutil.rmtree(target)
        return False
    make_durable(target)
    return True
