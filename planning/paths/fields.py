"""The cost field: which squares of the ground may be driven and why not, and what a metre of each costs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy import ndimage

from planning.errors import NoCoverageError, PathProblemError
from planning.kernels import path_fields as kernel
from planning.kernels.path_segments import tally
from terrain import ElevationGrid
from visibility import MinimumVisibleAltitude, MorphingMap
from visibility.columns_of_air import column_tables
from visibility.dop_questions import kind_code

from .areas import outside_of, squares_touched
from .limits import DILUTIONS, CostWeights
from .outcomes import Reason
from .problems import PathProblem
from .rovers import RoverModel

__all__ = ["CostField", "KernelField", "bit_of", "cost_field", "metres_of", "reasons_of", "running_sums"]

Floats = npt.NDArray[np.float32]
Square = tuple[int, int]
KernelField = tuple[
    Floats,
    npt.NDArray[np.uint8],
    Floats,
    npt.NDArray[np.uint8],
    tuple[float, float],
    tuple[float, ...],
    npt.NDArray[np.float64],
]

# dilution counts up to this, and no fix counts as this
WORST_DILUTION = 20.0
BITS = {reason: np.uint16(1 << number) for number, reason in enumerate(Reason)}


def bit_of(reason: Reason) -> np.uint16:
    """The bit of a reason in ``CostField.reasons``."""
    return BITS[reason]


def reasons_of(bits: int) -> tuple[Reason, ...]:
    """The reasons that a number of ``CostField.reasons`` stands for."""
    return tuple(reason for reason, bit in BITS.items() if int(bits) & int(bit))


@dataclass(frozen=True, eq=False)
class CostField:
    """What each square of four posts is worth; arrays (rows - 1, cols - 1), a square lies south-east of its post.

    A square counts as the worst of what is in it, so a segment over squares that may be driven keeps every limit that
    the field knows. reasons: uint16, the bits of every Reason against a square, 0 = may be driven.
    slope: tangent of the steeper triangle, NaN = unknown. count: anchors that all four posts see. dop: the worst at the
    posts from those anchors, +inf = no fix, 0 where nothing asks for it. step_m: NaN where nothing asks for it.
    added: cost per metre on the ground besides driving it. hidden: 1 where fewer anchors than a fix needs are in sight.
    numbers, pace: see ``planning.kernels.path_segments``.
    """

    grid: ElevationGrid
    reasons: npt.NDArray[np.uint16]
    slope: Floats
    step_m: Floats
    count: npt.NDArray[np.uint16]
    dop: Floats
    added: Floats
    hidden: npt.NDArray[np.uint8]
    numbers: tuple[float, ...]
    pace: npt.NDArray[np.float64]

    def for_kernels(self) -> KernelField:
        """The field as the kernels take it."""
        cells = (self.grid.cell_east_m, self.grid.cell_north_m)
        allowed = (self.reasons == 0).astype(np.uint8)
        return self.grid.heights_m, allowed, self.added, self.hidden, cells, self.numbers, self.pace

    def square_at(self, row: float, col: float) -> Square:
        """The square around a fractional post inside the grid."""
        return min(int(row), self.grid.rows - 2), min(int(col), self.grid.cols - 2)


def cost_field(problem: PathProblem, minimum: MinimumVisibleAltitude | None) -> CostField:
    """The field of a problem from its ground, its areas and the minimum visible altitudes of its anchors.

    Raises PathProblemError, NoCoverageError.
    """
    grid, rover = problem.grid, problem.rover
    if grid.rows < 2 or grid.cols < 2:
        raise PathProblemError("A path needs a grid of at least two rows and two columns of posts.")
    shape = grid.rows - 1, grid.cols - 1
    reasons = np.zeros(shape, np.uint16)
    slope, step_m = _ground(grid, rover)
    unknown = np.isnan(slope)
    reasons[_within_footprint(unknown, grid, rover)] |= BITS[Reason.UNKNOWN_GROUND]
    reasons[slope > math.tan(rover.max_slope_rad)] |= BITS[Reason.SLOPE]
    reasons[step_m > rover.max_step_m] |= BITS[Reason.STEP]
    _mark_areas(problem, reasons)
    count, dop = _positioning(problem, minimum, shape)
    _mark_positioning(problem, minimum, count, dop, reasons, unknown)
    weights = problem.weights
    added = (weights.dop * np.minimum(dop, WORST_DILUTION)).astype(np.float32)
    hidden = np.zeros(shape, np.uint8)
    if minimum is not None:
        hidden[count < problem.limits.needed_in_sight] = 1
    numbers, pace = _numbers(rover, weights)
    return CostField(grid, reasons, slope, step_m, count, dop, added, hidden, numbers, pace)


def _ground(grid: ElevationGrid, rover: RoverModel) -> tuple[Floats, Floats]:
    cells = (grid.cell_east_m, grid.cell_north_m)
    slope = np.empty((grid.rows - 1, grid.cols - 1), np.float32)
    kernel.fill_slopes(grid.heights_m, cells, slope)
    step_m = np.full_like(slope, np.nan)
    if math.isfinite(rover.max_step_m):
        kernel.fill_steps(grid.heights_m, cells, rover.footprint_radius_m, step_m)
    return slope, step_m


def _within_footprint(unknown: npt.NDArray[np.bool_], grid: ElevationGrid, rover: RoverModel) -> npt.NDArray[np.bool_]:
    """Squares from whose middle the footprint reaches an unknown one."""
    down, across = (
        max(math.ceil(rover.footprint_radius_m / cell_m - 0.5), 0) for cell_m in (grid.cell_north_m, grid.cell_east_m)
    )
    if (down == 0 and across == 0) or not unknown.any():
        return unknown
    # from the middle of a square to the near side of another
    away_n = np.maximum(np.abs(np.arange(-down, down + 1)) - 0.5, 0.0)[:, None] * grid.cell_north_m
    away_e = np.maximum(np.abs(np.arange(-across, across + 1)) - 0.5, 0.0) * grid.cell_east_m
    reached: npt.NDArray[np.bool_] = ndimage.binary_dilation(
        unknown, away_n**2 + away_e**2 < rover.footprint_radius_m**2
    )
    return reached


def _mark_areas(problem: PathProblem, reasons: npt.NDArray[np.uint16]) -> None:
    grid, apart_m = problem.grid, problem.rover.footprint_radius_m
    if problem.no_go:
        zone = shapely.union_all(problem.no_go)
        reasons[squares_touched(grid, zone, apart_m)] |= BITS[Reason.NO_GO]
    if problem.keep_in:
        zone = outside_of(grid, problem.keep_in)
        reasons[squares_touched(grid, zone, apart_m)] |= BITS[Reason.KEEP_IN]


def _positioning(
    problem: PathProblem, minimum: MinimumVisibleAltitude | None, shape: Square
) -> tuple[npt.NDArray[np.uint16], Floats]:
    count, dop = np.zeros(shape, np.uint16), np.zeros(shape, np.float32)
    if minimum is None:
        return count, dop
    grid, limits, antenna_m = problem.grid, problem.limits, problem.rover.antenna_height_m
    seen = minimum.visible(above_ground_m=antenna_m)
    if math.isinf(limits.max_dop) and problem.weights.dop == 0.0:
        kernel.fill_counts(seen, count)
        return count, dop
    place = (grid.origin_east_m, grid.origin_north_m, grid.cell_east_m, grid.cell_north_m, antenna_m)
    question = (kind_code(limits.kind), DILUTIONS.index(limits.dilution), limits.on_surface)
    kernel.fill_positioning(grid.heights_m, seen, place, column_tables(minimum).sources, question, count, dop)
    return count, dop


def _mark_positioning(
    problem: PathProblem,
    minimum: MinimumVisibleAltitude | None,
    count: npt.NDArray[np.uint16],
    dop: Floats,
    reasons: npt.NDArray[np.uint16],
    unknown: npt.NDArray[np.bool_],
) -> None:
    """Raises NoCoverageError where limits on positioning hold nowhere."""
    limits, against = problem.limits, np.zeros(reasons.shape, np.uint16)
    if minimum is not None:
        against[count < limits.min_anchors] |= BITS[Reason.ANCHORS]
        # NaN, over unknown ground, is not below a limit
        against[~(dop <= limits.max_dop)] |= BITS[Reason.DOP]
    if isinstance(problem.maps, MorphingMap):
        antenna_m = problem.grid.heights_m + np.float32(problem.rover.antenna_height_m)
        good = antenna_m >= problem.maps.safe_above_m
        against[~(good[:-1, :-1] & good[1:, :-1] & good[:-1, 1:] & good[1:, 1:])] |= BITS[Reason.MORPHING_MAP]
    if (against[~unknown] != 0).all() and not unknown.all():
        raise NoCoverageError(_no_coverage(problem, against, count, dop))
    reasons |= against


def _no_coverage(
    problem: PathProblem, against: npt.NDArray[np.uint16], count: npt.NDArray[np.uint16], dop: Floats
) -> str:
    limits = problem.limits
    if (against & BITS[Reason.ANCHORS]).all():
        return (
            f"Nowhere on the map are {limits.min_anchors} anchors in sight at the same time (at most {count.max()} "
            "are); ask for fewer, raise the anchors or add some."
        )
    if (against & BITS[Reason.DOP]).all():
        best = float(np.nanmin(dop))
        least = f"its least is {best:.2f}" if math.isfinite(best) else "there is no fix anywhere"
        return f"Nowhere on the map is the dilution {limits.max_dop:g} or less: {least}."
    return "Nowhere on the map do the limits on positioning hold together; relax one of them or add anchors."


def _numbers(rover: RoverModel, weights: CostWeights) -> tuple[tuple[float, ...], npt.NDArray[np.float64]]:
    """Numbers and pace as the kernels take them."""
    steepest, pace = rover.pace_table()
    least = weights.length + weights.time * float(pace.min())
    limit_pitch, limit_roll = (
        math.inf if angle >= math.pi / 2 else math.tan(angle) for angle in (rover.max_pitch_rad, rover.max_roll_rad)
    )
    numbers = (least, steepest, limit_pitch, limit_roll, weights.length, weights.climb, weights.time)
    return (*numbers, weights.out_of_sight), pace


def metres_of(
    grid: ElevationGrid, places: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """(east_m, north_m), each (n,), of fractional posts (n, 2)."""
    east_m = grid.origin_east_m + places[:, 1] * grid.cell_east_m
    north_m = grid.origin_north_m - places[:, 0] * grid.cell_north_m
    return east_m, north_m


def running_sums(field: KernelField, places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(n, 6) from the first of places (n, 2): worst code, cost, seconds, seconds out of sight, metres on the ground,
    metres climbed.
    """
    out = np.zeros((len(places), 6))
    tally(field, np.ascontiguousarray(places), out)
    return out
