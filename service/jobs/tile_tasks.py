"""Raster layers of results as bare numbers: what worker processes tell and write of them, level by level."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Final, TypedDict

import numpy as np
import numpy.typing as npt
import rasterio
from pydantic import BaseModel, Field
from rasterio.errors import NotGeoreferencedWarning
from rasterio.windows import Window

from service.errors import NotFoundError

from .dem_tasks import TaskContext
from .folder import make_durable

__all__ = [
    "TILE_POSTS",
    "TileArguments",
    "TileLevelArguments",
    "Tiles",
    "level_name",
    "tell_tiles",
    "write_layer_level",
]

TILE_POSTS: Final = 256
POSTS_AT_ONCE = 4_000_000


class TileArguments(TypedDict):
    """A raster layer of a result that was drawn."""

    digest: str
    layer: str


class TileLevelArguments(TileArguments):
    """One of its levels."""

    level: int


class TileLevel(BaseModel):
    """One level: (bands, rows, cols) values, rows from the north."""

    level: int = Field(description="Its number; 0 holds every post.")
    rows: int = Field(description="Rows, north to south.")
    cols: int = Field(description="Columns, west to east.")
    href: str = Field("", description="Path of the whole level; its tiles are at /ROW/COL below it.")


class Tiles(BaseModel):
    """A raster layer as bare numbers, finest level first."""

    layer: str = Field(description="Name of the layer.")
    data_type: str = Field(description="float32 or uint8 as a rule, little-endian.")
    bands: list[str] = Field(description="What each band holds.")
    tile_posts: int = Field(description="Rows and columns of a tile; those at the border have fewer.")
    levels: list[TileLevel] = Field(
        description="A value of level n is that of the north-west post of a square of 2ⁿ posts a side: never a mean, "
        "so that classes stay classes."
    )


def level_name(layer: str, level: int) -> str:
    """The file of a level, beside the layer."""
    return f"{layer}.{level}.raw"


def tell_tiles(context: TaskContext, arguments: TileArguments) -> Mapping[str, object]:
    """Levels of a layer. Raises NotFoundError when it was just deleted."""
    with _opened(context, arguments) as source:
        levels = list[TileLevel]()
        while not levels or max(levels[-1].rows, levels[-1].cols) > TILE_POSTS:
            posts = 2 ** len(levels)
            rows, cols = -(-source.height // posts), -(-source.width // posts)
            levels.append(TileLevel.model_construct(level=len(levels), rows=rows, cols=cols, href=""))
        names = [name or str(band) for band, name in enumerate(source.descriptions, start=1)]
        tiles = Tiles(
            layer=arguments["layer"],
            data_type=source.dtypes[0],
            bands=names,
            tile_posts=TILE_POSTS,
            levels=levels,
        )
    return tiles.model_dump(mode="json")


def write_layer_level(context: TaskContext, arguments: TileLevelArguments) -> Mapping[str, object]:
    """Write a level, band by band, into the work folder. Raises NotFoundError when the layer was just deleted."""
    posts = 2 ** arguments["level"]
    context.work.mkdir(parents=True)
    with _opened(context, arguments) as source:
        at_once = max(1, POSTS_AT_ONCE // (source.width * posts)) * posts
        with (context.work / level_name(arguments["layer"], arguments["level"])).open("wb") as file:
            for band in source.indexes:
                for first in range(0, source.height, at_once):
                    window = Window(0, first, source.width, min(at_once, source.height - first))
                    rows: npt.NDArray[np.generic] = source.read(band, window=window)
                    picked = np.ascontiguousarray(rows[::posts, ::posts])
                    file.write(picked.astype(picked.dtype.newbyteorder("<"), copy=False).tobytes())
    make_durable(context.work)
    return {}


@contextmanager
def _opened(context: TaskContext, arguments: TileArguments) -> Iterator[rasterio.io.DatasetReader]:
    path = context.folder.layer(arguments["digest"], arguments["layer"])
    if not path.is_file():
        raise NotFoundError("result", arguments["digest"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)  # local metres are no CRS
        with rasterio.open(path) as source:
            yield source
