"""Where to put anchors on ground that need not fit into memory: coverage, by windows of the posts in reach."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import NoCandidateError, PlacementError
from planning.placement.candidates import Candidates
from planning.placement.cluster import Cluster
from planning.placement.goals import Goal
from planning.placement.greedy import exchange, fill_up, greedy, upper_bound
from planning.placement.placing import by_gain, require_enough, require_sight
from planning.placement.rules import Feasible, PlacementRules, feasible_candidates
from planning.placement.sight import SightOptions, positions_of
from planning.placement.targets import Targets
from planning.placement.together import Together
from terrain import ElevationGrid
from terrain.version import VERSION
from visibility.sight import Anchor, AntennaLimits
from visibility.sight.in_reach import Raster

from .judging import SightFiles, WindowJudge
from .sight import MOST_SEEING, WindowSight

__all__ = ["WindowPlacement", "WindowQuestion", "place_by_windows"]

Floats = npt.NDArray[np.float64]
SHARE_OF_SIGHT, SHARE_OF_GREEDY, SHARE_OF_EXCHANGES = 0.9, 0.94, 0.97
# the rule of range, which alone asks for them, is looked at parcel by parcel
NOT_ASKED = Targets("area", np.zeros((0, 3)), np.zeros(0), None, np.zeros((0, 3)), 0.0, 0)


@dataclass(frozen=True, slots=True)
class WindowQuestion:
    """What is asked of places on ground of any size.

    goal: coverage. rules: with a max_range_m, without links. area: polygon of the targets in the DEM's frame, all known
    ground by default. above_ground_m: of the rover's antenna. fixed: anchors that stand. Raises PlacementError.
    """

    goal: Goal
    rules: PlacementRules
    above_ground_m: float = 1.5
    area: shapely.Geometry | None = None
    fixed: tuple[Anchor, ...] = ()
    sight: SightOptions = field(default_factory=SightOptions)

    def __post_init__(self) -> None:
        if self.goal.objective != "coverage":
            raise PlacementError(
                f'By windows anchors are placed for the objective "coverage", not for "{self.goal.wanted}".'
            )
        if not math.isfinite(self.rules.max_range_m):
            raise PlacementError(
                "Without a max_range_m all ground is in reach of every candidate; by windows it needs one."
            )
        if self.rules.link is not None:
            raise PlacementError("By windows no link is looked for: its lines go beyond the posts in reach.")
        if any(anchor.doubts for anchor in self.fixed):
            raise PlacementError("By windows no doubts about standing anchors are looked at; leave them out.")
        if not (math.isfinite(self.above_ground_m) and self.above_ground_m >= 0.0):
            raise PlacementError(f"The antenna's height above ground must be >= 0 m, not {self.above_ground_m}.")


@dataclass(frozen=True, slots=True, eq=False)
class WindowPlacement:
    """The answer to ``place_by_windows``: as of a Placement, all shares 0..1 of the targets.

    targets: how many posts count. exact: the value over every edge of the surface, of the anchors that were chosen.
    """

    anchors: tuple[Anchor, ...]
    candidate: npt.NDArray[np.intp]
    question: WindowQuestion
    feasible: Feasible
    targets: int
    value: float
    exact: float
    before: float
    bound: float
    marginal: Floats
    greedy_value: float
    stopped: bool
    warnings: tuple[str, ...]
    timing_s: dict[str, float]
    version: str

    @property
    def chosen(self) -> Candidates:
        """The candidates that were chosen, in the anchors' order."""
        at = dict(zip(self.feasible.number.tolist(), range(len(self.feasible.number)), strict=True))
        return self.feasible.candidates.take(np.array([at[number] for number in self.candidate.tolist()], np.intp))

    @property
    def gap(self) -> float:
        """Distance from the bound, >= 0."""
        return self.bound - self.value


def place_by_windows(
    dem: Raster,
    candidates: Candidates,
    count: int,
    question: WindowQuestion,
    *,
    cluster: Cluster | str | None = None,
    folder: Path | None = None,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> WindowPlacement:
    """Places for ``count`` anchors over a DEM of any size: greedy, then exchanges until none is better.

    Sight is worked out parcel by parcel, each reading its window of the ground, by the workers of a Dask cluster if one
    is given; the bits lie in files of ``folder`` (the system's temporary folder by default), which the workers must
    see, and go in the end. A choice changes gains only where windows meet its own: those alone are worked out again.
    progress: called with the finished share 0..1. stop: once it says True the best so far is the answer.
    Raises PlacementError, NoCandidateError, ClusterError, AnchorError, DemReadError.
    """
    _check_number(count, question)
    begin_s = time.perf_counter()
    told, stopped = progress or _nobody, stop or _never
    rules, full = question.rules, question.goal.needed_with_spare
    frame = dem if isinstance(dem, ElevationGrid) else dem.frame()
    feasible = feasible_candidates(frame, candidates, replace(rules, max_range_m=math.inf), NOT_ASKED)
    with TemporaryDirectory(prefix=".placement-", dir=folder) as own:
        options = replace(question.sight, max_range_m=rules.max_range_m)
        sight = WindowSight(dem, options, question.above_ground_m, question.area, Path(own).absolute())
        worked = sight.of_candidates(
            feasible.candidates.position_m,
            question.fixed,
            Cluster(cluster) if isinstance(cluster, str) else cluster,
            lambda share: told(SHARE_OF_SIGHT * share),
            stopped,
        )
        feasible = _in_range(feasible, worked.kept, worked.done)
        require_enough(count, feasible)
        sight_s = time.perf_counter() - begin_s
        files, many = worked.files, len(feasible.candidates)
        position_m = feasible.candidates.position_m
        together = Together(frame, position_m, positions_of(question.fixed), rules.min_separation_m, None)
        judge, guide = WindowJudge(files, full, partial=False), WindowJudge(files, full, partial=True)
        first = fill_up(judge, greedy(guide, many, count, together), count, together)
        told(SHARE_OF_GREEDY)
        chosen = exchange(judge, first, together, stop=stop)
        told(SHARE_OF_EXCHANGES)
        order, marginal = by_gain(judge, guide, chosen)
        sigma_m, limits = question.goal.ranging_sigma_m, AntennaLimits(max_range_m=rules.max_range_m)
        anchors = tuple(
            Anchor(f"P{number}", east_m, north_m, altitude_m, sigma_m, limits=limits, radio=question.sight.radio)
            for number, (east_m, north_m, altitude_m) in enumerate(position_m[order].tolist(), 1)
        )
        value = judge.value(chosen)
        placement = WindowPlacement(
            anchors=anchors,
            candidate=feasible.number[np.array(order, np.intp)],
            question=question,
            feasible=feasible,
            targets=files.total,
            value=value,
            exact=sight.exact_share((*question.fixed, *anchors), full, files.total),
            before=judge.value([]),
            bound=max(_bound(files, full, many, count), value),
            marginal=marginal,
            greedy_value=judge.value(first),
            stopped=stopped(),
            warnings=(*worked.warnings, *_too_few(len(order), count)),
            timing_s={"sight_s": sight_s, "search_s": time.perf_counter() - begin_s - sight_s},
            version=VERSION,
        )
    told(1.0)
    return placement


def _check_number(count: int, question: WindowQuestion) -> None:
    if count < 1:
        raise PlacementError(f"At least one anchor has to be placed, not {count}.")
    if count + len(question.fixed) > MOST_SEEING:
        raise PlacementError(f"By windows up to {MOST_SEEING} anchors are counted, not {count + len(question.fixed)}.")
    require_sight(count, len(question.fixed), question.goal)


def _in_range(feasible: Feasible, kept: npt.NDArray[np.bool_], done: npt.NDArray[np.bool_]) -> Feasible:
    """Those candidates that were worked out and have a target in range. Raises NoCandidateError."""
    removed = dict(feasible.removed)
    if (done & ~kept).any():
        removed["no target within range"] = int(np.count_nonzero(done & ~kept))
    left = Feasible(feasible.candidates.take(kept), feasible.number[kept], removed)
    if not kept.any():
        raise NoCandidateError(left.sentence(), removed)
    return left


def _bound(files: SightFiles, full: int, many: int, count: int) -> float:
    """A share that no set of so many candidates exceeds, as ``bound_of`` has it."""
    judge = WindowJudge(files, full, partial=True, possible=True)
    members = greedy(judge, many, count, Together.anything_goes(many))
    most = sum(int(np.count_nonzero(row >= full)) for row in files.by_all) / files.total
    return min(upper_bound(judge, many, count, members), most)


def _too_few(placed: int, count: int) -> tuple[str, ...]:
    if placed == count:
        return ()
    return (f"Only {placed} of {count} anchors are placed: no set of more was found that keeps them apart.",)


def _nobody(_: float) -> None:
    """Tells nobody of progress."""


def _never() -> bool:
    """Nobody stops it."""
    return False
