"""Files of other programs as GeoJSON; what was left out of one is said on stderr, so that --json stays JSON."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

from service.files.foreign.reading import FOREIGN_SUFFIXES, read_foreign_file

__all__ = ["foreign_document", "is_foreign"]


def is_foreign(path: Path) -> bool:
    """Whether a file is one of another program's: KML, KMZ, GPX, or a QGroundControl plan, by its name."""
    return path.suffix.lower() in FOREIGN_SUFFIXES


def foreign_document(path: Path, kind: str | None, called: str) -> Mapping[str, object]:
    """The geometries of that kind, or of every kind, as a FeatureCollection. Raises RequestError."""
    foreign = read_foreign_file(path)
    document: Mapping[str, object] = {"type": "FeatureCollection", "features": [*foreign.features]}
    told = foreign.told
    if kind is not None:
        document, told = foreign.only(kind, called)
    for sentence in told:
        print(f"{path.name}: {sentence}", file=sys.stderr)
    return document
