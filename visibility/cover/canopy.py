"""Canopy over a grid: how high trees are and where their crowns begin, and how far lines run through it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, height_at, same_map
from visibility.cover.kernels.canopy import SQUARE, canopy_shares, fill_spans
from visibility.cover.vegetation import MOST_DENSE
from visibility.errors import CoverError
from visibility.sight.curvature import Curvature
from visibility.sight.roofs import roof_heights
from visibility.sight.sight_points import check_points, in_posts

__all__ = ["Canopy", "canopy_between", "canopy_depths", "canopy_paths", "raster_over", "resampled_canopy"]

Heights = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Canopy:
    """Trees over the posts of a grid, straight between them as the ground is.

    top_m: (rows, cols) height of the canopy over the ground, 0 = none, NaN = unknown. base_m: the same of where crowns
    begin. notes: what was done to get them, sentences. density_per_m: (rows, cols) optical depth per metre of way
    where it differs from place to place, None = the model tells. Raises CoverError.
    """

    grid: ElevationGrid
    top_m: Heights
    base_m: Heights
    notes: tuple[str, ...] = ()
    density_per_m: Heights | None = None

    def __post_init__(self) -> None:
        for name in ("top_m", "base_m"):
            values = np.array(np.broadcast_to(getattr(self, name), self.grid.shape), np.float32, order="C")
            negative = int(np.count_nonzero(values < 0.0))
            if negative or np.isinf(values).any():
                raise CoverError(f"{name} of a canopy must be heights >= 0 m; {negative} posts are below.")
            self._keep(name, values)
        over = int(np.count_nonzero((self.base_m > self.top_m) & (self.top_m > 0.0)))
        if over:
            raise CoverError(f"At {over} posts the crown base is above the canopy.")
        if self.density_per_m is not None:
            density = np.array(np.broadcast_to(self.density_per_m, self.grid.shape), np.float32, order="C")
            strange = int(np.count_nonzero((density < 0.0) | (density > MOST_DENSE)))
            if strange:
                raise CoverError(f"density_per_m must be numbers from 0 to {MOST_DENSE:,.0f}; {strange} posts are not.")
            self._keep("density_per_m", density)

    def _keep(self, name: str, values: Heights) -> None:
        if name != "top_m":
            values[np.isnan(values) & (self.top_m == 0.0)] = 0.0  # where no trees are nobody asks for it
        values.setflags(write=False)
        object.__setattr__(self, name, values)

    @cached_property
    def layers(self) -> Heights:
        """(rows, cols, 3) altitude of the ground, and over it tops and bases of the canopy, metres, for the kernels."""
        return np.stack([self.grid.heights_m, self.top_m, self.base_m], axis=-1)

    @cached_property
    def dense_layers(self) -> Heights:
        """(rows, cols, 4): the same and the density."""
        assert self.density_per_m is not None, "asked only where it is known"
        return np.concatenate([self.layers, self.density_per_m[..., None]], axis=-1)

    @cached_property
    def spans_m(self) -> Heights:
        """(…, 2) altitudes of the lowest crown base and the highest crown in squares of posts, for the kernels."""
        squares = [max(-(-(count - 1) // SQUARE), 1) for count in self.grid.shape]
        spans_m = np.empty((*squares, 2), np.float32)
        fill_spans(self.layers, spans_m)
        return spans_m


def canopy_between(grid: ElevationGrid, surface: ElevationGrid, base_m: npt.ArrayLike = 0.0) -> Canopy:
    """The canopy between a grid of bare ground and one of the surface (DSM less DTM).

    A surface of other posts is resampled. Where it is below the ground there is no canopy; what stands on the grid is
    taken out. Both are told. Raises CoverError where the two lie in different CRS, or do not overlap.
    """
    heights_m, notes = raster_over(grid, surface)
    over_m = heights_m - grid.heights_m
    below = int(np.count_nonzero(over_m < 0.0))
    if below:
        deepest_m = -float(np.nanmin(over_m))
        told = f"At {below} posts the surface is below the ground, by up to {deepest_m:.2f} m: no canopy there."
        notes = (*notes, told)
    top_m = np.maximum(over_m, np.float32(0.0))
    if grid.standing is not None:
        built = np.isfinite(roof_heights(grid))
        top_m[built] = 0.0
        notes = (*notes, f"{int(built.sum())} posts under roofs are no canopy.")
    return Canopy(grid, top_m, np.asarray(np.minimum(base_m, top_m), np.float32), notes)


def resampled_canopy(grid: ElevationGrid, heights: ElevationGrid, base_m: npt.ArrayLike = 0.0) -> Canopy:
    """The canopy of a raster of heights over ground, at the posts of a grid; told where it had others.

    Beyond the raster the canopy is unknown. Raises CoverError for negative heights, and for another CRS.
    """
    top_m, notes = raster_over(grid, heights)
    return Canopy(grid, top_m, np.asarray(np.minimum(base_m, top_m), np.float32), notes)


def canopy_paths(
    canopy: Canopy, from_points_m: npt.ArrayLike, to_points_m: npt.ArrayLike, curvature: Curvature | None = None
) -> npt.NDArray[np.float64]:
    """(n,) metres that straight lines between points (n, 3) each run between crown bases and tops; NaN = unknown.

    Exact over the triangulation of ground and canopy. Points are east, north, altitude in the grid's frame; outside the
    grid there is no canopy. Raises VisibilityInputError.
    """
    return _along(canopy, canopy.layers, from_points_m, to_points_m, curvature)


def canopy_depths(
    canopy: Canopy, from_points_m: npt.ArrayLike, to_points_m: npt.ArrayLike, curvature: Curvature | None = None
) -> npt.NDArray[np.float64]:
    """(n,) optical depth of straight lines: the integral of a canopy's density_per_m along ``canopy_paths``; NaN =
    unknown. The density is straight between posts. Raises VisibilityInputError, CoverError where there is none.
    """
    if canopy.density_per_m is None:
        raise CoverError("The canopy has no density of its own at its posts.")
    return _along(canopy, canopy.dense_layers, from_points_m, to_points_m, curvature)


def _along(
    canopy: Canopy,
    layers: Heights,
    from_points_m: npt.ArrayLike,
    to_points_m: npt.ArrayLike,
    curvature: Curvature | None,
) -> npt.NDArray[np.float64]:
    grid = canopy.grid
    start_m, end_m = check_points(grid, "from_points_m", from_points_m), check_points(grid, "to_points_m", to_points_m)
    if len(start_m) != len(end_m):
        raise CoverError(f"Each line needs two points, not {len(start_m)} and {len(end_m)}.")
    shares = np.empty(len(start_m))
    lines = np.stack([in_posts(grid, start_m), in_posts(grid, end_m)], axis=1)
    drop_per_m2 = Curvature.over(grid, curvature).drop_per_m2
    earth = (grid.cell_east_m, grid.cell_north_m, drop_per_m2)
    canopy_shares(layers, canopy.spans_m, earth, lines, shares)
    length_m: npt.NDArray[np.float64] = np.linalg.norm(end_m - start_m, axis=1)
    return shares * length_m


def raster_over(grid: ElevationGrid, other: ElevationGrid, called: str = "canopy") -> tuple[Heights, tuple[str, ...]]:
    """((rows, cols) values of a raster at the posts of a grid, NaN beyond it; what was done to it, sentences).

    called: what the sentences call it. Raises CoverError where the two lie in different CRS, or do not overlap.
    """
    same_frame = (grid.crs is None) == (other.crs is None) and (
        grid.crs is None or other.crs is None or same_map(grid.crs, other.crs)
    )
    if not same_frame:
        names = ["a local frame" if one.crs is None else repr(one.crs.name) for one in (other, grid)]
        raise CoverError(f"The {called} is in {names[0]} and the ground in {names[1]}; read both in one CRS.")
    # a file of another CRS was warped as it was read: what was done to it is told here, since nobody else looks at it
    done = (*other.provenance.conversions, *other.provenance.warnings)
    read = tuple(f"The {called}'s raster: {sentence}" for sentence in done)
    ours = (grid.shape, grid.cell_east_m, grid.cell_north_m, grid.origin_east_m, grid.origin_north_m)
    theirs = (other.shape, other.cell_east_m, other.cell_north_m, other.origin_east_m, other.origin_north_m)
    if ours == theirs:
        return other.heights_m, read
    rows, cols = np.indices(grid.shape)
    heights_m = np.asarray(height_at(other, *grid.position_of(rows, cols)), np.float32)
    if np.isnan(heights_m).all():
        raise CoverError(f"The {called} lies nowhere on the ground.")
    apart = f"{other.cell_east_m:g} by {other.cell_north_m:g} m"
    return heights_m, (*read, f"The {called}'s posts are {apart} apart; it was resampled to the DEM's.")
