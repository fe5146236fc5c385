"""What one epoch may cost: it is answered in the process that answers HTTP, so it must be over in milliseconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from service.errors import LimitError
from service.schemas.detections import EpochIn, RangeIn, RangingAnchorIn
from service.schemas.detector_settings import DetectorSettingsIn
from service.settings import Settings

__all__ = ["DetectorLimits"]


class Asked(Protocol):
    """What a stateless detection and a session have in common."""

    @property
    def anchors(self) -> list[RangingAnchorIn]:
        """The anchors."""
        ...

    @property
    def settings(self) -> DetectorSettingsIn:
        """What the detector is told."""
        ...


@dataclass(frozen=True, slots=True)
class DetectorLimits:
    """How many anchors, subsets and streams a detector may have; from the settings of the service."""

    max_anchors: int
    max_search: int
    max_streams: int

    @classmethod
    def of(cls, settings: Settings) -> DetectorLimits:
        """The limits that the settings name."""
        return cls(settings.max_detector_anchors, settings.max_detector_search, settings.max_detector_streams)

    def check_detector(self, asked: Asked) -> None:
        """Raise LimitError where there are too many anchors or the search may take too long."""
        self._check_number(len(asked.anchors), "anchors", "A detector")
        if asked.settings.search_limit > self.max_search:
            raise LimitError(
                f"search_limit is {asked.settings.search_limit}, more than the limit of {self.max_search} subsets",
                limit_name="max_detector_search",
                limit=self.max_search,
                given=asked.settings.search_limit,
            )

    def check_ranges(self, ranges: list[RangeIn]) -> None:
        """Raise LimitError where an epoch has more ranges than a detector may have anchors."""
        self._check_number(len(ranges), "ranges", "An epoch")

    def check_epoch(self, asked: EpochIn) -> None:
        """The same, for the anchors that have moved too."""
        self.check_ranges(asked.ranges)
        self._check_number(len(asked.moved), "moved anchors", "An epoch")

    def _check_number(self, given: int, what: str, whose: str) -> None:
        if given > self.max_anchors:
            raise LimitError(
                f"{whose} may have {self.max_anchors} {what}, not {given}",
                limit_name="max_detector_anchors",
                limit=self.max_anchors,
                given=given,
            )
