"""The files of lines of sight: every line as JSON, and as arrays."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from service.files.layer import JSON, Layer
from visibility import HIDDEN
from visibility.sight import LinesOfSight

from .calculate import WORDS, FinishedLines

__all__ = ["LAYERS"]

DECIMALS = 6
ARRAYS = (
    *("verdict", "clearance_m", "distance_m", "blocking_point_m", "blocking_distance_m", "over_unknown"),
    *("leaves_dem", "ends_below", "fresnel_clearance", "excess_path_m", "probability_clear"),
)


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
    Layer(
        "lines.npz",
        "application/x-npz",
        "The same as arrays for numpy, NaN and infinities included.",
        _write_npz,
    ),
)
