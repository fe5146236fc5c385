"""What it is worth to plan for sight: the same drives on the shortest path and on the occlusion-aware one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from benchmarks.planning.path_problems import grounds, random_problems
from benchmarks.report import Row, Table
from detection import detect_3d
from navigation import MotionNoise, filter_ranges, initial_state
from planning import NoCoverageError, PlaceError
from planning.paths import CostWeights, Path, PathProblem, plan_path
from visibility import Anchor, lines_of_sight

__all__ = ["benefit"]

Floats = npt.NDArray[np.float64]

SHORTEST = CostWeights(length=1.0, climb=0.0, out_of_sight=0.0)
AWARE = CostWeights(length=1.0, climb=0.0, out_of_sight=3.0, dop=0.05)
RANGE_SIGMA_M, TOLERANCE_M = 0.3, 1.2
# epochs of a drive, at least a second apart; a hidden anchor's range comes through so often, and longer
EPOCHS, THROUGH = 150, 0.3
# problems that are drawn for each one that both paths can be planned for, at most
TRIED = 10
NOTE = f"""\
4 to 6 anchors; both paths keep the same limits. Each is driven in simulation: ranges of sigma {RANGE_SIGMA_M} m to
anchors in sight by exact lines; from a hidden one a range comes through with probability {THROUGH}, too long by the
way over the ground and up to 10 m. The detector judges each epoch, the filter takes what it leaves in. Errors are
horizontal."""


def benefit(count: int = 200, posts: int = 120) -> Table:
    """Time out of sight and mean position error of both paths, and what the aware one costs in length."""
    rows, every = [], []
    chosen = [ground for ground in grounds(posts) if not ground.name.startswith("maze")]
    for number, ground in enumerate(chosen):
        wanted, drives = count // len(chosen) + (number < count % len(chosen)), []
        for n, problem in enumerate(random_problems(ground, TRIED * wanted, seed=300 + number, weights=AWARE)):
            pair = _both(problem, 4 + n % 3)
            if pair is not None:
                drives.append([_drive(problem, path, np.random.default_rng(n)) for path in pair])
            if len(drives) == wanted:
                break
        if drives:
            rows.append(_row(ground.name, np.array(drives)))
            every += drives
    rows.append(_row("all", np.array(every)))
    columns = ("ground", "problems", "out of sight, shortest → aware", "error, shortest → aware", "length")
    return Table("What planning for sight is worth", columns, rows, NOTE)


def _both(problem: PathProblem, anchors: int) -> tuple[Path, Path] | None:
    """(shortest, aware) path of a problem with some of its anchors; None where there is none."""
    some = problem.anchors[:anchors]
    limits = replace(problem.limits, min_anchors=min(problem.limits.min_anchors, 1), dop_limit=np.inf)
    try:
        found = [
            plan_path(replace(problem, anchors=some, maps=None, limits=limits, weights=weights))
            for weights in (SHORTEST, AWARE)
        ]
    except (NoCoverageError, PlaceError):
        return None
    short, aware = (outcome.path for outcome in found)
    return None if short is None or aware is None else (short, aware)


def _drive(problem: PathProblem, path: Path, random: np.random.Generator) -> tuple[float, float, float]:
    """(share of the time out of sight, mean horizontal error in metres, length in metres) of one drive."""
    total_s = path.totals.time_s
    times_s = np.linspace(0.0, total_s, int(min(max(total_s, 2.0), EPOCHS)))
    truth_m = np.column_stack([np.interp(times_s, path.time_s, axis) for axis in (path.east_m, path.north_m)])
    up_m = np.interp(times_s, path.time_s, path.altitude_m) + problem.rover.receiver_above_ground_m
    truth_m = np.column_stack([truth_m, up_m])
    anchors = [anchor for anchor in problem.anchors[: path.visible.shape[1]] if isinstance(anchor, Anchor)]
    places_m = np.array([(a.east_m, a.north_m, a.altitude_m) for a in anchors])
    measured_m = _ranges(problem, truth_m, places_m, random)
    taken_m = np.array([_left_in(places_m, ranges_m, truth_m[0]) for ranges_m in measured_m])
    speed = np.diff(truth_m, axis=0)[0] / np.diff(times_s)[0]
    begin = initial_state(0.0, truth_m[0], speed, position_sigma_m=1.0, velocity_sigma_m_per_s=0.3)
    k = len(anchors)
    log = filter_ranges(
        begin,
        MotionNoise(0.02, 0.02, 0.02),
        np.repeat(times_s, k),
        np.tile(np.arange(k), len(times_s)),
        taken_m.ravel(),
        RANGE_SIGMA_M**2,
        places_m,
    )
    error_m = np.hypot(*(log.position_m[k - 1 :: k, :2] - truth_m[:, :2]).T)
    return path.totals.out_of_sight_s / total_s, float(error_m.mean()), path.totals.length_m


def _ranges(problem: PathProblem, truth_m: Floats, places_m: Floats, random: np.random.Generator) -> Floats:
    """(epochs, anchors) measured ranges, NaN where none came."""
    n, k = len(truth_m), len(places_m)
    sight = lines_of_sight(problem.grid, np.repeat(truth_m, k, axis=0), np.tile(places_m, (n, 1)), excess_path=True)
    seen = (sight.verdict == 1).reshape(n, k)
    assert sight.excess_path_m is not None
    excess_m = np.nan_to_num(sight.excess_path_m.reshape(n, k), posinf=50.0) + random.uniform(0.5, 10.0, (n, k))
    exact_m = np.linalg.norm(truth_m[:, None] - places_m[None], axis=2)
    measured_m = exact_m + RANGE_SIGMA_M * random.standard_normal((n, k)) + np.where(seen, 0.0, excess_m)
    measured_m[~seen & (random.random((n, k)) > THROUGH)] = np.nan
    ranges_m: Floats = measured_m
    return ranges_m


def _left_in(places_m: Floats, ranges_m: Floats, near_m: Floats) -> Floats:
    """The ranges of an epoch that the detector does not flag; NaN for the others."""
    came = np.flatnonzero(np.isfinite(ranges_m))
    left_m = ranges_m.copy()
    if len(came) >= 4:
        hint_m = (np.nan, np.nan, float(near_m[2]))
        found = detect_3d(places_m[came], ranges_m[came], TOLERANCE_M, hint_m=hint_m)
        left_m[came[found.off]] = np.nan
    return left_m


def _row(name: str, drives: Floats) -> Row:
    """One line from (problems, 2, 3): shortest and aware, (dark share, error, length)."""
    dark, error_m, length_m = drives[..., 0].mean(axis=0), drives[..., 1], drives[..., 2]
    mean_m, median_m = error_m.mean(axis=0), np.median(error_m, axis=0)
    longer = float((length_m[:, 1].sum() / length_m[:, 0].sum() - 1.0) * 100.0)
    cells = (
        name,
        str(len(drives)),
        f"{dark[0] * 100:.1f} % → {dark[1] * 100:.1f} %",
        f"mean {mean_m[0]:.1f} m → {mean_m[1]:.1f} m; median {median_m[0]:.2f} m → {median_m[1]:.2f} m",
        f"+{longer:.1f} %",
    )
    better = bool(dark[1] <= dark[0] and mean_m[1] <= mean_m[0])
    return Row(cells, "less of both" if name == "all" else "", better if name == "all" else None)
