"""Lines of sight as the service answers them: clearance, verdict and blocking point of each."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field, JsonValue

from service.files.layer import JSON, Layer
from service.parts.areas import AnyArea
from service.parts.cover import CoverIn, notes_on_cover
from service.parts.map_area import places_in_area
from service.parts.map_facts import curvature_of
from service.parts.shapes_in_grid import points_in_grid
from service.products import UNWATCHED, Work
from terrain import AreaError, ElevationGrid
from visibility import HIDDEN, UNKNOWN, VISIBLE, lines_of_sight
from visibility.sight import LinesOfSight
from visibility.sight.sight_points import check_points

from .request import LinesOfSightParameters

__all__ = [
    "LAYERS",
    "BlockingPoint",
    "FinishedLines",
    "LineOut",
    "LinesOfSightSummary",
    "Question",
    "calculate_lines",
    "pack_lines",
    "refuse_lines_outside",
    "unpack_lines",
]

Floats = npt.NDArray[np.float64]
Verdict = Literal["clear", "blocked", "unknown"]
WORDS: dict[int, Verdict] = {int(VISIBLE): "clear", int(HIDDEN): "blocked", int(UNKNOWN): "unknown"}
POINTS = "points.npz"
POSITIONS = {"pairs", "from_points_m", "to_points_m"}
DECIMALS = 6
ARRAYS = (
    *("verdict", "clearance_m", "distance_m", "blocking_point_m", "blocking_distance_m", "over_unknown"),
    *("leaves_dem", "ends_below", "fresnel_clearance", "excess_path_m", "probability_clear"),
)


class BlockingPoint(BaseModel):
    """Where known ground stands in the way most."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Altitude of the ground there, metres.")


class LineOut(BaseModel):
    """One line of sight."""

    verdict: Literal["clear", "blocked", "unknown"] = Field(
        description="Whether the line is clear of the surface; unknown when it crosses unknown ground and no known "
        "ground blocks it."
    )
    clearance_m: float | None = Field(
        description="Least height of the line over known ground, metres; negative: blocked by so much; null: no known "
        "ground under it."
    )
    distance_m: float = Field(description="Straight distance between the points, metres.")
    blocking_point: BlockingPoint | None = Field(
        description="Where it is blocked most; null unless known ground blocks."
    )
    over_unknown: bool = Field(description="Whether the line crosses unknown ground.")
    fresnel_clearance: float | None = Field(
        None,
        description="Least clearance in radii of the first Fresnel zone, no unit; null without a wavelength and over "
        "unknown ground.",
    )
    excess_path_m: float | None = Field(
        None,
        description="How much longer the shortest way over the ground is than the line, metres; 0 when clear; null: an "
        "end lies below the ground, or unknown, or not asked for.",
    )
    probability_clear: float | None = Field(
        None,
        description="Probability that the line is clear, 0..1; null without dem_sigma_m, and over unknown ground "
        "unless known ground blocks it.",
    )


class LinesOfSightSummary(BaseModel):
    """All lines in numbers, and how far to trust them."""

    lines: int = Field(description="Number of lines.")
    clear: int = Field(description="Lines that are clear.")
    blocked: int = Field(description="Lines that are blocked.")
    unknown: int = Field(description="Lines that are unknown.")
    error_statement: str = Field(description="Error of the method.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    version: str = Field(description="Version of Sightline that calculated it.")


@dataclass(frozen=True, eq=False, slots=True)
class Question:
    """How lines are calculated, and both ends of each in the grid's frame, (n, 3)."""

    options: LinesOfSightParameters
    from_m: Floats
    to_m: Floats

    @property
    def cover(self) -> CoverIn | None:
        """What stands on the ground, as ``covered`` looks for it."""
        return self.options.cover


@dataclass(frozen=True, eq=False, slots=True)
class FinishedLines:
    """Finished lines: the answer in numbers, and every line."""

    grid: ElevationGrid
    answer: LinesOfSightSummary
    sight: LinesOfSight


def pack_lines(grid: ElevationGrid, asked: LinesOfSightParameters, folder: Path) -> dict[str, JsonValue]:
    """The options, and how many pairs there are; the points go into the folder as arrays.

    Raises AreaError, FrameError, VisibilityInputError.
    """
    from_m, to_m = _ends(grid, asked)
    folder.mkdir(parents=True)
    np.savez(folder / POINTS, from_m=from_m, to_m=to_m)
    options: dict[str, JsonValue] = asked.model_dump(mode="json", exclude_none=True, exclude=POSITIONS)
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


def calculate_lines(grid: ElevationGrid, question: Question, work: Work = UNWATCHED) -> FinishedLines:
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
        warnings=[*notes_on_cover(grid), *sight.warnings],
        timing={"calculation_s": sight.elapsed_s},
        version=sight.version,
    )
    return FinishedLines(grid, answer, sight)


def _ends(grid: ElevationGrid, asked: LinesOfSightParameters) -> tuple[Floats, Floats]:
    if asked.pairs is not None:
        from_m = points_in_grid(grid, [pair.from_ for pair in asked.pairs], "pairs[{}].from")
        to_m = points_in_grid(grid, [pair.to for pair in asked.pairs], "pairs[{}].to")
        names = "pairs.from", "pairs.to"
    else:
        from_m, to_m = np.array(asked.from_points_m, np.float64), np.array(asked.to_points_m, np.float64)
        names = "from_points_m", "to_points_m"
    refuse_lines_outside(grid, asked.area, from_m, to_m)
    return check_points(grid, names[0], from_m), check_points(grid, names[1], to_m)


def refuse_lines_outside(grid: ElevationGrid, area: AnyArea | None, from_m: Floats, to_m: Floats) -> None:
    """Raise AreaError where no end of a line (n, 3) lies in the area of a request; FrameError, RequestError."""
    outside = ~(places_in_area(grid, area, from_m) | places_in_area(grid, area, to_m))
    if outside.any():
        raise AreaError(f"Neither end of line {int(np.argmax(outside))} lies in the area of the request.")


def _write_json(finished: FinishedLines, path: Path) -> None:
    """One object per line, as ``LineOut`` has it; made column by column, because there may be 100 000."""
    path.write_bytes(json.dumps(_lines(finished.sight), allow_nan=False).encode())


def _write_npz(finished: FinishedLines, path: Path) -> None:
    sight = finished.sight
    arrays = {name: getattr(sight, name) for name in ARRAYS if getattr(sight, name) is not None}
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def _lines(sight: LinesOfSight) -> list[dict[str, object]]:
    columns: dict[str, list[Any]] = {
        "verdict": [WORDS[int(verdict)] for verdict in sight.verdict],
        "clearance_m": _numbers(sight.clearance_m),
        "distance_m": _numbers(sight.distance_m),
        "blocking_point": [
            dict(zip(("east_m", "north_m", "altitude_m"), point, strict=True)) if clearance_m < 0.0 and hidden else None
            for point, clearance_m, hidden in zip(
                np.round(sight.blocking_point_m, DECIMALS).tolist(),
                sight.clearance_m.tolist(),
                (sight.verdict == HIDDEN).tolist(),
                strict=True,
            )
        ],
        "over_unknown": sight.over_unknown.tolist(),
    }
    for name in ("fresnel_clearance", "excess_path_m", "probability_clear"):
        values = getattr(sight, name)
        columns[name] = [None] * len(sight.verdict) if values is None else _numbers(values)
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _numbers(values: npt.NDArray[np.float64]) -> list[float | None]:
    """JSON knows neither NaN nor infinity: null."""
    return [value if math.isfinite(value) else None for value in np.round(values, DECIMALS).tolist()]


LAYERS = (
    Layer("lines.json", JSON, "Every line, in the order of the pairs.", _write_json),
    Layer("lines.npz", "application/x-npz", "The same as arrays for numpy, NaN and infinities included.", _write_npz),
)
