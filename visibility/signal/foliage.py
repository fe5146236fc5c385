"""Canopy with the model that tells what it costs a signal, and the season."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, replace
from typing import Literal, cast, get_args

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, SkyDepths, Trees
from visibility.cover.canopy import Canopy, canopy_depths, canopy_paths
from visibility.cover.vegetation import (
    MOST_DENSE,
    VegetationLoss,
    density_loss,
    early_itu_loss,
    p833_slant_loss,
    p833_woodland_loss,
    weissberger_loss,
)
from visibility.errors import CoverError
from visibility.sight.curvature import Curvature

__all__ = ["Foliage", "FoliageModel", "foliage_of", "with_foliage"]

Reals = npt.NDArray[np.float64]

FoliageModel = Literal["density", "weissberger", "early_itu", "p833_slant", "p833_woodland"]


@dataclass(frozen=True, eq=False)
class Foliage:
    """Canopy over a grid, and what a way through it costs.

    model: "density" with depth_per_m, optical depth per metre of way, or with sky, the same by direction
    (``fit_canopy``), or with a canopy that has its own at each post; or a published model, each for its own range of
    frequencies. season: factor on the loss, 1 = in leaf, or as it was fitted. Raises CoverError.
    """

    canopy: Canopy
    model: FoliageModel = "weissberger"
    depth_per_m: float | None = None
    season: float = 1.0
    sky: SkyDepths | None = None

    def __post_init__(self) -> None:
        if self.model not in get_args(FoliageModel):
            raise CoverError(f"The model of a canopy must be one of {', '.join(get_args(FoliageModel))}.")
        depths = sum(given is not None for given in (self.depth_per_m, self.sky, self.canopy.density_per_m))
        if depths != (1 if self.model == "density" else 0):
            raise CoverError(
                'One of depth_per_m, sky and a density_per_m of the canopy belongs to the model "density", and to no '
                "other."
            )
        for name in ("depth_per_m", "season"):
            value = getattr(self, name)
            if value is not None and not 0.0 <= value <= MOST_DENSE:
                raise CoverError(f"A canopy's {name} must be a number from 0 to {MOST_DENSE:,.0f}, not {value}.")

    def between(
        self, from_points_m: npt.ArrayLike, to_points_m: npt.ArrayLike, frequency_hz: float, curvature: Curvature
    ) -> tuple[Reals, VegetationLoss]:
        """((n,) metres of canopy on lines between points (n, 3), what they cost). Raises VisibilityInputError."""
        start_m, end_m = np.asarray(from_points_m, np.float64), np.asarray(to_points_m, np.float64)
        way_m = canopy_paths(self.canopy, start_m, end_m, curvature)
        if self.canopy.density_per_m is not None:
            depth = canopy_depths(self.canopy, start_m, end_m, curvature)
            return way_m, VegetationLoss(density_loss(depth, 1.0, self.season), ())
        step_m = end_m - start_m
        up_m = np.where(step_m[:, 2:] < 0.0, -step_m, step_m)
        rise_rad = np.arctan2(up_m[:, 2], np.hypot(up_m[:, 0], up_m[:, 1]))
        return way_m, self.loss(way_m, frequency_hz, rise_rad, np.arctan2(up_m[:, 0], up_m[:, 1]))

    def loss(
        self, way_m: npt.ArrayLike, frequency_hz: float, rise_rad: npt.ArrayLike, azimuth_rad: npt.ArrayLike = 0.0
    ) -> VegetationLoss:
        """(n,) loss of ways through the canopy, dB; rise_rad, azimuth_rad: (n,) the directions in which they lead up.

        A way of no length costs nothing; outside the model's range it is NaN, and told. Where the canopy has a density
        of its own at each post only ``between`` knows the loss.
        """
        ways_m = np.asarray(way_m, np.float64)
        if self.canopy.density_per_m is not None:
            raise CoverError("What a way costs depends on where it runs: ask for the loss between its ends.")
        if self.model == "density" and self.depth_per_m is not None:
            return VegetationLoss(density_loss(ways_m, self.depth_per_m, self.season), ())
        if self.sky is not None:
            of_way = self.sky.at(azimuth_rad, rise_rad)
            return VegetationLoss(density_loss(of_way * ways_m, 1.0, self.season), ())
        if self.model == "p833_slant":
            found = p833_slant_loss(ways_m, frequency_hz, rise_rad)
        else:
            published = {"weissberger": weissberger_loss, "early_itu": early_itu_loss}
            found = published.get(self.model, p833_woodland_loss)(ways_m, frequency_hz)
        return replace(found, loss_db=np.where(ways_m == 0.0, 0.0, found.loss_db * self.season))


_of_grid: weakref.WeakKeyDictionary[ElevationGrid, Foliage] = weakref.WeakKeyDictionary()


def with_foliage(grid: ElevationGrid, foliage: Foliage) -> ElevationGrid:
    """The grid with canopy on it, in place of what it had: it weakens signals wherever they are asked for.

    What was done to get it is among the warnings of the grid's provenance. Raises CoverError for other posts.
    """
    canopy = foliage.canopy
    if canopy.grid.shape != grid.shape:
        raise CoverError(f"A canopy over {canopy.grid.shape} posts does not fit a grid of {grid.shape}.")
    known = foliage.model, foliage.depth_per_m, foliage.season
    trees = Trees(canopy.top_m, canopy.base_m, *known, canopy.notes, foliage.sky, canopy.density_per_m)
    told = tuple(note for note in canopy.notes if note not in grid.provenance.warnings)
    provenance = replace(grid.provenance, warnings=(*grid.provenance.warnings, *told))
    return replace(grid, trees=trees, provenance=provenance)


def foliage_of(grid: ElevationGrid) -> Foliage | None:
    """The canopy on a grid with its model; None where there is none. Raises CoverError."""
    trees = grid.trees
    if trees is None:
        return None
    found = _of_grid.get(grid)
    if found is None:
        bare = replace(grid, trees=None)  # so that what is kept does not hold the grid that it is kept for
        canopy = Canopy(bare, trees.top_m, trees.base_m, trees.notes, trees.density_per_m)
        found = Foliage(canopy, cast("FoliageModel", trees.model), trees.depth_per_m, trees.season, trees.sky)
        _of_grid[grid] = found
    return found
