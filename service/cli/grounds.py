"""What a command's DEM is: a file, a folder of tiles, ``@ground`` (the ground library), or ``@NAME`` of a source."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from service.errors import RequestError
from service.ground.folder import STORE, claimed, library_in
from service.parts.area import AnyArea, area_of
from service.settings import Settings
from terrain import GRID_METRES, Area, ElevationGrid, GroundLibrary, index_ground, read_dem, read_mosaic, read_tile

from .output import progress_bar

__all__ = ["LIBRARY_WORD", "read_ground"]

LIBRARY_WORD = "@ground"


def read_ground(
    dem: str, reading: dict[str, Any], asked: AnyArea | None = None, margin_m: float | None = None
) -> ElevationGrid:
    """The ground that a command is about.

    Of tiles no more than the area and the margin around it is read; of one file all, unless there is a margin.
    Raises DemReadError, FrameError, AreaError, RequestError.
    """
    library, source = dem == LIBRARY_WORD, dem[1:] if dem.startswith("@") and dem != LIBRARY_WORD else None
    folder = not library and source is None and Path(dem).is_dir()
    if not (library or source is not None or folder or (asked is not None and margin_m is not None)):
        return read_dem(dem, **reading)
    given = [name for name, value in reading.items() if value is not None and name not in ("crs", "cell_m")]
    if given:
        raise RequestError(f"--{given[0].replace('_', '-')} is for a DEM in one file that is read whole.")
    crs, cell_m = reading.get("crs"), reading.get("cell_m")
    if not (library or folder or source is not None):
        tile = read_tile(dem)
        assert asked is not None, "else the file was read whole"
        area = area_of(asked, crs or tile.crs_text)
        return read_mosaic([tile], area, margin_m=margin_m or 0.0, target_crs=crs, cell_m=cell_m)
    return _of_tiles(dem, source, _area(asked, crs), margin_m or 0.0, crs, cell_m)


def _of_tiles(
    dem: str, source: str | None, area: Area | None, margin_m: float, crs: str | None, cell_m: float | None
) -> ElevationGrid:
    """Ground of a folder, of the library, or of a source."""
    settings = Settings()
    if dem.startswith("@") and area is None:
        raise RequestError(f"{dem} needs an area: --around PLACE,RADIUS, --area W,S,E,N or --polygon FILE.")
    if source is not None and area is not None:
        return _from_source(source, area, margin_m, crs, cell_m, settings)
    if dem == LIBRARY_WORD:
        tiles = library_in(settings.data_folder.absolute()).tiles
    else:
        tiles = index_ground(GroundLibrary(), [dem])[0].tiles
        if not tiles:
            raise RequestError(f"The folder {dem} holds no DEM that can be read.")
    with progress_bar("Reading tiles") as progress:
        return read_mosaic(tiles, area, margin_m=margin_m, target_crs=crs, cell_m=cell_m, progress=progress)


def _from_source(
    name: str, area: Area, margin_m: float, crs: str | None, cell_m: float | None, settings: Settings
) -> ElevationGrid:
    from service.ground.remote.area import fetch_area, source_named
    from service.ground.remote.blocks import BlockStore

    source = source_named(name, settings)
    kept = BlockStore(claimed(settings.data_folder).with_name(STORE), settings.max_ground_store_bytes)
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder, progress_bar("Reading the source") as progress:
        tiles = fetch_area(
            source, area, margin_m, kept, Path(folder), max_cells=settings.max_dem_cells, progress=progress
        )
        return read_mosaic(tiles, area, margin_m=margin_m, target_crs=crs, cell_m=cell_m)


def _area(asked: AnyArea | None, crs: str | None) -> Area | None:
    """The area where it has a place without a DEM: in degrees, or in metres of --crs."""
    if asked is None:
        return None
    area = area_of(asked, crs or GRID_METRES)
    if area.frame == GRID_METRES:
        raise RequestError("Of tiles an area is in degrees (--lonlat), or in metres of --crs.")
    return area
