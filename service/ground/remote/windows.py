"""Ground of an area from a source that the operator lists: the parts of its files, as small local tiles."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt
import pyproj
import rasterio
import shapely
from rasterio._err import CPLE_BaseError  # damaged tags raise it bare
from rasterio.errors import RasterioError
from rasterio.windows import Window

from service.errors import RequestError
from service.settings import GroundSource, Settings
from terrain import (
    Area,
    DemFormatError,
    GroundSourceError,
    NoGroundError,
    Tile,
    area_in_degrees,
    grown_area,
    parse_crs,
    read_tile,
)
from terrain.crs.stated import check_stated_stream
from terrain.files.raster import SEALED

from .blocks import BlockStore
from .ranged import RangedFile, client_of

if TYPE_CHECKING:
    import httpx

__all__ = ["cells_of", "fetch_area", "fetch_tiles", "source_named"]

# the grid is the box around the area on a map turned by up to some degrees: its corners reach a little further
CORNERS = 0.05
# posts around the area, so that its border lies within triangles
AROUND = 3
# files hold their degree give or take so many cells: some share their edges with the next, some do not
BORDER_CELLS = 1.5
DRIVERS = {".hgt": "SRTMHGT"}


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


def fetch_tiles(
    source: GroundSource,
    shape: shapely.Polygon,
    store: BlockStore,
    folder: Path,
    max_cells: int,
    progress: Callable[[float], None],
    client: httpx.Client | None = None,
) -> list[Tile]:
    """Tiles in ``folder`` with the posts that a shape (degrees) needs; only bytes that the store lacks are asked for.

    Raises GroundSourceError, NoGroundError where the source has nothing there, OSError.
    """
    tiles, cells = list[Tile](), cells_of(shape)
    folder.mkdir(parents=True, exist_ok=True)
    with client or client_of() as asked:
        for number, (west, south) in enumerate(cells):
            path = _fetched(asked, source, (west, south), shape, store, folder, max_cells)
            if path is not None:
                tiles.append(read_tile(path))
            progress((number + 1) / len(cells))
    if not tiles:
        raise NoGroundError(f"The source has no ground in the area: none of {len(cells)} cells of one degree is there.")
    return tiles


def cells_of(shape: shapely.Polygon) -> list[tuple[int, int]]:
    """(west, south) of the cells of one degree that a shape in degrees touches, west in −180…179."""
    west, south, east, north = shape.bounds
    found = []
    for lat in range(max(math.floor(south), -90), min(math.ceil(north), 90)):
        for lon in range(math.floor(west), math.ceil(east)):
            if shapely.box(lon, lat, lon + 1, lat + 1).intersects(shape):
                found.append(((lon + 180) % 360 - 180, lat))
    return found


def _fetched(
    client: httpx.Client,
    source: GroundSource,
    cell: tuple[int, int],
    shape: shapely.Polygon,
    store: BlockStore,
    folder: Path,
    max_cells: int,
) -> Path | None:
    url = source.url_of(*cell)
    name = url.rsplit("/", 1)[-1]
    remote = RangedFile.opened(client, url, store)
    if remote is None:
        return None
    driver = DRIVERS.get(Path(name).suffix.lower(), "GTiff")
    try:
        if driver == "GTiff":
            check_stated_stream(name, io.BufferedReader(remote.view()))
        with warnings.catch_warnings(), rasterio.Env(**SEALED):
            warnings.simplefilter("error", RuntimeWarning)
            with rasterio.open(name, driver=driver, opener=lambda path, mode="rb", **more: remote.view()) as dataset:
                _check_place(name, dataset, cell)
                values, written = _window_of(dataset, source, shape, max_cells)
    except (RasterioError, CPLE_BaseError, DemFormatError) as error:
        if remote.failure is not None:
            raise remote.failure from error
        raise GroundSourceError(f"The source's file {name} is damaged, cut short or no {driver} raster.") from error
    if remote.failure is not None:
        raise remote.failure
    if values is None:
        return None
    path = folder / f"{Path(name).stem}.tif"
    with rasterio.open(path, "w", **written) as part:
        part.write(values, 1)
    return path


def _check_place(name: str, dataset: Any, cell: tuple[int, int]) -> None:
    """Raises GroundSourceError where the raster does not lie where its name says."""
    crs = None if dataset.crs is None else parse_crs(dataset.crs.to_wkt(version="WKT2_2019"))
    if crs is None or not (crs.is_geographic or crs.is_compound):
        told = "no CRS" if crs is None else f"the CRS {crs.name!r}"
        raise GroundSourceError(f"The source's file {name} has {told}, where its name says degrees.")
    west, south = cell
    bounds, (step_x, step_y) = dataset.bounds, dataset.res
    off_x = max(abs(bounds.left - west), abs(bounds.right - west - 1.0)) / step_x
    off_y = max(abs(bounds.bottom - south), abs(bounds.top - south - 1.0)) / step_y
    if max(off_x, off_y) > BORDER_CELLS:
        raise GroundSourceError(
            f"The source's file {name} lies within {bounds.left:.4f} … {bounds.right:.4f} degrees east and "
            f"{bounds.bottom:.4f} … {bounds.top:.4f} degrees north, elsewhere than its name says."
        )


def _window_of(
    dataset: Any, source: GroundSource, shape: shapely.Polygon, max_cells: int
) -> tuple[npt.NDArray[Any] | None, dict[str, object]]:
    """(heights around the shape, None where they only touch; how they are written as a file of their own)."""
    west, south, east, north = shape.bounds
    turn = 360.0 * round(((west + east) / 2.0 - (dataset.bounds.left + dataset.bounds.right) / 2.0) / 360.0)
    inverse = ~dataset.transform
    left, top = inverse @ (west - turn, north)
    right, bottom = inverse @ (east - turn, south)
    first_col, first_row = max(math.floor(left) - AROUND, 0), max(math.floor(top) - AROUND, 0)
    last_col = min(math.ceil(right) + AROUND, dataset.width)
    last_row = min(math.ceil(bottom) + AROUND, dataset.height)
    if first_col >= last_col or first_row >= last_row:
        return None, {}
    window = Window(first_col, first_row, last_col - first_col, last_row - first_row)
    if window.width * window.height > max_cells:
        raise GroundSourceError(
            f"The area takes {window.width * window.height:,} cells of one file, more than the limit of {max_cells:,}."
        )
    values = dataset.read(1, window=window)
    crs = dataset.crs.to_wkt(version="WKT2_2019")
    if source.vertical_epsg is not None and len(pyproj.CRS.from_wkt(crs).axis_info) == 2:
        crs = f"EPSG:4326+{source.vertical_epsg}"
    moved = dataset.transform @ rasterio.Affine.translation(first_col, first_row)
    return values, {
        "driver": "GTiff", "height": values.shape[0], "width": values.shape[1], "count": 1, "dtype": values.dtype,
        "crs": crs, "transform": moved, "nodata": dataset.nodata,
    }  # fmt: skip
