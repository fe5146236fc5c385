"""Ground of an area from a source that the operator lists."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from service.errors import RequestError
from service.settings import Settings
from terrain import Area, Tile, area_in_degrees, grown_area

from .blocks import BlockStore
from .schemes import GroundSource
from .windows import fetch_tiles

__all__ = ["fetch_area", "source_named"]

# the grid is the box around the area on a map turned by up to some degrees: its corners reach a little further
CORNERS = 0.05


def source_named(name: str, settings: Settings) -> GroundSource:
    """The source of that name. Raises RequestError where the operator lists none such."""
    source = settings.ground_sources.get(name)
    if source is None:
        listed = ", ".join(sorted(settings.ground_sources)) or "none"
        raise RequestError(f"There is no source of ground {name[:64]!r}; the operator lists: {listed}.")
    return source


def fetch_area(
    source: GroundSource,
    area: Area,
    margin_m: float,
    store: BlockStore,
    folder: Path,
    *,
    max_cells: int,
    progress: Callable[[float], None],
) -> list[Tile]:
    """Tiles in ``folder`` that hold the area and its margin. Raises as ``fetch_tiles``, AreaError, FrameError."""
    wanted = area_in_degrees(grown_area(area, margin_m))
    west, south, east, north = wanted.bounds
    more = CORNERS * max(east - west, north - south)
    return fetch_tiles(source, wanted.envelope.buffer(more, join_style="mitre"), store, folder, max_cells, progress)
