"""Tiles that count heights from different zeros, brought to one vertical datum through geoid models."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..datums.conversion import NODES_M, raised
from ..datums.references import VerticalDatum, vertical_datum_named
from ..datums.surfaces import datum_step_m
from ..files.raw import PostWindow
from .tile import Tile, to_degrees

__all__ = ["Step", "levelled", "levels_told", "one_datum"]

# cells of a map in degrees are narrower than they are high
NODES_APART_M = NODES_M / 2.0


@dataclass(frozen=True, slots=True)
class Step:
    """What was added to the heights of some tiles, metres, from lowest to highest."""

    tiles: int
    lowest_m: float
    highest_m: float

    def with_more(self, other: Step) -> Step:
        """The same of both."""
        lowest_m, highest_m = min(self.lowest_m, other.lowest_m), max(self.highest_m, other.highest_m)
        return Step(self.tiles + other.tiles, lowest_m, highest_m)


def one_datum(tiles: Sequence[Tile]) -> VerticalDatum | None:
    """What the heights of a mosaic shall count from: the datum of the first tile on Earth that names one."""
    named = (vertical_datum_named(tile.vertical_datum or "") for tile in tiles if tile.body == "Earth")
    return next((datum for datum in named if datum is not None), None)


def levelled(
    tile: Tile, window: PostWindow, heights_m: npt.NDArray[np.float32], own: str | None, wanted: VerticalDatum | None
) -> tuple[npt.NDArray[np.float32], str | None, Step | None, tuple[str, ...]]:
    """(heights of a window of a tile above ``wanted``, their datum's name, what was added, what there is to tell).

    Heights of nobody knows what stay as they are, and so does their datum's name. Raises VerticalDatumError where no
    model tells how far the two are apart.
    """
    given = vertical_datum_named(own or "")
    if wanted is None or given is None or given == wanted or tile.body != "Earth":
        return heights_m, own, None, ()
    rows, cols = (
        np.linspace(first, last, math.ceil((last - first) * tile.cell_m / NODES_APART_M) + 1)
        for first, last in ((window.first_row, window.last_row), (window.first_col, window.last_col))
    )
    row, col = np.meshgrid(rows, cols, indexing="ij")
    lon, lat = to_degrees(tile.crs, tile.x0 + col.ravel() * tile.step_x, tile.y0 - row.ravel() * tile.step_y)
    step_m, told = datum_step_m(given, wanted, lon, lat)
    if not step_m.any():  # sea level without a model's name is the other side's own
        return heights_m, own, None, told
    step = Step(1, float(step_m.min()), float(step_m.max()))
    return raised(heights_m, step_m.reshape(row.shape)), wanted.name, step, told


def levels_told(steps: Mapping[str, Step], wanted: VerticalDatum | None) -> list[str]:
    """What was brought from where, and by how much. steps: by the name of the datum that tiles had."""
    if wanted is None:
        return []
    return [
        f"Heights of {'1 tile' if step.tiles == 1 else f'{step.tiles:,} tiles'} brought from {name} to {wanted.name}: "
        f"{step.lowest_m:+.2f} to {step.highest_m:+.2f} m."
        for name, step in steps.items()
    ]
