"""The Digital Morphing Map as the service gives it: above which altitude positioning is good enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import NO_GO, Anchor, ColumnState, DistantAnchor, MorphingMap, dop_map, morphing_map

from .map_facts import Calculation, share_of
from .ranging_sources import calculation_of, common_summary, limit_of, sight_lines
from .schemas.positioning import MorphingMapParameters

__all__ = ["FinishedMorphingMap", "calculate_morphing_map"]

SHARE_OF_SIGHT_LINES = 0.5


@dataclass(frozen=True, eq=False)
class FinishedMorphingMap:
    """A finished morphing map; arrays (rows, cols) as in ``visibility.MorphingMap``.

    dop, no_go: at the antenna of a rover on the ground, as in FinishedDopMap.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: MorphingMapParameters
    calculation: Calculation
    altitude_m: npt.NDArray[np.float32]
    safe_above_m: npt.NDArray[np.float32]
    state: npt.NDArray[np.uint8]
    no_flight_intervals: npt.NDArray[np.uint8]
    dop: npt.NDArray[np.float32]
    no_go: npt.NDArray[np.uint8]

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
            "receiver_above_ground_m": parameters.receiver_above_ground_m,
            "posts_no_go_for_the_rover": int(np.count_nonzero(self.no_go == NO_GO)),
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
    lines, sources = sight_lines(grid, parameters, progress, SHARE_OF_SIGHT_LINES)
    ceiling_m, above_ground = parameters.ceiling()
    limit = limit_of(parameters)
    found: MorphingMap = morphing_map(lines, limit, ceiling_m=ceiling_m, ceiling_above_ground=above_ground)
    rover = dop_map(lines, parameters.receiver_above_ground_m, parameters.kind, dilution=parameters.measure)
    if progress is not None:
        progress(1.0)
    # the map's warnings are the sight lines' and its own
    own = found.warnings[len(lines.warnings) :]
    return FinishedMorphingMap(
        grid,
        lines.anchors,
        parameters,
        calculation_of(grid, lines, sources, found.elapsed_s + rover.elapsed_s, own),
        found.altitude_m,
        found.safe_above_m,
        found.state,
        found.no_flight_intervals,
        rover.dop,
        rover.no_go(limit.dop_limit, limit.needed_anchors),
    )
