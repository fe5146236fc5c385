"""What stands on the ground of a finished result, kept in its folder: pictures that are drawn later show it too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, SkyDepths, Standing, Trees

__all__ = ["CoverFields", "mapped_array", "save_cover", "with_kept_cover"]

EDGES, FACES, TOPS, BASES = "standing_edges_m.npy", "standing_faces_m.npy", "trees_top_m.npy", "trees_base_m.npy"
DENSITIES = "trees_density_per_m.npy"


class SkyFields(TypedDict):
    """``SkyDepths`` as JSON has them."""

    elevation_edges_rad: Sequence[float]
    depth_per_m: Sequence[Sequence[float]]


class TreeFields(TypedDict):
    """``Trees`` without their heights."""

    model: str
    depth_per_m: float | None
    season: float
    notes: Sequence[str]
    sky: SkyFields | None
    dense: NotRequired[bool]


class StandingFields(TypedDict):
    """``Standing`` without its edges and faces."""

    bodies: int
    notes: Sequence[str]


class CoverFields(TypedDict):
    """What is kept besides the arrays."""

    standing: NotRequired[StandingFields]
    trees: NotRequired[TreeFields]


def save_cover(grid: ElevationGrid, folder: Path) -> CoverFields:
    """Write what stands on a grid into a folder that is there; the rest of it comes back. Raises OSError."""
    told = CoverFields()
    standing, trees = grid.standing, grid.trees
    if standing is not None:
        np.save(folder / EDGES, standing.edges_m, allow_pickle=False)
        np.save(folder / FACES, standing.faces_m, allow_pickle=False)
        told["standing"] = StandingFields(bodies=standing.bodies, notes=standing.notes)
    if trees is not None:
        np.save(folder / TOPS, trees.top_m, allow_pickle=False)
        np.save(folder / BASES, trees.base_m, allow_pickle=False)
        sky = (
            None
            if trees.sky is None
            else SkyFields(elevation_edges_rad=trees.sky.elevation_edges_rad, depth_per_m=trees.sky.depth_per_m)
        )
        depth, season = trees.depth_per_m, trees.season
        told["trees"] = TreeFields(model=trees.model, depth_per_m=depth, season=season, notes=trees.notes, sky=sky)
        if trees.density_per_m is not None:
            np.save(folder / DENSITIES, trees.density_per_m, allow_pickle=False)
            told["trees"]["dense"] = True
    return told


def with_kept_cover(grid: ElevationGrid, folder: Path, told: CoverFields) -> ElevationGrid:
    """The grid with what was kept of it. Raises OSError."""
    standing, trees = told.get("standing"), told.get("trees")
    if standing is not None:
        kept = Standing(
            mapped_array(folder / EDGES), mapped_array(folder / FACES), standing["bodies"], tuple(standing["notes"])
        )
        grid = replace(grid, standing=kept)
    if trees is not None:
        sky = trees["sky"]
        depths = None
        if sky is not None:
            depths = SkyDepths(tuple(sky["elevation_edges_rad"]), tuple(tuple(row) for row in sky["depth_per_m"]))
        kept_trees = Trees(
            mapped_array(folder / TOPS),
            mapped_array(folder / BASES),
            trees["model"],
            trees["depth_per_m"],
            trees["season"],
            tuple(trees["notes"]),
            depths,
            mapped_array(folder / DENSITIES) if trees.get("dense", False) else None,
        )
        grid = replace(grid, trees=kept_trees)
    return grid


def mapped_array(path: Path) -> npt.NDArray[Any]:
    """An array in a file, read where it is needed. Raises OSError."""
    found: npt.NDArray[Any] = np.load(path, mmap_mode="r", allow_pickle=False)
    return found
