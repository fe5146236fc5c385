"""Which anchors a detector session finds occluded again and again, and since when."""

from __future__ import annotations

from detection import EpochResult

__all__ = ["Occlusions"]


class Occlusions:
    """For each anchor, from when to when every one of its ranges has been occluded."""

    def __init__(self) -> None:
        self._runs: dict[str, tuple[float, float]] = {}

    def take_in(self, result: EpochResult) -> None:
        """Verdicts of one epoch; one that is unknown neither ends a run nor begins one."""
        for verdict in result.verdicts:
            if verdict.occluded:
                since_s, _ = self._runs.get(verdict.anchor_id, (result.time_s, result.time_s))
                self._runs[verdict.anchor_id] = since_s, result.time_s
            elif verdict.sight in ("clear", "too short"):
                self._runs.pop(verdict.anchor_id, None)

    def lasting(self, at_least_s: float) -> list[str]:
        """Ids of the anchors whose ranges have been occluded so long, in the order in which that began."""
        runs = sorted(self._runs.items(), key=lambda run: run[1])
        return [anchor_id for anchor_id, (since_s, until_s) in runs if until_s - since_s >= at_least_s]
