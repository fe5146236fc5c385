"""How dense a canopy is, out of a log in a request: the same as ``sightline canopy fit``, answered at once."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.errors import RequestError
from service.files.canopy_fits import CanopyFitOut, fit_of_log
from service.files.canopy_logs import CanopyLog, read_canopy_log, read_paired_stations
from service.parts.altitude_datums import in_dem_datum
from service.parts.anchors import AnchorIn
from service.parts.canopy import RasterIn
from service.parts.cover import CoverParameters
from service.parts.map_facts import DemId
from service.parts.points import NotNegativeMetres
from terrain import ElevationGrid

__all__ = ["CanopyFitIn", "canopy_fit"]

NETCDF = (".nc", ".nc4")
WHAT_IS_FITTED = ("model", "depth_per_m", "sky", "densities", "season")
# three losses of a satellite as rows of a table: 10, 5 and 3 dB at 15, 30 and 60 degrees
LOG: JsonValue = {
    "name": "canopy_log.csv",
    "base64": "c2F0ZWxsaXRlLGVsZXZhdGlvbl9kZWcsbG9zc19kYgpHMDUsMTUsMTAKRzA1LDMwLDUKRzA1LDYwLDMK",
}
Degrees = Annotated[float, Field(strict=True, ge=0.0, le=90.0)]
Station = Annotated[str, Field(min_length=1, max_length=100)]


class CanopyLogIn(RasterIn):
    """A file of what was heard through trees: CSV, or gnssvod's NetCDF of two stations."""


class CanopyFitIn(CoverParameters):
    """A log of what was heard through trees, and what is known of those."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"log": LOG, "cover": {"canopy": {"top_m": 20.0}}, "min_elevation_deg": 10.0}]}
    )

    log: CanopyLogIn = Field(
        description="Columns of the CSV: loss_db, or cn0_dbhz with cn0_open_dbhz, each with elevation_deg; or "
        "power_dbm with anchor_id and a place. Besides satellite, azimuth_deg, east_m, north_m or lon_deg, lat_deg, "
        "above_ground_m or altitude_m."
    )
    dem_id: DemId | None = Field(
        None, description="The ground of the places in the log; null: even trees, and ways that lead up to satellites."
    )
    anchors: list[AnchorIn] = Field([], description="What sent, each with its radio: of a log of power_dbm.")
    below: Station | None = Field(None, description="Station below the trees, of a NetCDF.")
    above: Station | None = Field(None, description="Station in the open, of a NetCDF.")
    system: Annotated[str, Field(pattern=r"^[A-Z]$")] = Field(
        "G", description="Letter of the satellites that are taken of a NetCDF: G for GPS."
    )
    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5, description="Height of receivers whose height the log does not tell, metres."
    )
    min_elevation_deg: Degrees = Field(10.0, description="Of ways up to satellites that are used, degrees.")
    sectors: Annotated[int, Field(strict=True, ge=0, le=72)] = Field(
        0, description="So many sectors of azimuth of a map by direction, a number; 0: one density alone."
    )
    rings_deg: Annotated[list[Degrees], Field(min_length=2, max_length=37)] = Field(
        [10.0, 30.0, 50.0, 90.0], description="Ascending edges of elevation of that map, degrees."
    )

    @model_validator(mode="after")
    def _nothing_unused(self) -> Self:
        canopy = None if self.cover is None else self.cover.canopy
        if canopy is not None and canopy.model_fields_set & set(WHAT_IS_FITTED):
            raise ValueError(f"What trees cost is what is fitted: leave out {', '.join(WHAT_IS_FITTED)} of the canopy.")
        if self.dem_id is None and self.cover is not None:
            bare = self.cover.footprints is None and not self.cover.meshes
            if canopy is None or canopy.top_m is None or canopy.bases is not None or not bare:
                raise ValueError("Without a dem_id only a canopy of top_m and base_m counts of a cover.")
        if "rings_deg" in self.model_fields_set and not self.sectors:
            raise ValueError("rings_deg needs sectors.")
        return self


def canopy_fit(grid: ElevationGrid | None, asked: CanopyFitIn) -> CanopyFitOut:
    """The fit of a request; grid: its ground with its trees.

    Raises RequestError, CoverError, AnchorError, FrameError, SignalError, VerticalDatumError, VisibilityInputError.
    """
    log = _log(asked)
    if asked.anchors and not log.has("power_dbm"):
        raise RequestError("Anchors go with a log of power_dbm.")
    told: tuple[str, ...] = ()
    if grid is not None:
        asked, told = in_dem_datum(grid, asked)
    canopy = None if asked.cover is None else asked.cover.canopy
    found = fit_of_log(
        log,
        grid,
        anchors=asked.anchors,
        crowns_m=(0.0, None) if canopy is None else (canopy.base_m, canopy.top_m),
        receiver_above_ground_m=asked.receiver_above_ground_m,
        rings_deg=asked.rings_deg if asked.sectors else (),
        sectors=asked.sectors,
        min_elevation_deg=asked.min_elevation_deg,
    )
    return found.model_copy(update={"warnings": [*told, *found.warnings]})


def _log(asked: CanopyFitIn) -> CanopyLog:
    """The log of a request. Raises RequestError."""
    pair = asked.below, asked.above
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder:
        path = Path(folder) / asked.log.name
        path.write_bytes(asked.log.base64)
        if path.suffix.lower() not in NETCDF:
            if pair != (None, None):
                raise RequestError("below and above go with a NetCDF of gnssvod, a file .nc.")
            return read_canopy_log(path)
        if asked.below is None or asked.above is None:
            raise RequestError("Of a NetCDF of gnssvod tell the stations: below and above.")
        return read_paired_stations(path, asked.below, asked.above, asked.system)
