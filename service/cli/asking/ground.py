"""Which ground a command is about: ``--area``, ``--around``, ``--polygon`` and ``--margin``, and what its DEM may be.

A DEM is a file, a folder of tiles, ``@ground`` (the ground library), or ``@NAME`` of a source that the settings list.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from service.errors import RequestError
from service.files.written import written_number

from ..output import progress_bar
from .options import GROUP, Reading, option, told

if TYPE_CHECKING:
    from service.parts.areas import AnyArea
    from service.parts.geojson_reading import Fields
    from service.settings import Settings
    from terrain import Area, ElevationGrid

__all__ = ["LIBRARY_WORD", "AreaOptions", "Margin", "area_asked", "read_tiles"]

LIBRARY_WORD = "@ground"
RADIUS = re.compile(r"(\d+(?:\.\d*)?|\.\d+)\s*(km|m)?")


def _is_a_margin(kind: object, value: float | None) -> None:
    if value is not None and not (math.isfinite(value) and value >= 0.0):
        raise ValueError(f"--margin must be a number of metres >= 0, not {value:g}.")


Margin = Annotated[
    float | None,
    option("Read only so far around the area, metres: ground that hides it.", "M", "--margin"),
    Parameter(validator=_is_a_margin),
]


@GROUP
@dataclass(frozen=True, slots=True)
class AreaOptions:
    """The ``area`` of a request."""

    area: Annotated[str | None, option("Only this box: degrees, or metres where pairs are.", "W,S,E,N")] = None
    around: Annotated[str | None, option("Only what is so near to a place: -84.23,36.2,5km.", "PLACE,RADIUS")] = None
    polygon: Annotated[Path | None, option("Only the polygon in a GeoJSON file, in degrees.", "FILE")] = None

    def part(self, *, in_degrees: bool) -> Fields | None:
        """As the request has it; None without any of these options. Raises RequestError."""
        if sum(given is not None for given in (self.area, self.around, self.polygon)) > 1:
            raise RequestError("Give only one of --area, --around and --polygon.")
        if self.area is not None:
            unit = "deg" if in_degrees else "m"
            sides = _numbers("--area", self.area, self.area.split(","), 4, "W,S,E,N")
            return dict(zip((f"west_{unit}", f"south_{unit}", f"east_{unit}", f"north_{unit}"), sides, strict=True))
        if self.around is not None:
            return _circle(self.around, in_degrees=in_degrees)
        return None if self.polygon is None else _polygon(self.polygon)


def area_asked(fields: Fields | None) -> AnyArea | None:
    """The area of these fields, checked; None of none. Raises RequestError."""
    if fields is None:
        return None
    from pydantic import TypeAdapter, ValidationError

    from service.parts.areas import AreaChoice
    from service.parts.sentences import sentence_of

    choice: TypeAdapter[AnyArea] = TypeAdapter(AreaChoice)
    try:
        return choice.validate_python(fields)
    except ValidationError as error:
        raise RequestError(sentence_of(error)) from error


def read_tiles(
    dem: str, reading: Reading, asked: AnyArea | None = None, margin_m: float | None = None
) -> ElevationGrid | None:
    """The ground of tiles, no more than the area and the margin around it; None where one file is to be read whole.

    Raises DemReadError, FrameError, AreaError, RequestError.
    """
    from service.parts.areas import area_of
    from terrain import read_mosaic, read_tile

    tiles = dem.startswith("@") or Path(dem).is_dir()
    if margin_m is not None and asked is None:
        raise RequestError("--margin goes with an area: give --area, --around or --polygon too.")
    if not tiles and margin_m is None:
        return None
    given = [name for name in told(reading) if name not in ("crs", "cell_m", "resolution_m", "cover")]
    if given:
        raise RequestError(f"--{given[0].replace('_', '-')} is for a DEM in one file that is read whole.")
    crs, cell_m, resolution_m = reading.crs, reading.cell_m, reading.resolution_m
    if tiles or asked is None:
        return _of_tiles(dem, _area(asked, crs), margin_m or 0.0, crs, cell_m, resolution_m)
    tile = read_tile(dem)
    area = area_of(asked, crs or tile.crs_text)
    return read_mosaic([tile], area, margin_m=margin_m or 0.0, target_crs=crs, cell_m=cell_m, resolution_m=resolution_m)


def _of_tiles(
    dem: str, area: Area | None, margin_m: float, crs: str | None, cell_m: float | None, resolution_m: float | None
) -> ElevationGrid:
    """Ground of a folder, of the library, or of a source."""
    from service.ground.coverage import library_in
    from service.settings import Settings
    from terrain import GroundLibrary, index_ground, read_mosaic

    settings = Settings()
    if dem.startswith("@") and area is None:
        raise RequestError(f"{dem} needs an area: --around PLACE,RADIUS, --area W,S,E,N or --polygon FILE.")
    if dem.startswith("@") and dem != LIBRARY_WORD and area is not None:
        if resolution_m is not None:
            raise RequestError("--resolution is for files that are here; of a source give --cell-m.")
        return _from_source(dem[1:], area, margin_m, crs, cell_m, settings)
    passed_over: list[str] = []
    if dem == LIBRARY_WORD:
        tiles = library_in(settings.data_folder.absolute()).tiles
    else:
        indexed, found = index_ground(GroundLibrary(), [dem])
        tiles, passed_over = indexed.tiles, [one.why for one in found.skipped]
        if not tiles:
            raise RequestError(f"The folder {dem} holds no DEM that can be read.")
    with progress_bar("Reading tiles") as progress:
        grid = read_mosaic(
            tiles,
            area,
            margin_m=margin_m,
            target_crs=crs,
            cell_m=cell_m,
            resolution_m=resolution_m,
            progress=progress,
        )
    if not passed_over:
        return grid
    count = "1 file" if len(passed_over) == 1 else f"{len(passed_over)} files"
    warning = f"Of the folder {Path(dem).name} {count} cannot serve as tiles: {passed_over[0]}"
    provenance = replace(grid.provenance, warnings=(*grid.provenance.warnings, warning))
    return replace(grid, provenance=provenance)


def _from_source(
    name: str, area: Area, margin_m: float, crs: str | None, cell_m: float | None, settings: Settings
) -> ElevationGrid:
    from service.ground.coverage import STORE
    from service.ground.remote.blocks import BlockStore
    from service.ground.remote.windows import fetch_area, source_named
    from service.jobs.marker import claimed
    from terrain import read_mosaic

    source = source_named(name, settings)
    kept = BlockStore(claimed(settings.data_folder) / STORE, settings.max_ground_store_bytes)
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder, progress_bar("Reading the source") as progress:
        tiles = fetch_area(
            source, area, margin_m, kept, Path(folder), max_cells=settings.max_dem_cells, progress=progress
        )
        return read_mosaic(tiles, area, margin_m=margin_m, target_crs=crs, cell_m=cell_m)


def _area(asked: AnyArea | None, crs: str | None) -> Area | None:
    """The area where it has a place without a DEM: in degrees, or in metres of --crs."""
    from service.parts.areas import area_of
    from terrain import GRID_METRES

    if asked is None:
        return None
    area = area_of(asked, crs or GRID_METRES)
    if area.frame == GRID_METRES:
        raise RequestError("Of tiles an area is in degrees (--lonlat), or in metres of --crs.")
    return area


def _circle(text: str, *, in_degrees: bool) -> Fields:
    *place, radius = text.split(",")
    x, y = _numbers("--around", text, place, 2, "PLACE,RADIUS, such as -84.23,36.2,5km")
    found = RADIUS.fullmatch(radius.strip())
    if found is None:
        raise RequestError(f"--around {text!r} ends in no radius in metres or kilometres, such as 5000 or 5km.")
    names = ("lon_deg", "lat_deg") if in_degrees else ("east_m", "north_m")
    return {names[0]: x, names[1]: y, "radius_m": float(found[1]) * (1000.0 if found[2] == "km" else 1.0)}


def _polygon(file: Path) -> Fields:
    from .path_files import polygon_fields

    polygons = polygon_fields(file)
    if len(polygons) != 1:
        raise RequestError(f"The file {file.name} holds {len(polygons)} polygons; an area is one.")
    return polygons[0]


def _numbers(option: str, text: str, words: Sequence[str], count: int, form: str) -> list[float]:
    try:
        numbers = [written_number(word) for word in words]
    except ValueError as error:
        raise RequestError(f"{option} {text!r} is not of the form {form}.") from error
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise RequestError(f"{option} {text!r} is not of the form {form}.")
    return numbers
