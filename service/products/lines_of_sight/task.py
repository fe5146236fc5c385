"""Lines of sight in a worker: read the body, bring the points into the grid's frame, calculate, write the answer."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from service.jobs.folder import digest_of, make_durable
from service.jobs.tasks.bodies import body_in, read_body
from service.jobs.tasks.context import TaskContext
from service.parts.point_arrays import points_in_grid
from service.parts.sight import CurvatureIn
from service.products.lines_of_sight.request import LinesOfSightIn
from terrain import ElevationGrid
from visibility import FLAT, HIDDEN, UNKNOWN, VISIBLE, Curvature, LinesOfSight, lines_of_sight
from visibility.sight.sight_points import check_points

__all__ = ["calculate_lines_of_sight", "check_lines_of_sight"]

POINTS = "points.npz"
WORDS = {int(VISIBLE): "clear", int(HIDDEN): "blocked", int(UNKNOWN): "unknown"}
DECIMALS = 6


def check_lines_of_sight(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Read the request; its points go into the work folder as arrays, the rest comes back.

    Raises NotJsonError, NotValidError, LimitError, NotFoundError, FrameError, VisibilityInputError.
    """
    asked = read_body(LinesOfSightIn, body_in(arguments), context.settings)
    pairs = len(asked.pairs or asked.from_points_m or ())
    grid = context.grid(asked.dem_id)
    from_m, to_m = _ends(grid, asked)
    context.work.mkdir(parents=True)
    np.savez(context.work / POINTS, from_m=from_m, to_m=to_m)
    make_durable(context.work)
    options = asked.model_dump(
        mode="json", exclude_none=True, exclude={"dem_id", "pairs", "from_points_m", "to_points_m"}
    )
    return {"dem_id": asked.dem_id, "pairs": pairs, "options": options}


def calculate_lines_of_sight(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Leave the lines in the work folder, as JSON and as arrays; digest and summary come back."""
    asked = LinesOfSightIn.model_construct(**arguments["options"])
    curvature = arguments["options"]["curvature"]
    with np.load(context.folder.inputs(arguments["job_id"]) / POINTS) as points:
        sight = lines_of_sight(
            context.grid(arguments["dem_id"]),
            points["from_m"],
            points["to_m"],
            curvature=_curvature(curvature),
            unknown=asked.unknown,
            wavelength_m=asked.asked_wavelength_m,
            dem_sigma_m=asked.dem_sigma_m,
            excess_path=asked.excess_path,
        )
    context.work.mkdir(parents=True)
    (context.work / "lines.json").write_bytes(json.dumps(_lines(sight), allow_nan=False).encode())
    np.savez(context.work / "lines.npz", allow_pickle=False, **_arrays(sight))
    make_durable(context.work)
    counts = {word: int(np.count_nonzero(sight.verdict == value)) for value, word in WORDS.items()}
    return {
        "digest": digest_of(context.work),
        "summary": {
            "lines": len(sight.verdict),
            **counts,
            "error_statement": sight.error_statement,
            "curvature": sight.curvature.sentence(),
            "warnings": list(sight.warnings),
            "timing": {"calculation_s": sight.elapsed_s},
            "version": sight.version,
        },
    }


def _ends(grid: ElevationGrid, asked: LinesOfSightIn) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    if asked.pairs is not None:
        from_m = points_in_grid(grid, [pair.from_ for pair in asked.pairs], "pairs[{}].from")
        to_m = points_in_grid(grid, [pair.to for pair in asked.pairs], "pairs[{}].to")
    else:
        from_m, to_m = np.array(asked.from_points_m, np.float64), np.array(asked.to_points_m, np.float64)
    called = ("from_points_m", "to_points_m") if asked.pairs is None else ("pairs.from", "pairs.to")
    return check_points(grid, called[0], from_m), check_points(grid, called[1], to_m)


def _curvature(asked: str | Mapping[str, float]) -> Curvature | None:
    if isinstance(asked, str):
        return FLAT if asked == "flat" else None
    numbers = CurvatureIn.model_validate(asked)
    return Curvature(numbers.radius_m, numbers.refraction_k)


def _lines(sight: LinesOfSight) -> list[dict[str, Any]]:
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


def _arrays(sight: LinesOfSight) -> dict[str, npt.NDArray[Any]]:
    names = (
        *("verdict", "clearance_m", "distance_m", "blocking_point_m", "blocking_distance_m", "over_unknown"),
        *("leaves_dem", "ends_below", "fresnel_clearance", "excess_path_m", "probability_clear"),
    )
    return {name: getattr(sight, name) for name in names if getattr(sight, name) is not None}
