"""Files that a map can be downloaded as."""

from __future__ import annotations

import errno
import os
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .mission_files import Mission

__all__ = ["COG", "GEOJSON", "JSON", "KML", "PNG", "Layer", "replacing"]

Writer = Callable[[Any, Path], None]
COG = "image/tiff; application=geotiff; profile=cloud-optimized"
PNG = "image/png"
GEOJSON = "application/geo+json"
JSON = "application/json"
KML = "application/vnd.google-earth.kml+xml"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to; when the block ends well it takes the place of ``path`` at once, otherwise it is removed.

    It keeps the file's suffix, which some writers go by. Raises IsADirectoryError where a folder has that name.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    unfinished = path.with_name(f".{path.stem}-{uuid.uuid4().hex}{path.suffix}")
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


@dataclass(frozen=True, slots=True)
class Layer:
    """``name`` is its file name; ``write`` takes a finished map of the kind that has this layer, and a path.

    needs: the parameter without which a map does not have it. at_least: as many entries of it. word: what it says.
    status: of a result that alone has it. mission: it is for programs on Earth, and not written of every DEM.
    for_screens: a part that a page puts together; commands that write files leave it out.
    """

    name: str
    media_type: str
    description: str
    write: Writer
    needs: str | None = None
    at_least: int = 1
    word: str | None = None
    status: str | None = None
    mission: Mission | None = None
    for_screens: bool = False

    def save(self, finished: Any, path: Path) -> None:
        """Write it so that ``path`` either holds all of it or is left as it was. Raises OSError."""
        with replacing(path) as unfinished:
            self.write(finished, unfinished)

    def is_of(self, parameters: Mapping[str, Any]) -> bool:
        """Whether a map that was asked for with these parameters has this layer."""
        if self.needs is None:
            return True
        given = parameters.get(self.needs)
        if self.word is not None:
            return bool(given == self.word)
        return len(given) >= self.at_least if isinstance(given, list) else given is not None

    def is_in(self, result: Mapping[str, Any]) -> bool:
        """Whether there is something to put into it."""
        if self.mission is not None and not self.mission.is_of(result.get("dem", {})):
            return False
        return self.status is None or result.get("status") == self.status
