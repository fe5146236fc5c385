"""A product that another package might bring: how much of the ground lies higher than a height."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import Field

from service.estimates import Demand, calculation
from service.files.layer import Layer
from service.parts.map_facts import DemId, MapSummary, preamble
from service.parts.points import Metres, StrictModel
from service.products import Product, WarmUp, Work
from service.settings import Settings
from terrain import ElevationGrid, TerrainError

__all__ = ["HIGH_GROUND", "TOO_MUCH_M", "warmed"]

TOO_MUCH_M = 8_848.0  # takes more memory than any machine gives a calculation
warmed: list[tuple[int, int]] = []  # the grids that this process has been warmed up with


class HighGroundParameters(StrictModel):
    """Above which height ground counts."""

    above_m: Metres = Field(description="Height, metres.")


class HighGroundIn(HighGroundParameters):
    """The same on a DEM."""

    dem_id: DemId


class HighGroundSummary(MapSummary):
    """How much of it there is."""

    posts: int = Field(description="Number of posts that are higher.")


@dataclass(frozen=True, eq=False)
class HighGround:
    """(rows, cols) uint8, 1 where the ground is higher."""

    grid: ElevationGrid
    anchors: tuple[()]
    parameters: HighGroundParameters
    answer: HighGroundSummary
    high: np.ndarray


def _estimate(grid: ElevationGrid, parameters: HighGroundParameters) -> Iterable[Demand]:
    cells = grid.heights_m.size
    return calculation(f"{cells:,} cells", 1e18 * (parameters.above_m == TOO_MUCH_M), 1e-9 * cells, "a smaller DEM")


def _check(grid: ElevationGrid, parameters: HighGroundParameters, settings: Settings) -> None:
    if parameters.above_m < 0.0:
        raise TerrainError(f"No ground is asked for below 0 m, and {parameters.above_m:g} m is.")


def _calculate(grid: ElevationGrid, parameters: HighGroundParameters, work: Work) -> HighGround:
    high = (grid.heights_m > parameters.above_m).astype(np.uint8)
    work.progress(1.0)
    answer = HighGroundSummary(
        **preamble(grid, parameters, None, (), mode="exact", unknown="unknown"),
        timing={},
        posts=int(high.sum()),
    )
    return HighGround(grid, (), parameters, answer, high)


def _write_posts(finished: HighGround, path: Path) -> None:
    path.write_text(f"posts\n{finished.answer.posts}\n", encoding="utf-8")


def _warm_up(grid: ElevationGrid) -> None:
    warmed.append(grid.shape)


HIGH_GROUND = Product(
    name="high-ground",
    title="map of high ground",
    plural="high_grounds",
    model="HighGround",
    tag="High ground",
    summary="How much ground lies higher than a height.",
    about="How much of a DEM lies higher than a height.",
    asked=HighGroundIn,
    parameters=HighGroundParameters,
    answer=HighGroundSummary,
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_warm_up, "maps"),),
    calculate=_calculate,
    layers=(Layer("posts.csv", "text/csv", "How many posts.", _write_posts),),
    finished=HighGround,
    arrays=("high",),
)
