"""The validator's answer: for each limit that was checked, whether it holds, and where and by how much it does not."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, told_place

__all__ = ["LimitCheck", "PathLimit", "PathValidation", "check_of"]

Numbers = npt.NDArray[np.float64]


class Samples(Protocol):
    """Places along a path or flight. place_m: (n, 2); distance_m: (n,) from the start."""

    @property
    def grid(self) -> ElevationGrid: ...

    @property
    def place_m(self) -> Numbers: ...

    @property
    def distance_m(self) -> Numbers: ...

    def __len__(self) -> int: ...


class PathLimit(enum.StrEnum):
    """What a path has to keep; the words begin the sentences about it."""

    START = "distance from the start"
    WAY_POINTS = "distance from a way-point"
    GOAL = "distance from the goal"
    KNOWN_GROUND = "unknown ground under the footprint"
    SLOPE = "slope of the ground"
    PITCH = "pitch"
    ROLL = "roll"
    STEP = "step under the footprint"
    NO_GO = "distance to a no-go area"
    KEEP_IN = "distance to the edge of the keep-in areas"
    OUTSIDE = "way outside the keep-in areas"
    ANCHORS = "anchors in sight"
    DOP = "dilution"
    BUBBLE = "room for the safety bubble"
    CLEARANCE = "distance to the ground"
    MORPHING_MAP = "height over the morphing map"
    CEILING = "height under the ceiling"
    TURNING = "turning radius"
    START_HEADING = "angle from the heading at the start"


UNITS = {
    PathLimit.SLOPE: "degrees",
    PathLimit.PITCH: "degrees",
    PathLimit.ROLL: "degrees",
    PathLimit.START_HEADING: "degrees",
    PathLimit.ANCHORS: "",
    PathLimit.DOP: "",
    PathLimit.KNOWN_GROUND: "",
}


@dataclass(frozen=True, slots=True)
class LimitCheck:
    """One limit along a whole path.

    worst: the value that comes nearest to breaking it, or breaks it most; allowed: the limit. Metres, radians, or a
        number. NaN where nothing is known.
    broken, samples: at how many places of the path it is broken, of how many looked at.
    where_m: (east_m, north_m) of the worst place; first_m: of the first broken one; along_m: how far along the ground
        that lies from the start; where_told: that place in words.
    """

    limit: PathLimit
    worst: float
    allowed: float
    broken: int
    samples: int
    where_m: tuple[float, float]
    first_m: tuple[float, float] | None
    along_m: float
    where_told: str = ""

    @property
    def kept(self) -> bool:
        """Whether the limit holds everywhere."""
        return self.broken == 0

    @property
    def sentence(self) -> str:
        """What holds or fails, in words."""
        unit = UNITS.get(self.limit, "m")
        worst, allowed = (_told(value, unit) for value in (self.worst, self.allowed))
        head = f"{self.limit}: {worst} where {allowed} is the limit"
        if self.kept or self.first_m is None:
            return f"{head}, kept."
        at = f"first {self.along_m:.0f} m from the start, at {self.where_told}"
        return f"{head}; broken at {self.broken} of {self.samples} places, {at}."


@dataclass(frozen=True, slots=True)
class PathValidation:
    """The answer to ``validate_path``: a check for each limit that was asked for, in the order of PathLimit.

    step_m: distance between samples at most. samples: how many there were. length_m: along the ground.
    """

    checks: tuple[LimitCheck, ...]
    step_m: float
    samples: int
    length_m: float

    @property
    def passed(self) -> bool:
        """Whether the path keeps every limit."""
        return all(check.kept for check in self.checks)

    @property
    def failures(self) -> tuple[LimitCheck, ...]:
        """The checks that failed."""
        return tuple(check for check in self.checks if not check.kept)

    @property
    def sentence(self) -> str:
        """The whole in words."""
        if self.passed:
            limits = "its limit" if len(self.checks) == 1 else f"all {len(self.checks)} limits"
            return f"The path keeps {limits} at {self.samples} places over {self.length_m:.0f} m."
        return " ".join(check.sentence for check in self.failures)


def check_of(
    walk: Samples,
    limit: PathLimit,
    value: npt.ArrayLike,
    allowed: float,
    *,
    at_least: bool = False,
    below: bool = False,
    slack: float = 0.0,
    at: npt.NDArray[np.int64] | None = None,
    ignore_nan: bool = False,
) -> LimitCheck:
    """Judge values (n,) at the walk's samples, or at those numbered ``at``; an unknown value breaks the limit.

    at_least: the limit is a lower one. below: the limit itself is too much. slack: by how much rounding may overstep
    it.
    """
    values = np.asarray(value, np.float64)
    places = np.arange(len(walk)) if at is None else at
    if ignore_nan:
        known = ~np.isnan(values)
        values, places = values[known], places[known]
    if len(values) == 0:
        here = walk.place_m[0]
        return LimitCheck(limit, math.nan, allowed, 0, 0, (float(here[0]), float(here[1])), None, 0.0)
    excess = allowed - values if at_least else values - allowed
    excess = np.where(np.isnan(values), np.inf, excess)
    # inf against inf: an unlimited value may be unlimited
    excess = np.where((values == allowed), 0.0, excess)
    broken = excess >= 0.0 if below else excess > slack
    worst = int(np.argmax(excess))
    first = int(np.argmax(broken)) if broken.any() else None
    return LimitCheck(
        limit,
        float(values[worst]),
        float(allowed),
        int(np.count_nonzero(broken)),
        len(values),
        _place(walk, places[worst]),
        None if first is None else _place(walk, places[first]),
        float(walk.distance_m[places[worst if first is None else first]]),
        "" if first is None else told_place(walk.grid, *_place(walk, places[first]), 0.1),
    )


def _place(walk: Samples, number: int) -> tuple[float, float]:
    east_m, north_m = walk.place_m[number].tolist()
    return east_m, north_m


def _told(value: float, unit: str) -> str:
    if math.isnan(value):
        return "unknown"
    if unit == "degrees":
        return f"{math.degrees(value):.2f} degrees"
    return f"{value:.4g} {unit}".strip()
