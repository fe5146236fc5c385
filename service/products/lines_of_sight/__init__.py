"""Lines of sight between pairs of points as a product."""

from __future__ import annotations

from service.products import Inline, Product
from service.settings import Settings
from terrain import ElevationGrid

from .calculate import LAYERS, LineOut, LinesOfSightSummary, calculate_lines, pack_lines, unpack_lines
from .request import PAIRS, LinesOfSightIn, LinesOfSightParameters

__all__ = ["LINES_OF_SIGHT"]


def _check(grid: ElevationGrid, asked: LinesOfSightParameters, settings: Settings) -> None:
    """Pairs are counted where the body is read, and their ends judged where they are packed."""


LINES_OF_SIGHT = Product(
    name="lines-of-sight",
    title="lines of sight",
    plural="lines_of_sight",
    model="LinesOfSight",
    tag="Lines of sight",
    summary="Clearance between pairs of points.",
    about="Clearance, verdict and blocking point of many straight lines at once; exact on the triangulated surface.",
    asked=LinesOfSightIn,
    parameters=LinesOfSightParameters,
    answer=LinesOfSightSummary,
    example=PAIRS,
    check=_check,
    calculate=calculate_lines,
    layers=LAYERS,
    pack=pack_lines,
    unpack=unpack_lines,
    long_body=True,
    inline=Inline("lines", "lines.json", LineOut, "One entry per pair, in their order; null until it succeeded."),
)
