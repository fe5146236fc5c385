"""Finished safety bubbles, and what they say in numbers."""

from __future__ import annotations

import functools
import importlib.metadata
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from navigation import BubbleCheck, BubbleVerdict
from service.parts.map_facts import dem_summary
from service.parts.ranging_sources import Source, source_summary
from service.products.safety_bubbles.request import BubbleParameters
from service.products.safety_bubbles.surroundings import Surroundings
from terrain import ElevationGrid
from visibility import Buildings, MinimumVisibleAltitude

__all__ = ["FinishedBubbles", "way_m"]

Array = npt.NDArray[np.float64]
WORDS = {BubbleVerdict.OK: "ok", BubbleVerdict.VIOLATED: "violated", BubbleVerdict.UNKNOWN: "unknown"}
DECIMALS = 6
QUANTILES = {"p05": 0.05, "p50": 0.5, "p95": 0.95}


@dataclass(frozen=True, eq=False)
class FinishedBubbles:
    """Bubbles at n points.

    covariance_m2: (n, 3, 3). promise: (n,). visible: (n, k) bool, None in a history of poses.
    """

    grid: ElevationGrid
    anchors: tuple[Source, ...]
    parameters: BubbleParameters
    points_m: Array
    times_s: Array
    covariance_m2: Array
    radius_m: Array
    promise: Array
    buildings: Buildings | None
    around: Surroundings
    check: BubbleCheck
    visible: npt.NDArray[np.bool_] | None
    sight: MinimumVisibleAltitude | None
    warnings: tuple[str, ...]
    elapsed_s: float

    @property
    def distance_m(self) -> Array:
        """(n,) way along the path."""
        return way_m(self.points_m)

    def verdicts(self) -> list[str]:
        """ok, violated or unknown, for each point."""
        return [WORDS[BubbleVerdict(int(verdict))] for verdict in self.check.verdict]

    def numbers(self) -> dict[str, Array]:
        """What is told of each point in one number, (n,) each."""
        east_m, north_m, altitude_m = self.points_m.T
        return {
            "time_s": self.times_s,
            "distance_m": self.distance_m,
            "east_m": east_m,
            "north_m": north_m,
            "altitude_m": altitude_m,
            "radius_m": self.radius_m,
            "promise": self.promise,
            "clearance_m": self.around.distance_m,
            "margin_m": self.check.margin_m,
        }

    @functools.cached_property
    def points(self) -> list[dict[str, Any]]:
        """One entry per point, as they are answered, ready for JSON."""
        columns: dict[str, list[Any]] = {name: _rounded(values) for name, values in self.numbers().items()}
        columns["nearest"], columns["verdict"] = self.around.words(), self.verdicts()
        columns["push"], columns["push_m"] = _rounded(self.check.push), _rounded(self.check.push_m)
        columns["in_sight"] = [self.in_sight(point) for point in range(len(self.points_m))]
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def in_sight(self, point: int) -> list[str] | None:
        """Ids of the anchors in sight of a point."""
        if self.visible is None:
            return None
        return [self.anchors[number].id for number in np.flatnonzero(self.visible[point])]

    def summary(self) -> dict[str, Any]:
        """All of it in numbers, ready for JSON."""
        check = self.check
        return {
            "points": len(self.points_m),
            **{word: check.count(verdict) for verdict, word in WORDS.items()},
            "first_violation": self._first_violation(),
            "least_margin_m": float(check.margin_m.min()),
            "radius_quantiles_m": {name: float(np.quantile(self.radius_m, q)) for name, q in QUANTILES.items()},
            "epsilon": self.parameters.epsilon,
            "least_promise": float(self.promise.min()),
            "error_statement": None if self.sight is None else self.sight.error_statement,
            "curvature": None if self.sight is None else self.sight.curvature.sentence(),
            "dem": dem_summary(self.grid),
            "buildings": self._buildings(),
            **source_summary(self.grid, self.anchors),
            "warnings": list(self.warnings),
            "timing": {"calculation_s": self.elapsed_s},
            "version": importlib.metadata.version("sightline"),
        }

    def _buildings(self) -> dict[str, Any] | None:
        if self.buildings is None:
            return None
        return {
            "name": self.buildings.source,
            "bodies": self.buildings.count,
            "triangles": len(self.buildings.faces),
            "points_nearest": int(np.count_nonzero(self.around.at_building)),
        }

    def _first_violation(self) -> dict[str, Any] | None:
        first = self.check.first_violation
        if first is None:
            return None
        return {
            "point": first,
            "time_s": float(self.times_s[first]),
            "distance_m": float(self.distance_m[first]),
            "radius_m": float(self.radius_m[first]),
            "clearance_m": float(self.around.distance_m[first]),
            "margin_m": float(self.check.margin_m[first]),
            "nearest": self.around.words()[first],
            "in_sight": self.in_sight(first),
        }


def _rounded(values: Array) -> list[Any]:
    rounded: list[Any] = np.round(values, DECIMALS).tolist()
    return rounded


def way_m(points_m: Array) -> Array:
    """(n,) metres along a path up to each of its points."""
    steps_m = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps_m)])
