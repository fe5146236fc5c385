"""How high the zero of a vertical datum lies above the WGS 84 ellipsoid: by PROJ's grids, or the EGM96 that is here."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.crs import CompoundCRS
from pyproj.transformer import AreaOfInterest, TransformerGroup

from ..errors import VerticalDatumError
from .geoid import egm96_height_m
from .references import EGM96, MEAN_SEA_LEVEL, HeightReference, VerticalDatum

__all__ = ["ZeroSurface", "datum_step_m", "zero_surface"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ZeroSurface:
    """Where a datum's zero lies.

    height_m: above the WGS 84 ellipsoid, metres. model: what gave it, in words. missing: the grids that PROJ would need
    for this datum's own model, where EGM96 stands in for it; else empty.
    """

    height_m: Array
    model: str
    missing: str = ""


def zero_surface(datum: VerticalDatum, lon_deg: Array, lat_deg: Array) -> ZeroSurface:
    """The zero of a datum at WGS 84 degrees, (n,) each; other ellipsoids are taken for WGS 84's, 2 m off at most."""
    if datum.reference is HeightReference.ELLIPSOID:
        return ZeroSurface(np.zeros(np.shape(lon_deg)), datum.name)
    if datum in (EGM96, MEAN_SEA_LEVEL):
        return ZeroSurface(egm96_height_m(lon_deg, lat_deg), "EGM96")
    missing = f"a geoid model of {datum.name}"
    if datum.crs is not None and np.size(lon_deg):
        lon = (np.asarray(lon_deg, np.float64) + 180.0) % 360.0 - 180.0
        # PROJ has other models for other countries; whole degrees, so that neighbours share one look into its tables
        area = (np.floor(lon.min()), np.floor(np.min(lat_deg)), np.ceil(lon.max()), np.ceil(np.max(lat_deg)))
        ways, missing = _ways(datum.crs, tuple(float(edge) for edge in area))
        for way in ways:
            height_m = np.asarray(way.transform(lon, lat_deg, np.zeros_like(lon))[2], np.float64)
            if np.isfinite(height_m).all():
                return ZeroSurface(height_m, way.description)
        missing = missing or f"a geoid model of {datum.name} that covers this place"
    return ZeroSurface(egm96_height_m(lon_deg, lat_deg), "EGM96", missing)


def datum_step_m(
    given: VerticalDatum, wanted: VerticalDatum, lon_deg: Array, lat_deg: Array
) -> tuple[Array, tuple[str, ...]]:
    """(what to add to heights above one datum for heights above another, metres (n,); what there is to tell of it).

    Sea level without a model's name is the other side's own. Raises VerticalDatumError where two surfaces of gravity
    differ by what no model here tells.
    """
    sea = given.reference is wanted.reference is HeightReference.SEA_LEVEL
    if given == wanted or (sea and MEAN_SEA_LEVEL in (given, wanted)):
        return np.zeros(np.shape(lon_deg)), ()
    begin, end = (zero_surface(datum, lon_deg, lat_deg) for datum in (given, wanted))
    missing = begin.missing or end.missing
    if missing and sea:
        raise VerticalDatumError(
            f"Heights above {given.name} cannot be brought to {wanted.name}: PROJ lacks {missing}. Install it "
            "(projsync, or the package proj-data), or name the DEM's own datum."
        )
    step_m = begin.height_m - end.height_m
    if not missing:
        return step_m, ()
    lifted = given if begin.missing else wanted
    return step_m, (
        f"PROJ lacks {missing}, so EGM96 stood in for {lifted.name}: heights may be off by half a metre, in mountains "
        "by some metres.",
    )


@lru_cache(maxsize=64)
def _ways(crs: pyproj.CRS, area: tuple[float, float, float, float]) -> tuple[tuple[pyproj.Transformer, ...], str]:
    """PROJ's ways from a vertical CRS to the ellipsoid whose grids are here, best first; which grids others lack."""
    west, south, east, north = area
    whole = CompoundCRS("heights", [pyproj.CRS.from_epsg(4326), crs])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that the best one is not here is told in our words
        group = TransformerGroup(
            whole,
            pyproj.CRS.from_epsg(4979),
            always_xy=True,
            area_of_interest=AreaOfInterest(west, south, east, north),
            allow_ballpark=False,
        )
    lacking = {grid.short_name for way in group.unavailable_operations for grid in way.grids if not grid.available}
    # .tif are those that PROJ hands out today
    return tuple(group.transformers), " or ".join(
        sorted(lacking, key=lambda name: (not name.endswith(".tif"), name))[:2]
    )
