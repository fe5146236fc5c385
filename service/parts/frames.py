"""Maps at several times: anchors on tracks, and when to look."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from service.parts.anchors import AntennaIn
from service.parts.points import InADatum, Metres, NotNegativeMetres, PointIn, Positive

__all__ = ["FramesIn", "TrackIn", "TrackPointIn"]

Seconds = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-1e10, le=1e10)]
MOST_FRAMES = 500
MOST_TRACK_POINTS = 10_000


class TrackPointIn(PointIn):
    """Where an anchor on a track is at one time."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"time_s": 60.0, "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0}]
        }
    )

    time_s: Seconds = Field(description="When, seconds on the clock of the frames.")


class TrackIn(AntennaIn):
    """An anchor that moves, straight and even from point to point."""

    points: Annotated[list[TrackPointIn], Field(min_length=1, max_length=MOST_TRACK_POINTS)] = Field(
        description="Where it is when, in ascending time."
    )

    @model_validator(mode="after")
    def _times_ascend(self) -> Self:
        times_s = [point.time_s for point in self.points]
        if any(later <= earlier for earlier, later in pairwise(times_s)):
            raise ValueError(f"Track {self.id}: its points must ascend in time_s.")
        return self


class FramesIn(InADatum):
    """Evenly spaced times, and the height of which availability is told; second 0 is the satellites' time."""

    from_s: Seconds = Field(0.0, description="The first frame, seconds.")
    to_s: Seconds = Field(description="No frame is later, seconds.")
    step_s: Positive = Field(description="From frame to frame, seconds.")
    altitude_m: Metres | None = Field(
        None, description="Availability at this altitude, metres; or give above_ground_m."
    )
    above_ground_m: NotNegativeMetres | None = Field(
        None, description="Availability at this height above ground, metres; left out = the rover's antenna."
    )

    @model_validator(mode="after")
    def _some_frames(self) -> Self:
        if self.to_s < self.from_s:
            raise ValueError(f"Frames must end after they begin, not from {self.from_s:g} to {self.to_s:g} s.")
        if self.altitude_m is not None and self.above_ground_m is not None:
            raise ValueError("Give only one of altitude_m and above_ground_m of the frames.")
        number = self._number()
        if number > MOST_FRAMES:
            raise ValueError(f"{number:,.0f} frames are more than the limit of {MOST_FRAMES}; take a larger step_s.")
        return self

    def times_s(self) -> list[float]:
        """Seconds of each frame."""
        return [self.from_s + number * self.step_s for number in range(int(self._number()))]

    def _number(self) -> float:
        steps = (self.to_s - self.from_s) / self.step_s * (1.0 + 1e-12)
        return math.floor(steps) + 1 if steps < 1e15 else steps
