"""What every task gets besides its arguments."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from service.errors import NotFoundError
from service.jobs.dem_files import load_grid
from service.jobs.folder import DataFolder
from service.products import Product
from service.settings import Settings
from terrain import ElevationGrid

__all__ = ["Task", "TaskContext"]

DEM_ID = re.compile(r"[0-9a-f]{32}")


@dataclass(frozen=True, slots=True)
class TaskContext:
    """Limits, where things lie, the task's own work folder (not made yet), and whom to tell the finished share.

    stop: whether somebody wants the best so far instead of all; a task that knows no such thing does not ask.
    """

    settings: Settings
    products: Mapping[str, Product]
    folder: DataFolder
    work: Path
    progress: Callable[[float], None]
    stop: Callable[[], bool]

    def grid(self, dem_id: str) -> ElevationGrid:
        """The DEM of that id; raises NotFoundError, DataFolderError."""
        # the id may come straight from a request: it must not lead out of the folder
        if not DEM_ID.fullmatch(dem_id):
            raise NotFoundError("DEM", dem_id)
        try:
            return _grid(self.folder.dem(dem_id))
        except FileNotFoundError as error:
            self.folder.check_usable()  # where the whole folder is gone, that is what to tell
            raise NotFoundError("DEM", dem_id) from error


Task = Callable[[TaskContext, Mapping[str, Any]], Mapping[str, Any]]


@lru_cache(maxsize=2)
def _grid(folder: Path) -> ElevationGrid:
    return load_grid(folder)
