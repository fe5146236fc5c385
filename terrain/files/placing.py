"""Where the posts of a file lie in metres: a CRS chosen, units converted, degrees warped."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.exceptions import ProjError

from ..crs.frames import body_of, shift_matters
from ..crs.metric import ground_scale, local_metric_crs
from ..crs.parts import axes_fault, same_map, split_shift, with_shift
from ..errors import DemUnsupportedError
from ..units import axis_unit, degrees_per_unit, in_metres, metres_per_unit
from .raw import RawDem
from .warping import Posts, border_positions, warp

__all__ = ["Placed", "axes_in_metres", "better_crs", "place"]

# a map that stretches ground by more than this is not used to measure on
STRETCH_LIMIT = 0.01
# cells finer than this, in numbers that can be longitudes and latitudes, are taken as degrees
DEGREE_CELL = 0.1
# with a corner at zero only those finer than this: coarser ones are as likely a model in metres
COARSE_DEGREE_CELL = 0.01
# no piece of ground rises more than so many times its width
STEEPEST = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Heights on a metric grid, as ElevationGrid wants them, and the sentences about how they got there."""

    heights_m: npt.NDArray[np.float32]
    cell_east_m: float
    cell_north_m: float
    origin_east_m: float
    origin_north_m: float
    crs: pyproj.CRS | None
    conversions: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def on_earth(self) -> bool:
        """Whether the ground is Earth's, as far as is known: a local frame counts as Earth."""
        return self.crs is None or body_of(self.crs).name == "Earth"


def place(
    name: str,
    raw: RawDem,
    heights_m: npt.NDArray[np.float32],
    *,
    crs: pyproj.CRS | str | None,
    target_crs: pyproj.CRS | None,
    height_unit_known: bool,
    max_cells: int,
) -> Placed:
    """Bring a file's posts into a metric frame.

    crs: the caller's CRS for the file, "local", or None; target_crs: the caller's CRS for the grid, or None.
    Raises DemUnsupportedError and DemTooLargeError.
    """
    try:
        return _place(name, raw, heights_m, crs, target_crs, height_unit_known, max_cells)
    except ProjError as error:
        raise DemUnsupportedError(f"{name} has a CRS that cannot be calculated with; give crs=.") from error


def _place(
    name: str,
    raw: RawDem,
    heights_m: npt.NDArray[np.float32],
    crs: pyproj.CRS | str | None,
    target_crs: pyproj.CRS | None,
    height_unit_known: bool,
    max_cells: int,
) -> Placed:
    conversions: list[str] = []
    warnings: list[str] = []
    source = _source_crs(name, raw, heights_m, crs, warnings)
    if source is None:
        if target_crs is not None:
            raise DemUnsupportedError(f"{name} has no CRS, so it cannot be brought to target_crs; give crs= as well.")
        metres = _local_metres(raw, crs, height_unit_known, conversions, warnings)
        x0, y0, step_x, step_y = (number * metres for number in (raw.x0, raw.y0, raw.step_x, raw.step_y))
        return Placed(heights_m, step_x, step_y, x0, y0, None, tuple(conversions), tuple(warnings))
    if target_crs is not None and (not target_crs.is_projected or metres_per_unit(target_crs) != 1.0):
        raise DemUnsupportedError(f"target_crs must be a projected CRS in metres, not {target_crs.name!r}.")
    # posts stay on their own datum, so its shift to WGS 84 is put aside and bound to the grid's CRS in the end
    source, shift = split_shift(source)
    posts = Posts(heights_m, raw.x0, raw.y0, raw.step_x, raw.step_y, source)
    if source.is_projected:
        fault = axes_fault(source) or (None if target_crs is None else axes_fault(target_crs))
        if fault is not None:
            raise DemUnsupportedError(fault)
        posts = axes_in_metres(posts, height_unit_known, conversions, warnings)
    elif not source.is_geographic:
        raise DemUnsupportedError(f"{name} has the CRS {source.name!r}, which is neither projected nor geographic.")
    if shift is not None and not shift_matters(posts.crs, with_shift(posts.crs, shift), *posts.middle):
        shift = None
    if target_crs is not None:
        target, target_shift = split_shift(target_crs)
        if same_map(target, posts.crs):
            posts, shift = replace(posts, crs=target), target_shift or shift
        else:
            shifted = replace(posts, crs=with_shift(posts.crs, shift))
            warped = _warped(name, shifted, target_crs, max_cells, conversions)
            posts, shift = replace(warped, crs=target), target_shift
    elif not raw.from_grid and (better := better_crs(name, posts, conversions)) is not None:
        posts = _warped(name, posts, better, max_cells, conversions)
    if shift is not None and not raw.from_grid:
        conversions.append("Longitude and latitude go through the datum shift (TOWGS84) that the CRS states.")
    return Placed(
        posts.heights_m, posts.step_x, posts.step_y, posts.x0, posts.y0, with_shift(posts.crs, shift),
        tuple(conversions), tuple(warnings),
    )  # fmt: skip


def _local_metres(
    raw: RawDem,
    crs: pyproj.CRS | str | None,
    height_unit_known: bool,
    conversions: list[str],
    warnings: list[str],
) -> float:
    """Metres per unit of a local frame, which a file may state without saying where it lies."""
    if raw.crs is None or not raw.crs.is_engineering or not raw.crs.axis_info:
        return 1.0
    metres, unit = metres_per_unit(raw.crs), axis_unit(raw.crs)
    if metres != 1.0:
        conversions.append(f"Positions converted from {unit} to metres (× {metres:.10g}).")
        _warn_of_heights(unit, height_unit_known, warnings)
    return metres


def _source_crs(
    name: str, raw: RawDem, heights_m: npt.NDArray[np.float32], crs: pyproj.CRS | str | None, warnings: list[str]
) -> pyproj.CRS | None:
    if isinstance(crs, pyproj.CRS):
        if raw.crs is not None and raw.crs != crs:
            warnings.append(f"The file says that its CRS is {raw.crs.name}; the given {crs.name} was taken instead.")
        return crs
    if crs == "local":
        if raw.crs is not None and not raw.crs.is_engineering:
            warnings.append(f"The file says that its CRS is {raw.crs.name}; its numbers were taken as local metres.")
        return None
    if raw.crs is not None and not raw.crs.is_engineering:
        return raw.crs
    if raw.driver not in ("NPZ", "NPY") and raw.crs is None and _looks_like_degrees(name, raw, heights_m):
        warnings.append(
            f"The file has no CRS, but its cells of {raw.step_x:.6g} at ({raw.x0:.4f}, {raw.y0:.4f}) look like "
            "degrees: taken as longitude and latitude on WGS 84 (EPSG:4326). Give crs= if they are not, "
            'crs="local" for metres.'
        )
        return pyproj.CRS.from_epsg(4326)
    if raw.driver != "NPZ":
        warnings.append(
            "The file has no CRS: its numbers are taken as metres in a local frame, without curvature, longitude and "
            "latitude. Give crs= if you know it."
        )
    return None


def _looks_like_degrees(name: str, raw: RawDem, heights_m: npt.NDArray[np.float32]) -> bool:
    """Whether a file without CRS is in degrees. Raises DemUnsupportedError where nothing tells it."""
    rows, cols = raw.values.shape
    width, depth = (cols - 1) * raw.step_x, (rows - 1) * raw.step_y
    east, south, cell = raw.x0 + width, raw.y0 - depth, max(raw.step_x, raw.step_y)
    in_range = -180.0 <= raw.x0 <= 360.0 and east <= 360.0 and south >= -90.0 and raw.y0 <= 90.0
    if cell >= DEGREE_CELL or not in_range:
        return False
    relief_m = float(np.nanmax(heights_m) - np.nanmin(heights_m))
    # a small model in metres often has its corner at zero, but so has every tile on Greenwich or the equator
    at_zero = min(abs(raw.x0), abs(east), abs(south), abs(raw.y0)) <= cell
    if at_zero and cell >= COARSE_DEGREE_CELL:
        return False
    if relief_m > 0.0:
        # ground that were steeper than any in metres, as a whole; in degrees it is flatter than the sea if it is not
        return bool(relief_m > STEEPEST * max(width, depth))
    if at_zero:
        raise DemUnsupportedError(
            f"{name} has no CRS, and its cells of {cell:.6g} at ({raw.x0:.4f}, {raw.y0:.4f}) may be degrees or metres; "
            'give crs="EPSG:4326" for degrees or crs="local" for metres.'
        )
    return True


def axes_in_metres(posts: Posts, height_unit_known: bool, conversions: list[str], warnings: list[str]) -> Posts:
    """The same posts with metres on their axes; what was done is added to the sentences."""
    metres = metres_per_unit(posts.crs)
    if metres == 1.0:
        return posts
    unit = axis_unit(posts.crs)
    crs = in_metres(posts.crs)
    conversions.append(f"Positions converted from {unit} to metres (× {metres:.10g}); the CRS is now {crs.name}.")
    _warn_of_heights(unit, height_unit_known, warnings)
    return Posts(
        posts.heights_m, posts.x0 * metres, posts.y0 * metres, posts.step_x * metres, posts.step_y * metres, crs
    )


def _warn_of_heights(unit: str, height_unit_known: bool, warnings: list[str]) -> None:
    if not height_unit_known:
        warnings.append(
            f"Positions are in {unit}, but the file does not say in what its heights are: taken as metres. "
            'Give height_unit="ft" or "us-ft" if they are not.'
        )


def better_crs(name: str, posts: Posts, conversions: list[str]) -> pyproj.CRS | None:
    """The CRS to warp to, where the file's own does not measure ground; None where it does."""
    x, y = border_positions(posts)
    if posts.crs.is_geographic:
        degrees = degrees_per_unit(posts.crs)
        return local_metric_crs(posts.crs, x * degrees, y * degrees)
    scale_east, scale_north = ground_scale(posts.crs, *posts.middle)
    if math.isnan(scale_east + scale_north):
        raise DemUnsupportedError(f"{name} does not lie where its CRS {posts.crs.name!r} is defined.")
    if max(abs(scale_east - 1.0), abs(scale_north - 1.0)) <= STRETCH_LIMIT or posts.crs.geodetic_crs is None:
        return None
    conversions.append(
        f"{posts.crs.name} makes {scale_east:.3f} m east and {scale_north:.3f} m north of a metre of this ground."
    )
    geodetic = posts.crs.geodetic_crs
    lon, lat = np.array(pyproj.Transformer.from_crs(posts.crs, geodetic, always_xy=True).transform(x, y))
    lon, lat = lon * degrees_per_unit(geodetic), lat * degrees_per_unit(geodetic)
    middle = float(np.median(lon))
    return local_metric_crs(geodetic, (lon - middle + 180.0) % 360.0 + middle - 180.0, lat)


def _warped(name: str, posts: Posts, target: pyproj.CRS, max_cells: int, conversions: list[str]) -> Posts:
    was_unknown = np.count_nonzero(np.isnan(posts.heights_m))
    warped = warp(name, posts, target, max_cells=max_cells)
    unknown = np.count_nonzero(np.isnan(warped.heights_m))
    if unknown == warped.heights_m.size:
        raise DemUnsupportedError(f"{name} has too little known ground to be warped to {target.name}.")
    unit = "degrees" if posts.crs.is_geographic else "metres"
    conversions.append(
        f"Warped from {posts.crs.name} (cells of {posts.step_x:.6g} × {posts.step_y:.6g} {unit}) to {target.name} "
        f"(cells of {warped.step_x:.6g} m east × {warped.step_y:.6g} m north), linear on the file's triangles; "
        f"{unknown:,} of {warped.heights_m.size:,} posts are unknown ({was_unknown:,} in the file), "
        "those beyond the file's slanting borders among them."
    )
    return warped
