"""What is known of what stands on a ground: buildings and canopy in numbers, for ``info`` and every answer."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from terrain import ElevationGrid

__all__ = ["BuildingsTold", "CanopyTold", "CoverTold", "cover_told"]


class BuildingsTold(BaseModel):
    """Buildings on the ground."""

    solids: int = Field(description="How many solids they are, a number.")
    highest_roof_m: float = Field(description="Altitude of the highest roof, metres.")


class CanopyTold(BaseModel):
    """Trees on the ground."""

    share: float | None = Field(description="Part of the posts where the canopy is known that have some, 0..1.")
    unknown_posts: int = Field(description="Posts over which it is not known, a number.")
    mean_top_m: float | None = Field(description="Mean height of crowns over the ground, where there are some, metres.")
    highest_top_m: float | None = Field(description="The highest, metres.")
    mean_base_m: float | None = Field(description="Mean height at which crowns begin there, metres.")
    model: str = Field(description="What a way through costs a signal.")
    depth_per_m: float | None = Field(description="Optical depth per metre of the model density, 1/m; null by others.")
    by_direction: bool = Field(description="Whether its depths go by direction.")
    mean_density_per_m: float | None = Field(
        None, description="Mean of a raster of them where there are trees, 1/m; null without one."
    )
    season: float = Field(description="Factor on the loss, no unit.")


class CoverTold(BaseModel):
    """What stands on the ground."""

    buildings: BuildingsTold | None = Field(description="null = none that is known.")
    canopy: CanopyTold | None = Field(description="null = none that is known.")

    def sentences(self) -> list[tuple[str, str]]:
        """(what, in words) for tables."""
        told = []
        if self.buildings is not None:
            one = self.buildings
            told.append(("buildings", f"{one.solids:,} solids, roofs up to {one.highest_roof_m:.1f} m"))
        trees = self.canopy
        if trees is not None and trees.share is not None:
            height = (
                ""
                if trees.mean_top_m is None
                else (
                    f", {trees.mean_base_m:.1f} to {trees.mean_top_m:.1f} m over the ground in the mean, "
                    f"up to {trees.highest_top_m:.1f} m"
                )
            )
            depth = f" of {trees.depth_per_m:.3g}/m" if trees.depth_per_m is not None else ""
            depth = " by direction" if trees.by_direction else depth
            if trees.mean_density_per_m is not None:
                depth = f" of {trees.mean_density_per_m:.3g}/m in the mean"
            told.append(("canopy", f"on {100.0 * trees.share:.1f} % of the posts{height}"))
            told.append(("  its cost", f"{trees.model}{depth}, times {trees.season:g} for the season"))
            told.append(("  unknown posts", f"{trees.unknown_posts:,}"))
        return told


def cover_told(grid: ElevationGrid) -> CoverTold | None:
    """What stands on a grid; None where nothing that is known does."""
    if grid.standing is None and grid.trees is None:
        return None
    return CoverTold(buildings=_buildings(grid), canopy=_canopy(grid))


def _buildings(grid: ElevationGrid) -> BuildingsTold | None:
    standing = grid.standing
    if standing is None:
        return None
    return BuildingsTold(solids=standing.bodies, highest_roof_m=standing.highest_m)


def _canopy(grid: ElevationGrid) -> CanopyTold | None:
    trees = grid.trees
    if trees is None:
        return None
    known = np.isfinite(trees.top_m)
    there = known & (trees.top_m > 0.0)
    some = bool(there.any())
    return CanopyTold(
        share=float(there.sum() / known.sum()) if known.any() else None,
        unknown_posts=int(known.size - known.sum()),
        mean_top_m=float(trees.top_m[there].mean(dtype=np.float64)) if some else None,
        highest_top_m=float(trees.top_m[there].max()) if some else None,
        mean_base_m=float(trees.base_m[there].mean(dtype=np.float64)) if some else None,
        model=trees.model,
        depth_per_m=trees.depth_per_m,
        by_direction=trees.sky is not None,
        mean_density_per_m=_mean(trees.density_per_m[there]) if trees.density_per_m is not None and some else None,
        season=trees.season,
    )


def _mean(values: npt.NDArray[np.float32]) -> float | None:
    """Of those that are known."""
    known = values[np.isfinite(values)]
    return float(known.mean(dtype=np.float64)) if len(known) else None
