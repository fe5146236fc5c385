"""The ground library: an index of DEM files that lie anywhere, made of their headers, kept as one JSON file."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..errors import DemReadError, FrameError
from .tile import Tile, read_tile

__all__ = ["GroundLibrary", "Indexed", "Skipped", "edited", "index_ground", "read_library", "without"]

LAYOUT = 1
# what is looked at in a folder; a file that is named is looked at whatever it is called
SUFFIXES = frozenset({".tif", ".tiff", ".hgt", ".asc", ".dt0", ".dt1", ".dt2", ".npz"})


@dataclass(frozen=True, slots=True)
class Skipped:
    """A file that serves as no tile, and why; looked at again when its size or time changes."""

    path: str
    why: str
    size_bytes: int
    modified_ns: int


@dataclass(frozen=True, slots=True)
class GroundLibrary:
    """Tiles by path. sources: the folders and files that were added; left_out: paths in them that were removed."""

    tiles: tuple[Tile, ...] = ()
    sources: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    skipped: tuple[Skipped, ...] = ()


@dataclass(frozen=True, slots=True)
class Indexed:
    """What indexing did, in tiles."""

    new: int = 0
    changed: int = 0
    unchanged: int = 0
    gone: int = 0
    skipped: tuple[Skipped, ...] = field(default_factory=tuple)


def index_ground(
    library: GroundLibrary, paths: Iterable[str | Path] = (), progress: Callable[[float], None] | None = None
) -> tuple[GroundLibrary, Indexed]:
    """The library with folders and files added, and all of its sources looked at again.

    Only headers are read, and only of files whose size or time is not the known one. Raises DemReadError where a path
    that is added does not exist.
    """
    added = tuple(str(_existing(path)) for path in paths)
    sources = tuple(dict.fromkeys((*library.sources, *added)))
    left_out = tuple(path for path in library.left_out if not any(_is_within(path, source) for source in added))
    tiles, skipped = {tile.path: tile for tile in library.tiles}, {one.path: one for one in library.skipped}
    found = list(dict.fromkeys(path for source in sources for path in _files_in(Path(source))))
    kept, passed, counts = list[Tile](), list[Skipped](), {"new": 0, "changed": 0, "unchanged": 0}
    for number, path in enumerate(found):
        if progress is not None:
            progress((number + 1) / len(found))
        if any(_is_within(path, away) for away in left_out):
            continue
        known, passed_over = tiles.get(path), skipped.get(path)
        stamp = _stamp(path)
        if known is not None and stamp == (known.size_bytes, known.modified_ns):
            kept.append(known)
            counts["unchanged"] += 1
        elif passed_over is not None and stamp == (passed_over.size_bytes, passed_over.modified_ns):
            passed.append(passed_over)
        else:
            try:
                kept.append(read_tile(path))
                counts["new" if known is None else "changed"] += 1
            except (DemReadError, FrameError) as error:
                passed.append(Skipped(path, str(error), *stamp))
    gone = len(set(tiles) - {tile.path for tile in kept})
    indexed = GroundLibrary(
        tuple(sorted(kept, key=lambda tile: tile.path)),
        sources,
        left_out,
        tuple(sorted(passed, key=lambda one: one.path)),
    )
    return indexed, Indexed(counts["new"], counts["changed"], counts["unchanged"], gone, indexed.skipped)


def without(library: GroundLibrary, paths: Iterable[str | Path]) -> tuple[GroundLibrary, int]:
    """(the library without what lies at or in some paths, how many tiles that were). Files stay where they are.

    Raises DemReadError for a path that the library does not know.
    """
    left = library
    for path in (os.path.abspath(path) for path in paths):  # noqa: PTH100 - of what may be gone, links as they were
        real = os.path.realpath(path)
        tiles = tuple(tile for tile in left.tiles if not _is_within(tile.path, real))
        sources = tuple(source for source in left.sources if not _is_within(source, real))
        if len(tiles) == len(left.tiles) and len(sources) == len(left.sources):
            raise DemReadError(f"The ground library knows no tile at {path}.")
        still = any(_is_within(real, source) for source in sources)
        left = GroundLibrary(
            tiles,
            sources,
            (*left.left_out, real) if still else left.left_out,
            tuple(one for one in left.skipped if not _is_within(one.path, real)),
        )
    return left, len(library.tiles) - len(left.tiles)


def read_library(path: Path) -> GroundLibrary:
    """The library in a file; without the file it is empty. Raises DemReadError where it is damaged, OSError."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return GroundLibrary()
    except ValueError as error:
        raise _damaged(path) from error
    try:
        if document["layout"] != LAYOUT:
            raise DemReadError(f"The ground library {path.name} was made by another release; index its folders anew.")
        crs = document["crs"]
        tiles = tuple(_tile(fields, crs) for fields in document["tiles"])
        skipped = tuple(Skipped(**fields) for fields in document["skipped"])
        return GroundLibrary(tiles, tuple(document["sources"]), tuple(document["left_out"]), skipped)
    except (KeyError, TypeError, IndexError) as error:
        raise _damaged(path) from error


@contextmanager
def edited(path: Path) -> Iterator[_Editing]:
    """The library in a file, for one who changes it: ``editing.library`` is written when the block ends well.

    Others who do the same wait meanwhile; readers see the old one or the new. Raises DemReadError, OSError.
    """
    with path.with_suffix(".lock").open("ab") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        editing = _Editing(read_library(path))
        yield editing
        _write(editing.library, path)


@dataclass(slots=True)
class _Editing:
    library: GroundLibrary


def _write(library: GroundLibrary, path: Path) -> None:
    crs = list(dict.fromkeys(tile.crs_text for tile in library.tiles))
    tiles = [{**asdict(tile), "crs_text": crs.index(tile.crs_text)} for tile in library.tiles]
    document = {
        "layout": LAYOUT,
        "sources": library.sources,
        "left_out": library.left_out,
        "crs": crs,
        "tiles": tiles,
        "skipped": [asdict(one) for one in library.skipped],
    }
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_text(json.dumps(document, allow_nan=False), encoding="utf-8")
    unfinished.replace(path)


def _tile(fields: dict[str, Any], crs: Sequence[str]) -> Tile:
    outline = tuple((float(lon), float(lat)) for lon, lat in fields["outline_deg"])
    return Tile(**{**fields, "crs_text": crs[fields["crs_text"]], "outline_deg": outline})


def _damaged(path: Path) -> DemReadError:
    return DemReadError(f"The ground library {path.name} is damaged; delete it and index its folders anew.")


def _existing(path: str | Path) -> Path:
    found = Path(path).expanduser()
    if not found.exists():
        raise DemReadError(f"There is no file or folder {str(path)[:200]!r} to index.")
    return found.resolve()


def _files_in(source: Path) -> Iterator[str]:
    if source.is_file():
        yield str(source)
    for folder, _, names in os.walk(source):
        for name in names:
            if os.path.splitext(name)[1].lower() in SUFFIXES:  # noqa: PTH122 - a path object each takes far longer
                yield os.path.realpath(os.path.join(folder, name))  # noqa: PTH118 - as above: a path object each takes far longer


def _stamp(path: str) -> tuple[int, int]:
    try:
        found = os.stat(path)  # noqa: PTH116 - as above: a path object each takes far longer
    except OSError:  # a link that leads nowhere
        return 0, 0
    return found.st_size, found.st_mtime_ns


def _is_within(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)
