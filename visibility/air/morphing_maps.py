"""The Digital Morphing Map: the altitude above which positioning is good enough (De Vivo et al., eq. 19)."""

from __future__ import annotations

import enum
import math
import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.air.kernels import morphing as kernel
from visibility.air.kernels.columns import Question
from visibility.dilution.dop_questions import FlightLimit, check_geometry
from visibility.dilution.sets_in_sight import column_tables
from visibility.errors import VisibilityInputError
from visibility.sight.minimum_altitude import MinimumVisibleAltitude

__all__ = ["RESOLUTION_M", "ColumnState", "MorphingMap", "check_ceiling", "closed_map", "morphing_map"]

# no-flight air thinner than this may go unnoticed, and bounds of the thicker are off by half of it
RESOLUTION_M = 0.02


class ColumnState(enum.IntEnum):
    """What the air over a post is like, from the ground to the ceiling.

    NOWHERE: flyable at no altitude. EVERYWHERE: from the ground up. ABOVE: from altitude_m up to the ceiling.
    CLOSED_AT_CEILING: not flyable at the ceiling, but somewhere below (or it is not known where). OUTSIDE: the ground
    is above the ceiling. UNKNOWN: unknown ground decides.
    """

    NOWHERE = kernel.NOWHERE
    EVERYWHERE = kernel.EVERYWHERE
    ABOVE = kernel.ABOVE
    CLOSED_AT_CEILING = kernel.CLOSED_AT_CEILING
    OUTSIDE = kernel.OUTSIDE
    UNKNOWN = kernel.UNKNOWN


@dataclass(frozen=True, eq=False)
class MorphingMap:
    """The answer to ``morphing_map``; all arrays (rows, cols).

    altitude_m: float32, above it the dilution stays below the limit with enough anchors in sight up to the ceiling; the
        ground's own where that is so from the ground up; NaN in every other state than EVERYWHERE and ABOVE.
    safe_above_m: float32, the same altitude when all that is unknown is taken as hidden; +inf = none.
    state: uint8, ColumnState. no_flight_intervals: uint8, separate stretches of no-flight air (255 = or more).
    """

    grid: ElevationGrid
    limit: FlightLimit
    ceiling_m: float
    ceiling_above_ground: bool
    altitude_m: npt.NDArray[np.float32]
    safe_above_m: npt.NDArray[np.float32]
    state: npt.NDArray[np.uint8]
    no_flight_intervals: npt.NDArray[np.uint8]
    warnings: tuple[str, ...]
    elapsed_s: float

    @property
    def above_ground_m(self) -> npt.NDArray[np.float32]:
        """altitude_m as a height above the ground; NaN as there."""
        return self.altitude_m - self.grid.heights_m

    @property
    def several_intervals(self) -> npt.NDArray[np.bool_]:
        """Where no-flight air comes in more than one piece, so that there is flyable air below altitude_m too."""
        several: npt.NDArray[np.bool_] = self.no_flight_intervals > 1
        return several

    def states(self) -> dict[ColumnState, int]:
        """How many posts there are of each state."""
        return {state: int(np.count_nonzero(self.state == state)) for state in ColumnState}


def morphing_map(
    surfaces: MinimumVisibleAltitude,
    limit: FlightLimit,
    *,
    ceiling_m: float,
    ceiling_above_ground: bool = False,
) -> MorphingMap:
    """Altitude over every post above which positioning is good enough up to the ceiling.

    Solved between the altitudes at which the visible set changes, not on layers: bounds of the no-flight air are within
    RESOLUTION_M, and none thicker than that is missed.
    ceiling_m: top of the control volume, an altitude or a height above each post's ground.
    Raises VisibilityInputError: a ceiling at or below all ground, too few anchors, or anchors that fix no position.
    """
    started_s = time.perf_counter()
    grid = surfaces.grid
    check_ceiling(grid, ceiling_m, ceiling_above_ground)
    tables = column_tables(surfaces)
    check_geometry(limit, tables.sources)
    question = Question(tables.sources, *limit.codes, float(limit.dop_limit), limit.needed_anchors, RESOLUTION_M)
    altitude_m, safe_above_m = np.empty(grid.shape, np.float32), np.empty(grid.shape, np.float32)
    state, intervals = np.empty(grid.shape, np.uint8), np.empty(grid.shape, np.uint8)
    kernel.morphing_columns(
        tables.surfaces,
        tables.window(grid, 0, 0),
        kernel.Ceiling(float(ceiling_m), ceiling_above_ground),
        tables.antennas,
        question,
        kernel.Columns(altitude_m, safe_above_m, state, intervals),
    )
    return MorphingMap(
        grid=grid,
        limit=limit,
        ceiling_m=float(ceiling_m),
        ceiling_above_ground=ceiling_above_ground,
        altitude_m=altitude_m,
        safe_above_m=safe_above_m,
        state=state,
        no_flight_intervals=intervals,
        warnings=(*surfaces.warnings, *_warnings(state)),
        elapsed_s=time.perf_counter() - started_s,
    )


def closed_map(
    grid: ElevationGrid, limit: FlightLimit, ceiling_m: float, ceiling_above_ground: bool, why: str
) -> MorphingMap:
    """The map while no anchors fix a position anywhere: one stretch of no-flight air over every post.

    why: a sentence that becomes its warning.
    """
    ground_m = grid.heights_m
    state = np.full(grid.shape, ColumnState.NOWHERE, np.uint8)
    if not ceiling_above_ground:
        state[ground_m >= ceiling_m] = ColumnState.OUTSIDE
    state[np.isnan(ground_m)] = ColumnState.UNKNOWN
    return MorphingMap(
        grid=grid,
        limit=limit,
        ceiling_m=float(ceiling_m),
        ceiling_above_ground=ceiling_above_ground,
        altitude_m=np.full(grid.shape, np.nan, np.float32),
        safe_above_m=np.full(grid.shape, np.inf, np.float32),
        state=state,
        no_flight_intervals=(state == ColumnState.NOWHERE).astype(np.uint8),
        warnings=(why, *_warnings(state)),
        elapsed_s=0.0,
    )


def check_ceiling(grid: ElevationGrid, ceiling_m: float, above_ground: bool) -> None:
    """Refuse a ceiling that leaves no air over any known ground; raises VisibilityInputError."""
    if not math.isfinite(ceiling_m):
        raise VisibilityInputError(f"ceiling_m must be a finite number of metres, not {ceiling_m}.")
    if above_ground:
        if ceiling_m <= 0.0:
            raise VisibilityInputError(f"A ceiling above ground must be higher than the ground, not {ceiling_m:g} m.")
        return
    if grid.unknown_posts == grid.rows * grid.cols:
        raise VisibilityInputError("No ground is known, so there is no air to map.")
    lowest_m = float(np.nanmin(grid.heights_m))
    if ceiling_m <= lowest_m:
        raise VisibilityInputError(
            f"The ceiling at {ceiling_m:g} m is below the ground, which begins at {lowest_m:.1f} m; raise it."
        )


def _warnings(state: npt.NDArray[np.uint8]) -> list[str]:
    outside = int(np.count_nonzero(state == ColumnState.OUTSIDE))
    if not outside:
        return []
    stand = "post stands" if outside == 1 else "posts stand"
    return [f"{outside:,} {stand} above the ceiling: there is no air below it."]
