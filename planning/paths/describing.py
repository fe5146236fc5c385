"""The path as its reader wants it: metres, seconds, and what holds at each vertex by exact sight lines."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from planning.kernels.path_fields import clearances
from planning.questions.problems import PathProblem
from planning.validation import PathValidation
from planning.words import time_words
from terrain import ElevationGrid, height_at, told_place
from terrain.version import VERSION
from visibility.dilution import surface_normals

from .beliefs import predicted_sigma_m
from .fields import CostField, RunningSums, running_sums
from .outcomes import Path, PathOutcome, PathStatus, PathTotals, Unreachable
from .places import metres_of, middles, sampled, steepest_rad
from .sight_maps import Sightings, SightMaps

__all__ = ["Endings", "described"]

Floats = npt.NDArray[np.float64]
Stop = Callable[[], bool]


def described(
    problem: PathProblem, field: CostField, maps: SightMaps | None, places: Floats, *, everywhere: bool = False
) -> Path:
    """The path over the corners of a way, as fractional posts (n, 2); everywhere: also over forbidden squares."""
    grid, kernel_field = problem.grid, field.for_kernels(everywhere=everywhere)
    fine, corners = sampled(places, 1.0)
    east_m, north_m = metres_of(grid, fine)
    sums = running_sums(kernel_field, fine)
    ahead = np.diff(np.column_stack([east_m, north_m]), axis=0)
    heading_rad = np.arctan2(ahead[:, 0], ahead[:, 1]) % math.tau
    heading_rad = np.append(heading_rad, heading_rad[-1])
    normal = surface_normals(grid, east_m, north_m)
    rise = -normal[:, :2] / normal[:, 2:]
    along = rise[:, 0] * np.sin(heading_rad) + rise[:, 1] * np.cos(heading_rad)
    across = rise[:, 1] * np.sin(heading_rad) - rise[:, 0] * np.cos(heading_rad)
    seen = maps.sightings(fine, sums.time_s) if maps is not None else _nothing_seen(len(fine))
    clearance_m = np.empty(len(fine))
    clearances(field.obstacles(), kernel_field.cells, fine, clearance_m)
    slope_rad = np.arctan(np.hypot(*rise.T))
    altitude_m = height_at(grid, east_m, north_m)
    sigma_m = np.full(len(fine), np.nan)
    if maps is not None:
        points_m = np.column_stack([east_m, north_m, altitude_m + problem.rover.receiver_above_ground_m])
        sigma_m = predicted_sigma_m(problem, points_m, sums.time_s, rise, seen.visible)
    limits = problem.limits
    asked = limits.bubble_epsilon > 0.0
    return Path(
        east_m=east_m,
        north_m=north_m,
        altitude_m=altitude_m,
        heading_rad=heading_rad,
        distance_m=sums.ground_m,
        time_s=sums.time_s,
        slope_rad=slope_rad,
        pitch_rad=np.arctan(along),
        roll_rad=np.arctan(across),
        visible=seen.visible,
        anchor_count=seen.visible.sum(axis=1),
        dop=seen.dop,
        margin_m=_last_margin(seen.margin_m, limits.needed_in_sight),
        clearance_m=clearance_m,
        position_sigma_m=sigma_m,
        bubble_radius_m=limits.bubble_epsilon * sigma_m + limits.dem_sigma_m if asked else np.full(len(fine), np.nan),
        corners=corners,
        cost=float(sums.cost[-1]),
        cost_split=_split(problem, field, fine, sums),
        totals=_totals(problem, sums, seen, _between(maps, fine, sums), sigma_m, steepest_rad(grid, fine), altitude_m),
    )


def _between(maps: SightMaps | None, places: Floats, sums: RunningSums) -> Sightings:
    """What the anchors give between the vertices: in the middle of what the path crosses of each triangle."""
    middle, at = middles(places)
    if maps is None:
        return _nothing_seen(len(middle))
    return maps.sightings(middle, np.interp(at, np.arange(len(places)), sums.time_s))


def _nothing_seen(points: int) -> Sightings:
    return Sightings(np.zeros((points, 0), np.bool_), np.zeros((points, 0)), np.full(points, np.nan))


def _last_margin(margin_m: Floats, needed: int) -> Floats:
    """(n,) the needed-th best clearance of each point; NaN where there are fewer anchors."""
    if margin_m.shape[1] < needed:
        return np.full(len(margin_m), np.nan)
    best_last = np.sort(np.where(np.isnan(margin_m), -np.inf, margin_m), axis=1)
    return best_last[:, margin_m.shape[1] - needed]


def _split(problem: PathProblem, field: CostField, places: Floats, sums: RunningSums) -> dict[str, float]:
    """What each weight contributes to the cost."""
    weights = problem.weights
    split = {
        "length": weights.length * sums.ground_m[-1],
        "climb": weights.climb * sums.climb_m[-1],
        "time": weights.time * sums.time_s[-1],
        "out_of_sight": weights.out_of_sight * sums.dark_s[-1],
    }
    # what a metre costs besides is told apart in each square, at the middle of each piece
    middle = 0.5 * (places[:-1] + places[1:])
    square = (
        np.minimum(middle[:, 0].astype(np.intp), field.dop_cost.shape[0] - 1),
        np.minimum(middle[:, 1].astype(np.intp), field.dop_cost.shape[1] - 1),
    )
    beside = sums.cost[-1] - sum(split.values())
    by_dop = float((field.dop_cost[square] * np.diff(sums.ground_m)).sum())
    by_error = float(((field.added - field.dop_cost)[square] * np.diff(sums.ground_m)).sum())
    share = by_dop / (by_dop + by_error) if by_dop + by_error > 0.0 else 0.0
    split["dop"], split["position_error"] = max(beside, 0.0) * share, max(beside, 0.0) * (1.0 - share)
    return {name: float(value) for name, value in split.items()}


def _totals(
    problem: PathProblem,
    sums: RunningSums,
    seen: Sightings,
    between: Sightings,
    sigma_m: Floats,
    steepest_rad: float,
    altitude_m: Floats,
) -> PathTotals:
    count = seen.visible.sum(axis=1)
    with_anchors = seen.visible.shape[1] > 0
    # a piece is out of sight where either of its ends is
    dark = (count < problem.limits.needed_in_sight) if with_anchors else np.zeros(len(count), np.bool_)
    piece_s = np.diff(sums.time_s)
    dark_s = np.where(dark[:-1] | dark[1:], piece_s, 0.0)
    rise_m = float(altitude_m[-1] - altitude_m[0])
    return PathTotals(
        length_m=float(sums.ground_m[-1]),
        climb_m=float(sums.climb_m[-1]),
        descent_m=float(sums.climb_m[-1]) - rise_m,
        time_s=float(sums.time_s[-1]),
        out_of_sight_s=float(dark_s.sum()),
        longest_out_of_sight_s=_longest_run(dark_s),
        worst_dop=float(np.concatenate([seen.dop, between.dop]).max()) if with_anchors else math.nan,
        fewest_anchors=int(min(count.min(), between.visible.sum(axis=1).min())),
        mean_position_sigma_m=float((0.5 * (sigma_m[:-1] + sigma_m[1:]) * piece_s).sum() / piece_s.sum()),
        steepest_rad=steepest_rad,
    )


def _longest_run(dark_s: Floats) -> float:
    longest = run = 0.0
    for seconds in dark_s.tolist():
        run = run + seconds if seconds > 0.0 else 0.0
        longest = max(longest, run)
    return longest


class Endings:
    """What every outcome of one plan has in common, and the outcomes."""

    def __init__(self, problem: PathProblem, told: Callable[[float], None], stop: Stop, begin_s: float) -> None:
        self.problem, self.told, self.stop, self.begin_s = problem, told, stop, begin_s
        self.first_path_s = math.nan
        self.warnings: tuple[str, ...] = ()
        self.field: CostField

    def ended(self) -> bool:
        """Whether the plan was stopped or its time is up."""
        return self.stop() or time.perf_counter() - self.begin_s > self.problem.budget.seconds

    def found(
        self, path: Path, validation: PathValidation, reference: float, planner: str, completed: bool
    ) -> PathOutcome:
        """A path that the validator passed; completed: not ended by the clock or a request."""
        self.told(1.0)
        sentence = f"A path of {path.totals.length_m:,.0f} m was found that takes {time_words(path.totals.time_s)}."
        return replace(
            self.answer(PathStatus.FOUND, sentence, planner, "count" if completed else self.ended_by),
            path=path,
            validation=validation,
            reference_cost=reference,
            ratio=path.cost / reference,
        )

    def refused(self, validation: PathValidation) -> PathOutcome:
        """The validator found a fault in what was planned."""
        sentence = f"A path was planned that the validator refuses: {validation.sentence}"
        return replace(self.answer(PathStatus.REFUSED, sentence, "none", "count"), validation=validation)

    def unreachable(self, unreachable: Unreachable) -> PathOutcome:
        """There is no way, to the grain of the proof."""
        assert unreachable.grain is not None, "what is unreachable is proved"
        width_m = unreachable.grain.width_m
        spare = f" with {_told_m(0.5 * width_m)} m or more to spare on either side" if width_m > 0.0 else ""
        sentence = f"There is no way{spare}: {_blocks(self.problem.grid, unreachable)}"
        return replace(self.answer(PathStatus.UNREACHABLE, sentence, "grid", "proof"), unreachable=unreachable)

    def undecided(self, blocked: Unreachable, why: str) -> PathOutcome:
        """Neither a way nor the proof that there is none was found."""
        what = _blocks(self.problem.grid, blocked)
        sentence = f"No way was found, and that there is none is not proved, for {why}: {what}"
        return replace(self.answer(PathStatus.UNDECIDED, sentence, "none", "grain"), unreachable=blocked)

    def out_of_budget(self, sentence: str) -> PathOutcome:
        """Ended before there was a path."""
        return self.answer(PathStatus.OUT_OF_BUDGET, sentence, "none", self.ended_by)

    @property
    def ended_by(self) -> str:
        """What ended a plan before its work was done."""
        return "stop" if self.stop() else "time"

    def answer(self, status: PathStatus, sentence: str, planner: str, stopped_by: str) -> PathOutcome:
        """What every outcome has; a path or a proof is added by its own."""
        return PathOutcome(
            status=status,
            sentence=sentence,
            path=None,
            unreachable=None,
            validation=None,
            reasons=self.field.reasons,
            reference_cost=math.nan,
            ratio=math.nan,
            planner=planner,
            stopped_by=stopped_by,
            seed=self.problem.seed,
            warnings=self.warnings,
            first_path_s=self.first_path_s,
            elapsed_s=time.perf_counter() - self.begin_s,
            version=VERSION,
        )


def _blocks(grid: ElevationGrid, found: Unreachable) -> str:
    """What blocks, where, and what would open a way."""
    sentence = f"what blocks it near {told_place(grid, *found.where_m)} is {found.reason.in_words}."
    if not found.relaxations:
        return f"{sentence} No single limit would open one by giving way."
    cheapest = found.relaxations[0]
    there_is = "There is one" if cheapest.shown else "There may be one, which was not shown,"
    return f"{sentence} {there_is} {cheapest.sentence}."


def _told_m(metres: float) -> str:
    """Metres in two figures, rounded up, so that what is said stays true."""
    digits = max(1 - math.floor(math.log10(metres)), 0)
    return f"{math.ceil(metres * 10.0**digits) / 10.0**digits:.{digits}f}"
