"""What a detector session and its epochs may cost: how many anchors, ranges, epochs, streams, subsets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from service.errors import LimitError
from service.live.request import DetectionIn, DetectorIn, EpochIn, RangeIn
from service.settings import Settings

__all__ = ["DetectorLimits"]

# of bodies: the field, what it lists, and whose they are
LISTS = (
    ("anchors", "anchors", "A detector"),
    ("ranges", "ranges", "An epoch"),
    ("moved", "moved anchors", "An epoch"),
)


@dataclass(frozen=True, slots=True)
class DetectorLimits:
    """How many anchors, subsets and streams a detector may have; from the settings of the service."""

    max_anchors: int
    max_search: int
    max_streams: int
    max_epochs: int

    @classmethod
    def of(cls, settings: Settings) -> DetectorLimits:
        """The limits that the settings name."""
        return cls(
            settings.max_detector_anchors,
            settings.max_detector_search,
            settings.max_detector_streams,
            settings.max_detector_epochs,
        )

    def refuse_long(self, fields: Any) -> None:
        """Raise LimitError where a list of a body is longer than it may be, before anything in it is looked at."""
        for name, what, whose in LISTS:
            given = fields.get(name) if isinstance(fields, dict) else None
            if isinstance(given, list):
                self._check_number(len(given), what, whose)

    def refuse_long_epochs(self, fields: Any) -> None:
        """The same for a body of several epochs."""
        epochs = fields.get("epochs") if isinstance(fields, dict) else None
        if not isinstance(epochs, list):
            return
        if len(epochs) > self.max_epochs:
            raise LimitError(
                f"A request may have {self.max_epochs} epochs, not {len(epochs)}",
                limit_name="max_detector_epochs",
                limit=self.max_epochs,
                given=len(epochs),
            )
        for epoch in epochs:
            self.refuse_long(epoch)

    def check_detector(self, asked: DetectionIn | DetectorIn) -> None:
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
