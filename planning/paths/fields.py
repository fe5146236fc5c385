"""The cost field: which squares of the ground may be driven and why not, and what a metre of each costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy
import shapely

from planning.errors import NoCoverageError, PathProblemError
from planning.kernels import path_fields as kernel
from planning.kernels.path_segments import tally
from planning.questions.models import CostWeights, RoverModel
from planning.questions.problems import PathProblem
from terrain import ElevationGrid
from visibility.air import MorphingMap

from .beliefs import expected_sigma_m
from .outcomes import Reason
from .places import Cells, outside_of, squares_touched
from .sight_maps import Positioning, SightMaps

__all__ = ["CostField", "KernelField", "Rates", "RunningSums", "bit_of", "cost_field", "reasons_of", "running_sums"]

Floats = npt.NDArray[np.float32]
Square = tuple[int, int]

# dilution counts up to this, and no fix counts as this
WORST_DILUTION = 20.0
OBSTACLES = (Reason.SLOPE, Reason.STEP, Reason.UNKNOWN_GROUND, Reason.BORDER, Reason.NO_GO, Reason.KEEP_IN)
BITS = {reason: np.uint16(1 << number) for number, reason in enumerate(Reason)}
# of a square, in rows and columns
CORNERS = ((0, 0), (0, 1), (1, 0), (1, 1))


def bit_of(reason: Reason) -> np.uint16:
    """The bit of a reason in ``CostField.reasons``."""
    return BITS[reason]


def reasons_of(bits: int) -> tuple[Reason, ...]:
    """The reasons that a number of ``CostField.reasons`` stands for."""
    return tuple(reason for reason, bit in BITS.items() if int(bits) & int(bit))


class Rates(NamedTuple):
    """What driving costs and how far it may be tilted; all but the tangents in metres on level ground.

    least_per_m: of a horizontal metre, at least. steepest: tangent at which the table of pace ends. max_pitch and
    max_roll: tangents, +inf = no limit. The rest: of a metre on the ground, of one climbed, of a second, of one out of
    sight.
    """

    least_per_m: float
    steepest: float
    max_pitch: float
    max_roll: float
    per_m: float
    per_climbed_m: float
    per_s: float
    per_dark_s: float


class KernelField(NamedTuple):
    """A field as the kernels take it.

    heights_m: (rows, cols) posts. allowed: (rows - 1, cols - 1) uint8, 1 = the square south-east of the post may be
    driven. added: same shape, cost per metre on the ground besides driving it. hidden: same shape uint8, out of sight.
    pace: (2 m + 1,) seconds per horizontal metre over the slope along the way, from -1 to 1 times rates.steepest.
    """

    heights_m: Floats
    allowed: npt.NDArray[np.uint8]
    added: Floats
    hidden: npt.NDArray[np.uint8]
    cells: Cells
    rates: Rates
    pace: npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CostField:
    """What each square of four posts is worth; arrays (rows - 1, cols - 1), a square lies south-east of its post.

    A square counts as the worst of what is in it, so a segment over squares that may be driven keeps every limit that
    the field knows. reasons: uint16, the bits of every Reason against a square, 0 = may be driven.
    slope: tangent of the steeper triangle, NaN = unknown. count: anchors that all four posts see. dop: the worst at the
    posts from those anchors, +inf = no fix, 0 where nothing asks for it. step_m: NaN where nothing asks for it.
    added: cost per metre on the ground besides driving it, dop_cost the part of it for dilution.
    hidden: 1 where fewer anchors than a fix needs are in sight.
    rates, pace: as in KernelField.
    """

    grid: ElevationGrid
    reasons: npt.NDArray[np.uint16]
    slope: Floats
    step_m: Floats
    count: npt.NDArray[np.uint16]
    dop: Floats
    dop_cost: Floats
    added: Floats
    hidden: npt.NDArray[np.uint8]
    rates: Rates
    pace: npt.NDArray[np.float64]

    def for_kernels(self, *, everywhere: bool = False) -> KernelField:
        """The field as the kernels take it; everywhere: what it costs alone, all of it allowed in every direction."""
        if everywhere:
            rates = self.rates._replace(max_pitch=math.inf, max_roll=math.inf)
            allowed = np.ones(self.reasons.shape, np.uint8)
        else:
            rates, allowed = self.rates, (self.reasons == 0).astype(np.uint8)
        cells = Cells.of(self.grid)
        return KernelField(self.grid.heights_m, allowed, self.added, self.hidden, cells, rates, self.pace)

    def obstacles(self) -> npt.NDArray[np.uint8]:
        """1 where the ground or an area forbids a square, whatever the anchors give."""
        bits = np.bitwise_or.reduce([BITS[reason] for reason in OBSTACLES])
        against: npt.NDArray[np.uint8] = ((self.reasons & bits) != 0).astype(np.uint8)
        return against

    def square_at(self, row: float, col: float) -> Square:
        """The square around a fractional post inside the grid."""
        return min(int(row), self.grid.rows - 2), min(int(col), self.grid.cols - 2)


def cost_field(
    problem: PathProblem, maps: SightMaps | None, arrival_s: npt.NDArray[np.float64] | None = None
) -> CostField:
    """The field of a problem from its ground, its areas and what its anchors give.

    arrival_s: (rows - 1, cols - 1) when the rover gets to each square, for anchors that move; None = at once.
    Raises PathProblemError, NoCoverageError.
    """
    grid, rover = problem.grid, problem.rover
    if grid.rows < 2 or grid.cols < 2:
        raise PathProblemError("A path needs a grid of at least two rows and two columns of posts.")
    shape = grid.rows - 1, grid.cols - 1
    reasons = np.zeros(shape, np.uint16)
    slope, step_m = _ground(grid, rover)
    unknown = np.isnan(slope)
    reasons[_within_footprint(np.pad(unknown, 1), grid, rover)] |= BITS[Reason.UNKNOWN_GROUND]
    beyond = np.pad(np.zeros(shape, np.bool_), 1, constant_values=True)
    reasons[_within_footprint(beyond, grid, rover)] |= BITS[Reason.BORDER]
    reasons[slope > math.tan(rover.max_slope_rad)] |= BITS[Reason.SLOPE]
    reasons[step_m > rover.max_step_m] |= BITS[Reason.STEP]
    _mark_areas(problem, reasons)
    given = maps.positioning(arrival_s) if maps is not None else None
    count = given.count if given is not None else np.zeros(shape, np.uint16)
    dop = given.dop if given is not None else np.zeros(shape, np.float32)
    _mark_positioning(problem, given, reasons, unknown)
    weights = problem.weights
    dop_cost = (weights.dop * np.fmin(dop, WORST_DILUTION)).astype(np.float32)
    added, hidden = dop_cost, np.zeros(shape, np.uint8)
    if given is not None:
        hidden[count < problem.limits.needed_in_sight] = 1
        if weights.position_error > 0.0:
            added = dop_cost + np.float32(weights.position_error) * expected_sigma_m(problem, given)
    rates, pace = _rates(rover, weights)
    return CostField(grid, reasons, slope, step_m, count, dop, dop_cost, added, hidden, rates, pace)


def _ground(grid: ElevationGrid, rover: RoverModel) -> tuple[Floats, Floats]:
    cells = Cells.of(grid)
    slope = np.empty((grid.rows - 1, grid.cols - 1), np.float32)
    kernel.fill_slopes(grid.heights_m, cells, slope)
    step_m = np.full_like(slope, np.nan)
    if math.isfinite(rover.max_step_m):
        kernel.fill_steps(grid.heights_m, cells, rover.footprint_radius_m, step_m)
    return slope, step_m


def _within_footprint(barred: npt.NDArray[np.bool_], grid: ElevationGrid, rover: RoverModel) -> npt.NDArray[np.bool_]:
    """Squares from somewhere in which the footprint reaches a barred one; barred has a ring beyond the grid."""
    radius_m, inside = rover.footprint_radius_m, barred[1:-1, 1:-1]
    if radius_m == 0.0 or not barred.any():
        return inside
    corners = np.zeros((barred.shape[0] + 1, barred.shape[1] + 1), np.bool_)
    for down, across in CORNERS:
        corners[down : down + barred.shape[0], across : across + barred.shape[1]] |= barred
    # two squares are as far apart as their nearest corners
    away_m = scipy.ndimage.distance_transform_edt(~corners, sampling=(grid.cell_north_m, grid.cell_east_m))
    rows, cols = inside.shape
    nearest_m = np.minimum.reduce([away_m[1 + d : 1 + d + rows, 1 + a : 1 + a + cols] for d, a in CORNERS])
    reached: npt.NDArray[np.bool_] = nearest_m < radius_m
    return reached


def _mark_areas(problem: PathProblem, reasons: npt.NDArray[np.uint16]) -> None:
    grid, apart_m = problem.grid, problem.rover.footprint_radius_m
    if problem.no_go:
        zone = shapely.union_all(problem.no_go)
        reasons[squares_touched(grid, zone, apart_m)] |= BITS[Reason.NO_GO]
    if problem.keep_in:
        zone = outside_of(grid, problem.keep_in)
        reasons[squares_touched(grid, zone, apart_m)] |= BITS[Reason.KEEP_IN]


def _mark_positioning(
    problem: PathProblem,
    given: Positioning | None,
    reasons: npt.NDArray[np.uint16],
    unknown: npt.NDArray[np.bool_],
) -> None:
    """Raises NoCoverageError where limits on positioning hold nowhere."""
    limits, against = problem.limits, np.zeros(reasons.shape, np.uint16)
    if given is not None:
        against[given.count < limits.min_anchors] |= BITS[Reason.ANCHORS]
        # NaN, over unknown ground, is not below a limit; without one no fix will do as well
        good = given.dop < limits.dop_limit if math.isfinite(limits.dop_limit) else ~np.isnan(given.dop)
        against[~good] |= BITS[Reason.DOP]
    if isinstance(problem.maps, MorphingMap):
        antenna_m = problem.grid.heights_m + np.float32(problem.rover.receiver_above_ground_m)
        good = antenna_m >= problem.maps.safe_above_m
        against[~(good[:-1, :-1] & good[1:, :-1] & good[:-1, 1:] & good[1:, 1:])] |= BITS[Reason.MORPHING_MAP]
    if (against[~unknown] != 0).all() and not unknown.all():
        raise NoCoverageError(_no_coverage(problem, against, given))
    reasons |= against


def _no_coverage(problem: PathProblem, against: npt.NDArray[np.uint16], given: Positioning | None) -> str:
    limits = problem.limits
    if given is not None and (against & BITS[Reason.ANCHORS]).all():
        return (
            f"No place on the map has {limits.min_anchors} anchor{'' if limits.min_anchors == 1 else 's'} "
            f"{problem.counted} at the same time (at most {given.count.max()}); ask for fewer, raise the anchors or "
            "add some."
        )
    if given is not None and (against & BITS[Reason.DOP]).all():
        best = float(np.nanmin(given.dop))
        least = f"its least is {best:.2f}" if math.isfinite(best) else "there is no fix anywhere"
        return f"Nowhere on the map is the dilution below {limits.dop_limit:g}: {least}."
    return "Nowhere on the map do the limits on positioning hold together; relax one of them or add anchors."


def _rates(rover: RoverModel, weights: CostWeights) -> tuple[Rates, npt.NDArray[np.float64]]:
    """Rates and pace as the kernels take them."""
    steepest, pace = rover.pace_table()
    max_pitch, max_roll = (
        math.inf if angle >= math.pi / 2 else math.tan(angle) for angle in (rover.max_pitch_rad, rover.max_roll_rad)
    )
    return Rates(
        least_per_m=weights.length + weights.time * float(pace.min()),
        steepest=steepest,
        max_pitch=max_pitch,
        max_roll=max_roll,
        per_m=weights.length,
        per_climbed_m=weights.climb,
        per_s=weights.time,
        per_dark_s=weights.out_of_sight,
    ), pace


class RunningSums(NamedTuple):
    """Along places, each (n,) from the first of them.

    code: the worst of ``kernels.path_segments`` so far. dark_s: seconds out of sight. ground_m: along the ground.
    """

    code: npt.NDArray[np.float64]
    cost: npt.NDArray[np.float64]
    time_s: npt.NDArray[np.float64]
    dark_s: npt.NDArray[np.float64]
    ground_m: npt.NDArray[np.float64]
    climb_m: npt.NDArray[np.float64]


def running_sums(field: KernelField, places: npt.NDArray[np.float64]) -> RunningSums:
    """What a way over places (n, 2) comes to at each of them."""
    sums = RunningSums(*np.zeros((6, len(places))))
    tally(field, np.ascontiguousarray(places), sums)
    return sums
