"""A baseline told and written: summary, a row for each epoch as CSV, places as GeoJSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from gnss import Place, ecef_to_enu_m
from gnss.differential import Baseline, Fix
from gnss.sky import R_ecef_to_enu, place_of_ecef

from .csv_table import TableWriter
from .geojson import Feature, feature

__all__ = ["BaselineSummary", "summary_of", "write_baseline"]

COLUMNS = (
    *("gps_time_s", "fix", "lon_deg", "lat_deg", "ellipsoid_height_m", "east_m", "north_m", "up_m"),
    *("sigma_east_m", "sigma_north_m", "sigma_up_m", "ratio", "satellites"),
)


class PlaceOut(BaseModel):
    """A place on Earth."""

    lon_deg: float = Field(description="WGS 84 longitude, degrees.")
    lat_deg: float = Field(description="WGS 84 latitude, degrees.")
    height_m: float = Field(description="Above the ellipsoid, metres.")


class FromBase(BaseModel):
    """Where the rover was from the base."""

    east_m: float = Field(description="True east of the base, metres.")
    north_m: float = Field(description="True north of it, metres.")
    up_m: float = Field(description="Above its horizontal, metres.")


class BaselineSummary(BaseModel):
    """A baseline in numbers."""

    epochs: int = Field(description="Of the rover.")
    fixed: int = Field(description="Epochs whose cycles are whole numbers.")
    floating: int = Field(description="Epochs whose cycles are not.")
    by_code: int = Field(description="Epochs with code alone.")
    base: PlaceOut
    last_fixed: FromBase | None = Field(description="From the base at the last fixed epoch; null where none is.")
    left_out: int | None = Field(description="Rows of satellites behind the terrain; null where no DEM was asked.")
    warnings: list[str] = Field(description="What to know, in sentences.")


def summary_of(found: Baseline, left_out: int | None) -> BaselineSummary:
    """The baseline in numbers."""
    place = place_of_ecef(found.base_ecef_m)
    fixed = np.flatnonzero(found.fix == Fix.FIXED)
    last = ecef_to_enu_m(place, found.rover_ecef_m[fixed[-1]]) if len(fixed) else None
    return BaselineSummary(
        epochs=len(found.fix),
        fixed=len(fixed),
        floating=int((found.fix == Fix.FLOAT).sum()),
        by_code=int((found.fix == Fix.CODE).sum()),
        base=PlaceOut(lon_deg=place.lon_deg, lat_deg=place.lat_deg, height_m=place.height_m),
        last_fixed=None if last is None else FromBase(east_m=last[0], north_m=last[1], up_m=last[2]),
        left_out=left_out,
        warnings=list(found.warnings),
    )


def write_baseline(found: Baseline, summary: BaselineSummary, folder: Path) -> None:
    """baseline.csv, baseline.geojson and baseline.json; times are GPS time since 1980-01-06."""
    place = place_of_ecef(found.base_ecef_m)
    turn = R_ecef_to_enu(place)
    features: list[Feature] = []
    with (folder / "baseline.csv").open("w", encoding="utf-8", newline="") as file:
        writer = TableWriter(file)
        writer.row(COLUMNS)
        for n, code in enumerate(found.fix):
            fix = Fix(code).name.lower()
            if code == Fix.NONE:
                writer.row([f"{found.time_s[n]:.3f}", fix, *[""] * 10, 0])
                continue
            at = place_of_ecef(found.rover_ecef_m[n])
            enu_m = ecef_to_enu_m(place, found.rover_ecef_m[n])
            sigmas_m = _sigmas_m(turn @ found.covariance_m2[n] @ turn.T)
            row = [f"{found.time_s[n]:.3f}", fix, f"{at.lon_deg:.9f}", f"{at.lat_deg:.9f}", f"{at.height_m:.4f}"]
            row += [f"{value:.4f}" for value in (*enu_m, *sigmas_m)]
            writer.row([*row, f"{found.ratio[n]:.2f}", int(found.satellites[n])])
            told = {"gps_time_s": round(float(found.time_s[n]), 3), "fix": fix, "ellipsoid_height_m": at.height_m}
            features.append(feature("Point", _coordinates(at), told))
    collection = {"type": "FeatureCollection", "altitudes_are": "metres above the ellipsoid", "features": features}
    (folder / "baseline.geojson").write_text(json.dumps(collection, allow_nan=False), encoding="utf-8")
    (folder / "baseline.json").write_text(summary.model_dump_json(indent=1), encoding="utf-8")


def _sigmas_m(covariance_m2: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    # RTKLIB rounds to float, so that a variance near zero may come out below it
    return np.sqrt(np.maximum(covariance_m2.diagonal(), 0.0))


def _coordinates(place: Place) -> list[float]:
    return [round(place.lon_deg, 9), round(place.lat_deg, 9), round(place.height_m, 4)]
