"""A canopy fitted to a log: losses and ways out of its rows, the answer, and the canopy in the form of requests."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field, JsonValue

from service.errors import RequestError
from service.files.canopy_logs import CanopyLog
from service.parts.anchors import AnchorIn
from service.parts.cover import notes_on_cover
from service.parts.shapes_in_grid import resolve_anchor
from terrain import ElevationGrid, height_at, to_grid_frame
from terrain.version import VERSION
from visibility.cover import Canopy, VegetationLoss, early_itu_loss, p833_slant_loss, weissberger_loss
from visibility.cover.vegetation import DB_PER_DEPTH
from visibility.signal import CanopyFit, HeardThrough, fit_canopy, foliage_of, heard_from, ways_upwards

__all__ = ["CanopyFitOut", "fit_of_log"]

Reals = npt.NDArray[np.float64]
L1_HZ = 1575.42e6
HEARD = ("loss_db", "cn0_dbhz", "cn0_open_dbhz", "power_dbm")
PLACES = ("east_m", "north_m", "lon_deg", "lat_deg", "above_ground_m", "altitude_m")


class CanopyFitOut(BaseModel):
    """How dense a canopy is, and how well that explains what was heard."""

    count: int = Field(description="Losses that were used, a number.")
    sources: int = Field(description="Satellites or anchors that they are of, a number.")
    depth_per_m: float = Field(description="Optical depth per metre of way, 1/m; straight up where canopy is null.")
    sigma_per_m: float | None = Field(description="One-sigma error of it, from how much sources differ; null = of one.")
    db_per_m: float = Field(description="The same in dB per metre: 4.34 times the depth.")
    rms_db: float = Field(description="What it leaves of the losses, rms, dB.")
    held_out_rms_db: float | None = Field(description="The same of each half of the log by the other, dB.")
    sky_rms_db: float | None = Field(None, description="What the map by direction leaves, rms, dB; null without one.")
    sky_held_out_rms_db: float | None = Field(None, description="The same of each half by the other, dB.")
    sky_sigma_per_m: list[list[float | None]] | None = Field(
        None, description="One-sigma error of each cell of the map, 1/m; null where the density of all stands in."
    )
    sky_counts: list[list[int]] | None = Field(None, description="Losses in each cell of the map, numbers.")
    published_rms_db: dict[str, float] = Field(
        description="What published models leave of the losses as they come, rms, dB, at the frequency that was heard."
    )
    canopy: dict[str, JsonValue] | None = Field(
        description="The canopy of a request's cover, without heights where a raster told them; null where neither a "
        "DEM nor a height of trees was given."
    )
    warnings: list[str] = Field(description="What to know, in sentences.")
    version: str = Field(description="Version of Sightline that fitted it.")


def fit_of_log(
    log: CanopyLog,
    grid: ElevationGrid | None,
    *,
    anchors: Sequence[AnchorIn] = (),
    crowns_m: tuple[float, float | None] = (0.0, None),
    receiver_above_ground_m: float = 1.5,
    rings_deg: Sequence[float] = (),
    sectors: int = 0,
    min_elevation_deg: float = 0.0,
) -> CanopyFitOut:
    """The fit of a log. grid: the ground of its places with its trees; None: ways lead up to satellites through trees
    between crowns_m, (base, top) over the ground, top None = not known, or in the frame of the grid's own canopy.

    Raises RequestError, CoverError, AnchorError, FrameError, VisibilityInputError.
    """
    heard, frequency_hz = _heard(log, grid, anchors, crowns_m, receiver_above_ground_m)
    told = (*_unread(log, grid), *_told(grid, crowns_m))
    if not _is_of_powers(log):
        low = ~(heard.elevation_rad >= math.radians(min_elevation_deg))
        lower = int((low & np.isfinite(heard.elevation_rad)).sum())
        if lower:
            told = (f"Of satellites lower than {min_elevation_deg:g}° losses count as not known: {lower}.", *told)
        heard = _without(heard, low)
    rings = tuple(math.radians(edge) for edge in rings_deg)
    fit = fit_canopy(heard, log.source if (log.source != "").any() else None, rings_rad=rings, sectors=sectors)
    return _answer(fit, heard, frequency_hz, _as_asked(fit, grid, crowns_m, rings_deg), told)


def _heard(
    log: CanopyLog,
    grid: ElevationGrid | None,
    anchors: Sequence[AnchorIn],
    crowns_m: tuple[float, float | None],
    receiver_m: float,
) -> tuple[HeardThrough, float]:
    """(losses and ways, the frequency that was heard)."""
    if _is_of_powers(log):
        return _of_powers(log, grid, anchors, receiver_m)
    loss_db = log.column("loss_db") if log.has("loss_db") else log.column("cn0_open_dbhz") - log.column("cn0_dbhz")
    elevation = np.radians(log.column("elevation_deg"))
    azimuth = np.radians(log.columns.get("azimuth_deg", np.full(log.count, np.nan)))
    if grid is not None:
        way_m = ways_upwards(_canopy(grid), _places(log, grid, receiver_m), azimuth, elevation)
        return HeardThrough(loss_db, way_m, azimuth, elevation), L1_HZ
    base_m, top_m = crowns_m
    thick_m = 1.0 if top_m is None else top_m - max(base_m, receiver_m)
    if not thick_m > 0.0:
        raise RequestError(
            f"Crowns from {base_m:g} to {top_m:g} m over the ground are not above a receiver at {receiver_m:g} m."
        )
    up = np.where(elevation > 0.0, np.sin(elevation), np.nan)
    return HeardThrough(loss_db, thick_m / up, azimuth, elevation), L1_HZ


def _is_of_powers(log: CanopyLog) -> bool:
    return log.has("power_dbm") and not log.has("loss_db")


def _unread(log: CanopyLog, grid: ElevationGrid | None) -> tuple[str, ...]:
    """What the log has and nothing is taken from, in words."""
    taken = ("loss_db",) if log.has("loss_db") else ("power_dbm",) if log.has("power_dbm") else HEARD[1:3]
    beside = [name for name in HEARD if log.has(name) and name not in taken]
    places = [name for name in PLACES if log.has(name)] if grid is None else []
    found = [f"beside {taken[0]} {', '.join(beside)}"] if beside else []
    found += [f"without a DEM {', '.join(places)}"] if places else []
    return (f"Columns of the log that are not used: {'; '.join(found)}.",) if found else ()


def _of_powers(
    log: CanopyLog, grid: ElevationGrid | None, anchors: Sequence[AnchorIn], receiver_m: float
) -> tuple[HeardThrough, float]:
    if grid is None or not anchors:
        raise RequestError("Of power_dbm the ground and the anchors with their radio are needed: a DEM and anchors.")
    placed = {one.id: resolve_anchor(grid, one) for one in anchors}
    strange = sorted(set(log.source.tolist()) - set(placed))
    if strange:
        raise RequestError(
            f"The log {log.name} heard {', '.join(strange[:5]) or 'nobody named'}, not among the anchors."
        )
    places_m, power_dbm = _places(log, grid, receiver_m), log.column("power_dbm")
    parts = {name: np.full(log.count, np.nan) for name in ("loss_db", "way_m", "azimuth_rad", "elevation_rad")}
    frequencies = set()
    for name, anchor in placed.items():
        rows = np.flatnonzero((log.source == name) & np.isfinite(places_m).all(axis=1))
        found = heard_from(grid, _canopy(grid), anchor, places_m[rows], power_dbm[rows])
        for part, values in parts.items():
            values[rows] = getattr(found, part)
        assert anchor.radio is not None, "heard_from has refused those without"
        frequencies.add(anchor.radio.frequency_hz)
    if len(frequencies) > 1:
        raise RequestError("A density is that of one frequency; fit the radios of each by themselves.")
    return HeardThrough(**parts), frequencies.pop()


def _canopy(grid: ElevationGrid) -> Canopy:
    foliage = foliage_of(grid)
    if foliage is None:
        raise RequestError("Which trees stand on the DEM is not told: a canopy by heights, surface or one height.")
    return foliage.canopy


def _places(log: CanopyLog, grid: ElevationGrid, receiver_m: float) -> Reals:
    """(n, 3) places of the receiver in the grid's frame. Raises RequestError, FrameError."""
    if log.has("lon_deg", "lat_deg"):
        east_m, north_m = to_grid_frame(grid, log.column("lon_deg"), log.column("lat_deg"))
    else:
        east_m, north_m = log.column("east_m"), log.column("north_m")
    if log.has("altitude_m"):
        return np.column_stack([east_m, north_m, log.column("altitude_m")])
    above_m = log.columns.get("above_ground_m", np.full(log.count, receiver_m))
    ground_m = np.asarray(height_at(grid, east_m, north_m), np.float64)
    if np.isnan(ground_m).any():
        raise RequestError(f"{int(np.isnan(ground_m).sum())} places of the log {log.name} are on no known ground.")
    return np.column_stack([east_m, north_m, ground_m + above_m])


def _without(heard: HeardThrough, out: npt.NDArray[np.bool_]) -> HeardThrough:
    return HeardThrough(np.where(out, np.nan, heard.loss_db), heard.way_m, heard.azimuth_rad, heard.elevation_rad)


def _as_asked(
    fit: CanopyFit, grid: ElevationGrid | None, crowns_m: tuple[float, float | None], rings_deg: Sequence[float]
) -> dict[str, JsonValue] | None:
    """The canopy of a request: density and, without a grid of its own, heights of crowns."""
    base_m, top_m = crowns_m
    if grid is None and top_m is None:
        return None
    heights: dict[str, JsonValue] = {} if top_m is None else {"top_m": top_m, "base_m": base_m}
    if fit.sky is None:
        return {**heights, "model": "density", "depth_per_m": fit.depth_per_m}
    rows: list[JsonValue] = [list(row) for row in fit.sky.depths.depth_per_m]
    sky: dict[str, JsonValue] = {"elevation_edges_deg": list(rings_deg), "depth_per_m": rows}
    return {**heights, "model": "density", "sky": sky}


def _told(grid: ElevationGrid | None, crowns_m: tuple[float, float | None]) -> tuple[str, ...]:
    if grid is not None:
        return notes_on_cover(grid)
    if crowns_m[1] is None:
        return ("The height of the trees is not known, so that the depth is that straight up; tell it.",)
    return ()


def _answer(
    fit: CanopyFit,
    heard: HeardThrough,
    frequency_hz: float,
    canopy: dict[str, JsonValue] | None,
    told: tuple[str, ...],
) -> CanopyFitOut:
    sky = fit.sky
    published: dict[str, VegetationLoss] = {}
    if canopy is not None:
        way_m = np.nan_to_num(heard.way_m)
        published = {
            "ITU-R P.833, slant": p833_slant_loss(way_m, frequency_hz, heard.elevation_rad),
            "Weissberger": weissberger_loss(way_m, frequency_hz),
            "early ITU": early_itu_loss(way_m, frequency_hz),
        }
    used = np.isfinite(heard.loss_db) & (heard.way_m > 0.0)
    left = {name: (heard.loss_db - found.loss_db)[used] for name, found in published.items()}
    return CanopyFitOut(
        count=fit.count,
        sources=fit.groups,
        depth_per_m=fit.depth_per_m,
        sigma_per_m=_number(fit.sigma_per_m),
        db_per_m=DB_PER_DEPTH * fit.depth_per_m,
        rms_db=fit.rms_db,
        held_out_rms_db=_number(fit.held_out_rms_db),
        sky_rms_db=None if sky is None else _number(sky.rms_db),
        sky_held_out_rms_db=None if sky is None else _number(sky.held_out_rms_db),
        sky_sigma_per_m=None if sky is None else [[_number(one) for one in row] for row in sky.sigma_per_m.tolist()],
        sky_counts=None if sky is None else sky.count.tolist(),
        published_rms_db={
            name: float(np.sqrt((values**2).mean())) for name, values in left.items() if np.isfinite(values).all()
        },
        canopy=canopy,
        warnings=[*fit.notes, *told],
        version=VERSION,
    )


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
