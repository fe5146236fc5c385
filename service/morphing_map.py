"""The Digital Morphing Map as the service gives it: above which altitude positioning is good enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import Anchor, ColumnState, DistantAnchor, MorphingMap, morphing_map

from .map_facts import Calculation, share_of
from .ranging_sources import common_summary, limit_of, sight_lines
from .schemas.positioning import MorphingMapParameters

__all__ = ["FinishedMorphingMap", "calculate_morphing_map"]

SHARE_OF_SIGHT_LINES = 0.5


@dataclass(frozen=True, eq=False)
class FinishedMorphingMap:
    """A finished morphing map; arrays (rows, cols) as in ``visibility.MorphingMap``."""

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: MorphingMapParameters
    calculation: Calculation
    altitude_m: npt.NDArray[np.float32]
    safe_above_m: npt.NDArray[np.float32]
    state: npt.NDArray[np.uint8]
    no_flight_intervals: npt.NDArray[np.uint8]

    @property
    def above_ground_m(self) -> npt.NDArray[np.float32]:
        """altitude_m as a height above the ground; NaN as there."""
        return self.altitude_m - self.grid.heights_m

    def ceiling_words(self) -> str:
        """The ceiling as titles and tags say it."""
        if self.parameters.ceiling_above_ground_m is not None:
            return f"{self.parameters.ceiling_above_ground_m:g} m above ground"
        return f"altitude {self.parameters.ceiling_altitude_m:g} m"

    def summary(self) -> dict[str, Any]:
        """What morph.json says: plain values, ready for JSON, every number with its unit in its name."""
        posts = self.state.size
        above_m = self.above_ground_m[np.isfinite(self.altitude_m)]
        parameters = self.parameters
        return {
            **common_summary(self.grid, self.anchors, self.parameters, self.calculation),
            "ceiling": {
                "altitude_m": parameters.ceiling_altitude_m,
                "above_ground_m": parameters.ceiling_above_ground_m,
            },
            "states": [
                {
                    "state": state.name.lower(),
                    "posts": int(np.count_nonzero(self.state == state)),
                    "share": share_of(int(np.count_nonzero(self.state == state)), posts),
                }
                for state in ColumnState
            ],
            "posts_with_several_intervals": int(np.count_nonzero(self.no_flight_intervals > 1)),
            "above_ground_m": {
                name: float(np.quantile(above_m, share)) if above_m.size else None
                for name, share in (("p05", 0.05), ("p50", 0.5), ("p95", 0.95))
            },
        }


def calculate_morphing_map(
    grid: ElevationGrid, parameters: MorphingMapParameters, progress: Callable[[float], None] | None = None
) -> FinishedMorphingMap:
    """The map that the parameters ask for on this grid; progress is called with the finished share 0..1.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError.
    """
    lines, warnings = sight_lines(grid, parameters, progress, SHARE_OF_SIGHT_LINES)
    ceiling_m, above_ground = parameters.ceiling()
    found: MorphingMap = morphing_map(
        lines, limit_of(parameters), ceiling_m=ceiling_m, ceiling_above_ground=above_ground
    )
    if progress is not None:
        progress(1.0)
    calculation = Calculation(
        lines.error_statement,
        lines.curvature.sentence(),
        (*grid.provenance.warnings, *found.warnings, *warnings),
        lines.elapsed_s + found.elapsed_s,
        lines.version,
    )
    return FinishedMorphingMap(
        grid,
        lines.anchors,
        parameters,
        calculation,
        found.altitude_m,
        found.safe_above_m,
        found.state,
        found.no_flight_intervals,
    )
