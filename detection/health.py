"""How well the witnesses do over a session, and what follows for their weights (seed 000, fusion step 5)."""

from __future__ import annotations

from .settings import DetectorSettings
from .state import Health

__all__ = ["Monitor", "sensitivity_scale"]

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
