"""Lines of sight as a product."""

from __future__ import annotations

from service.products.product import Inline, Product, Work
from service.settings import Settings
from terrain import ElevationGrid

from .answer import LineOut, LinesOfSightSummary
from .calculate import FinishedLines, Question, calculate_lines, pack_lines, unpack_lines
from .files import LAYERS
from .request import PAIRS, LinesOfSightIn, LinesOfSightParameters

__all__ = ["LINES_OF_SIGHT"]


def _check(grid: ElevationGrid, asked: LinesOfSightParameters, settings: Settings) -> None:
    """Pairs are counted where the body is read, and their ends judged where they are packed."""


def _calculate(grid: ElevationGrid, question: Question, work: Work) -> FinishedLines:
    return calculate_lines(grid, question)


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
    calculate=_calculate,
    layers=LAYERS,
    pack=pack_lines,
    unpack=unpack_lines,
    long_body=True,
    inline=Inline("lines", "lines.json", LineOut, "One entry per pair, in their order; null until it succeeded."),
)
