"""Trees on the ground, as requests write them: heights or a surface, crown bases, and what a way through costs."""

from __future__ import annotations

import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, Base64Bytes, Field, model_validator

from service.parts.points import NotNegativeMetres, StrictModel
from terrain import ElevationGrid, ElevationGridError, SkyDepths, read_dem
from visibility.cover import Canopy, canopy_between, raster_over, resampled_canopy
from visibility.signal import Foliage, FoliageModel

__all__ = ["CanopyIn", "RasterIn", "SkyDepthsIn", "foliage_in"]

DepthPerM = Annotated[float, Field(strict=True, ge=0.0, le=100.0)]
ElevationDeg = Annotated[float, Field(strict=True, ge=0.0, le=90.0)]
# file systems take 255
MOST_NAME_BYTES = 200


def _file_name(name: str) -> str:
    """A name under which a file can lie anywhere. Raises ValueError."""
    if not name.strip(". ") or not name.isprintable() or len(name.encode()) > MOST_NAME_BYTES:
        raise ValueError(
            f"no file can be called that; give a name of printable letters, {MOST_NAME_BYTES} bytes at most"
        )
    return name


class RasterIn(StrictModel):
    """A raster in a file that is read as a DEM is."""

    name: Annotated[str, AfterValidator(_file_name)] = Field(
        min_length=1, max_length=200, pattern=r"^[^/\\]+$", description="What the file is called."
    )
    base64: Base64Bytes = Field(min_length=1, description="The file's bytes in base64.")


class SkyDepthsIn(StrictModel):
    """Optical depth per metre by the direction in which a way leads up, as ``sightline canopy fit`` finds it."""

    elevation_edges_deg: Annotated[list[ElevationDeg], Field(min_length=2, max_length=37)] = Field(
        description="Ascending edges of rings, degrees; ways below or above all of them are of the ring beside them."
    )
    depth_per_m: Annotated[
        list[Annotated[list[DepthPerM], Field(min_length=1, max_length=72)]], Field(min_length=1, max_length=36)
    ] = Field(description="Per metre of way, 1/m: a row for each ring, equal sectors clockwise from grid north in it.")

    def depths(self) -> SkyDepths:
        """The same as the library takes it. Raises ElevationGridError."""
        edges = tuple(math.radians(edge) for edge in self.elevation_edges_deg)
        return SkyDepths(edges, tuple(tuple(row) for row in self.depth_per_m))

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        try:
            self.depths()
        except ElevationGridError as error:
            raise ValueError(str(error)) from error
        return self


class CanopyIn(StrictModel):
    """Trees over the ground: they hide nothing, and weaken signals."""

    heights: RasterIn | None = Field(None, description="A raster of crown heights over the ground, metres.")
    surface: RasterIn | None = Field(
        None, description="A surface model instead; the canopy is what it has above the DEM, buildings taken out."
    )
    top_m: NotNegativeMetres | None = Field(
        None, description="One height of the crowns everywhere instead of a raster, metres."
    )
    base_m: NotNegativeMetres = Field(0.0, description="Height over the ground at which crowns begin, metres.")
    bases: RasterIn | None = Field(None, description="A raster of such heights, metres, in place of base_m.")
    model: FoliageModel = Field(
        "weissberger",
        description="What a way through costs: a published model, each for its own frequencies, or density.",
    )
    depth_per_m: DepthPerM | None = Field(
        None, description="Optical depth per metre of way, 1/m: belongs to the model density; 4.34 dB each."
    )
    sky: SkyDepthsIn | None = Field(
        None, description="The same by direction, in place of depth_per_m: belongs to the model density."
    )
    densities: RasterIn | None = Field(
        None, description="The same as a raster, 1/m, in place of depth_per_m: belongs to the model density."
    )
    season: Annotated[float, Field(strict=True, ge=0.0, le=10.0)] = Field(
        1.0, description="Factor on the loss, no unit: 1 = in leaf, or as it was fitted."
    )

    @model_validator(mode="after")
    def _one_canopy(self) -> Self:
        if sum(given is not None for given in (self.heights, self.surface, self.top_m)) != 1:
            raise ValueError("A canopy needs exactly one of heights, surface and top_m.")
        if self.bases is not None and self.base_m != 0.0:
            raise ValueError("Crowns of a canopy begin at base_m or at the heights of bases; give one.")
        depths = sum(given is not None for given in (self.depth_per_m, self.sky, self.densities))
        if depths != (1 if self.model == "density" else 0):
            raise ValueError(
                "One of a canopy's depth_per_m, sky and densities belongs to the model density, and to no other."
            )
        return self


def foliage_in(grid: ElevationGrid, asked: CanopyIn, max_cells: int) -> Foliage:
    """The canopy of a request over a grid. Raises CoverError, DemReadError, FrameError."""
    base_m: npt.ArrayLike = asked.base_m
    density, told = None, tuple[str, ...]()
    if asked.bases is not None:
        base_m, told = raster_over(grid, _raster(grid, asked.bases, max_cells), "crown base")
    if asked.heights is not None:
        canopy = resampled_canopy(grid, _raster(grid, asked.heights, max_cells), base_m)
    elif asked.surface is not None:
        canopy = canopy_between(grid, _raster(grid, asked.surface, max_cells), base_m)
    else:
        top_m = np.full(grid.shape, asked.top_m, np.float32)
        low_m = base_m if asked.bases is None else np.minimum(base_m, top_m)
        canopy = Canopy(grid, top_m, np.asarray(low_m, np.float32))
    trees = canopy.top_m > 0.0
    if asked.bases is not None:
        over = int(np.count_nonzero(trees & (np.asarray(base_m) > canopy.top_m)))
        if over:
            crownless = f"At {over} of {int(trees.sum())} posts with trees crowns would begin above their tops"
            told = (*told, f"{crownless}: no crowns there.")
    if asked.densities is not None:
        density, of_density = raster_over(grid, _raster(grid, asked.densities, max_cells), "canopy density")
        told = (*told, *of_density)
        unknown = int(np.count_nonzero(trees & np.isnan(density)))
        if unknown:
            told = (*told, f"At {unknown} of {int(trees.sum())} posts with trees their density is unknown.")
    canopy = replace(canopy, density_per_m=density, notes=(*canopy.notes, *told))
    sky = None if asked.sky is None else asked.sky.depths()
    return Foliage(canopy, asked.model, asked.depth_per_m, asked.season, sky)


def _raster(grid: ElevationGrid, asked: RasterIn, max_cells: int) -> ElevationGrid:
    """A raster in the frame of the grid; one in another is warped, which its provenance tells."""
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder:
        path = Path(folder) / asked.name
        path.write_bytes(asked.base64)
        return read_dem(path, target_crs=grid.crs, max_cells=max_cells)
