"""Lines of sight as the service answers them: clearance, verdict and blocking point of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from service.parts.map_facts import curvature_of
from service.parts.positions import points_in_grid
from terrain import ElevationGrid
from visibility import HIDDEN, UNKNOWN, VISIBLE, LinesOfSight, lines_of_sight
from visibility.sight.sight_points import check_points

from .answer import LinesOfSightSummary
from .request import LineOptions, LinesOfSightParameters

__all__ = ["FinishedLines", "Question", "calculate_lines", "pack_lines", "unpack_lines"]

Floats = npt.NDArray[np.float64]
Verdict = Literal["clear", "blocked", "unknown"]
WORDS: dict[int, Verdict] = {int(VISIBLE): "clear", int(HIDDEN): "blocked", int(UNKNOWN): "unknown"}
POINTS = "points.npz"
POSITIONS = {"pairs", "from_points_m", "to_points_m"}


@dataclass(frozen=True, eq=False, slots=True)
class Question:
    """How lines are calculated, and both ends of each in the grid's frame, (n, 3)."""

    options: LineOptions
    from_m: Floats
    to_m: Floats


@dataclass(frozen=True, eq=False, slots=True)
class FinishedLines:
    """Finished lines: the answer in numbers, and every line."""

    grid: ElevationGrid
    answer: LinesOfSightSummary
    sight: LinesOfSight


def pack_lines(grid: ElevationGrid, asked: LinesOfSightParameters, folder: Path) -> dict[str, Any]:
    """The options, and how many pairs there are; the points go into the folder as arrays.

    Raises FrameError, VisibilityInputError.
    """
    from_m, to_m = _ends(grid, asked)
    folder.mkdir(parents=True)
    np.savez(folder / POINTS, from_m=from_m, to_m=to_m)
    options: dict[str, Any] = asked.model_dump(mode="json", exclude_none=True, exclude=POSITIONS)
    return {"pairs": len(from_m), **options}


def unpack_lines(packed: Mapping[str, Any], folder: Path) -> Question:
    """The question again, from what ``pack_lines`` left."""
    options = {name: value for name, value in packed.items() if name != "pairs"}
    with np.load(folder / POINTS) as points:
        from_m, to_m = points["from_m"], points["to_m"]
    checked = LinesOfSightParameters.model_validate(
        {**options, "from_points_m": [(0, 0, 0)], "to_points_m": [(0, 0, 1)]}
    )
    return Question(checked, from_m, to_m)


def calculate_lines(grid: ElevationGrid, question: Question) -> FinishedLines:
    """All lines at once. Raises VisibilityInputError."""
    options = question.options
    sight = lines_of_sight(
        grid,
        question.from_m,
        question.to_m,
        curvature=curvature_of(options),
        unknown=options.unknown,
        wavelength_m=options.asked_wavelength_m,
        dem_sigma_m=options.dem_sigma_m,
        excess_path=options.excess_path,
    )
    counts = {word: int(np.count_nonzero(sight.verdict == value)) for value, word in WORDS.items()}
    answer = LinesOfSightSummary(
        lines=len(sight.verdict),
        clear=counts["clear"],
        blocked=counts["blocked"],
        unknown=counts["unknown"],
        error_statement=sight.error_statement,
        curvature=sight.curvature.sentence(),
        warnings=list(sight.warnings),
        timing={"calculation_s": sight.elapsed_s},
        version=sight.version,
    )
    return FinishedLines(grid, answer, sight)


def _ends(grid: ElevationGrid, asked: LinesOfSightParameters) -> tuple[Floats, Floats]:
    if asked.pairs is not None:
        from_m = points_in_grid(grid, [pair.from_ for pair in asked.pairs], "pairs[{}].from")
        to_m = points_in_grid(grid, [pair.to for pair in asked.pairs], "pairs[{}].to")
        return check_points(grid, "pairs.from", from_m), check_points(grid, "pairs.to", to_m)
    from_m, to_m = np.array(asked.from_points_m, np.float64), np.array(asked.to_points_m, np.float64)
    return check_points(grid, "from_points_m", from_m), check_points(grid, "to_points_m", to_m)
