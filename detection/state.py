"""What a detector remembers, to be read, and how well its witnesses do over a session (seed 000, fusion step 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .settings import DetectorSettings
from .verdicts import AnchorVerdict, EpochResult, Rejection, Sight

__all__ = ["AnchorRecord", "AnchorState", "DetectorState", "Health", "Monitor", "sensitivity_scale"]


@dataclass(frozen=True, slots=True)
class AnchorState:
    """The last word on one anchor. time_s: of its last range, None before the first. occluded_share: of its ranges."""

    anchor_id: str
    sight: Sight
    probability: float
    time_s: float | None
    range_m: float
    ranges: int
    occluded_share: float


@dataclass(slots=True)
class AnchorRecord:
    """What a session notes of one anchor; changed in place, and read as an ``AnchorState``."""

    last: AnchorVerdict | None = None
    time_s: float | None = None
    ranges: int = 0
    occluded_share: float = 0.0

    def note(self, verdict: AnchorVerdict, time_s: float) -> None:
        """Count one range and its verdict."""
        self.occluded_share = (self.occluded_share * self.ranges + verdict.occluded) / (self.ranges + 1)
        self.last, self.time_s = verdict, time_s
        self.ranges += 1

    def state(self, anchor_id: str) -> AnchorState:
        """As it is now."""
        sight, probability, range_m = Sight.UNKNOWN, 0.5, math.nan
        if self.last is not None:
            sight, probability, range_m = self.last.sight, self.last.probability, self.last.range_m
        return AnchorState(anchor_id, sight, probability, self.time_s, range_m, self.ranges, self.occluded_share)


@dataclass(frozen=True, slots=True)
class Health:
    """How the witnesses have done so far (seed 000, fusion step 5).

    geometry_false_positives, odometry_false_positives: share of ranges that the witness alone flagged and the verdict
        cleared. odometry_failures: share of odometry increments that were not reliable. warnings: sentences.
    """

    geometry_false_positives: float
    odometry_false_positives: float
    odometry_failures: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class DetectorState:
    """A snapshot of a detector.

    time_s: of the last epoch, on the ranging clock. epochs: accepted. rejections: how many ranges and epochs were not
    used, by reason. position_m, velocity_m_per_s: of the track, (3,) east, north, up; None without one.
    """

    time_s: float | None
    epochs: int
    rejections: dict[Rejection, int]
    anchors: tuple[AnchorState, ...]
    health: Health
    last: EpochResult | None
    position_m: tuple[float, float, float] | None = None
    velocity_m_per_s: tuple[float, float, float] | None = None


MEMORY = 200.0  # ranges (or increments) that an average looks back on
SYSTEMATIC = 0.5  # share of failures that is no chance any more
ENOUGH = 20  # increments before that is said
NOTABLE = 0.1  # false positives of a witness that are worth a warning

TERRAIN_SCALES = {"open": 1.25, "mixed": 1.0, "complex": 0.8}
CRITICALITY_SCALES = {"low": 1.25, "normal": 1.0, "high": 0.8}


def sensitivity_scale(settings: DetectorSettings) -> float:
    """Factor on all tolerances: smaller, so more sensitive, on complex ground and for critical missions."""
    return TERRAIN_SCALES[settings.terrain] * CRITICALITY_SCALES[settings.criticality]


class Monitor:
    """Running averages of how often each witness was overruled and how often odometry failed; changed in place."""

    def __init__(self) -> None:
        self._overruled = {"geometry": 0.0, "odometry": 0.0}
        self._failures = 0.0
        self._increments = 0
        self._spoken = {"geometry": 0, "odometry": 0}
        self._of_heading = ""

    def note(self, witness: str, false_positive: bool) -> None:
        """Count one range that the witness spoke about, and whether it flagged what the verdict cleared."""
        self._spoken[witness] += 1
        share = 1.0 / min(self._spoken[witness], MEMORY)
        self._overruled[witness] += share * (float(false_positive) - self._overruled[witness])

    def note_odometry(self, reliable: bool) -> None:
        """Count one odometry increment."""
        self._increments += 1
        self._failures += (float(not reliable) - self._failures) / min(self._increments, MEMORY)

    def note_heading(self, warning: str) -> None:
        """What is to be told of the heading, "" where it is well."""
        self._of_heading = warning

    def accuracy(self, witness: str) -> float:
        """What a witness's weight is multiplied by: 1 while it was never overruled."""
        return 1.0 - self._overruled[witness]

    @property
    def odometry_fails(self) -> bool:
        """Whether odometry fails so often that its weight is that of an unreliable one."""
        return self._increments >= ENOUGH and self._failures > SYSTEMATIC

    def health(self) -> Health:
        """The averages, with a sentence for each that calls for attention."""
        warnings = [self._of_heading] if self._of_heading else []
        if self.odometry_fails:
            warnings.append(f"Odometry fails systematically: {self._failures:.0%} of its increments are unreliable.")
        for witness, share in self._overruled.items():
            if share > NOTABLE and self._spoken[witness] >= ENOUGH:
                warnings.append(f"The {witness} witness is often overruled: {share:.0%} of its ranges.")
        return Health(self._overruled["geometry"], self._overruled["odometry"], self._failures, tuple(warnings))
