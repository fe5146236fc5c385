"""The Digital Morphing Map as the service gives it: above which altitude positioning is good enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from service.parts.map_area import map_area
from service.parts.map_facts import share_of
from service.parts.positioning import MorphingMapParameters
from service.parts.positioning_answers import PositioningSummary, positioning_summary
from service.parts.ranging_sources import RangingSources, Source, limit_of, sight_lines
from service.parts.sentences import told_as_asked
from service.products import UNWATCHED, Work
from service.products.in_common import QUANTILES
from terrain import ElevationGrid
from visibility import dop_map, morphing_map
from visibility.air import ColumnState
from visibility.dilution import NO_GO

from .frames import TimeFacts, find_frames

__all__ = ["STATE_WORDS", "FinishedMorphingMap", "MorphingMapSummary", "StateShare", "calculate_morphing_map"]

SHARE_OF_SIGHT_LINES = 0.5
# what tables, pictures and pages call a state: from where on one may fly
STATE_WORDS = {
    ColumnState.NOWHERE: "nowhere",
    ColumnState.EVERYWHERE: "from the ground up",
    ColumnState.ABOVE: "from a height up",
    ColumnState.CLOSED_AT_CEILING: "closed at the ceiling",
    ColumnState.OUTSIDE: "ground above the ceiling",
    ColumnState.UNKNOWN: "unknown",
}

FrameArrays = tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8], npt.NDArray[np.float64]]


class StateShare(BaseModel):
    """How many columns of air are in a state."""

    state: str = Field(description="nowhere, everywhere, above, closed_at_ceiling, outside or unknown.")
    words: str = Field(
        "",
        description="The same as tables and pictures call it: nowhere, from the ground up, from a height up, closed at "
        "the ceiling (though somewhere below it is good), ground above the ceiling, or unknown.",
    )
    posts: int = Field(description="Posts with such air.")
    share: float | None = Field(description="The same as part of all posts, 0..1.")


class MorphingMapSummary(PositioningSummary):
    """What a morphing map says in numbers, and how far to trust it."""

    ceiling: dict[str, float | None] = Field(description="Top of the air: altitude_m or above_ground_m, metres.")
    states: list[StateShare]
    receiver_above_ground_m: float = Field(1.5, description="Height of a ground rover's antenna, metres.")
    posts_no_go_for_the_rover: int = Field(0, description="Posts where that antenna is in no-flight air.")
    posts_with_several_intervals: int = Field(description="Posts with no-flight air in more than one piece.")
    above_ground_m: dict[str, float | None] = Field(
        description="p05, p50 and p95 of the height above ground from which one may fly, metres; null where nobody may."
    )
    over_time: TimeFacts | None = Field(None, description="Frames and availability, where frames were asked for.")


@dataclass(frozen=True, eq=False)
class FinishedMorphingMap:
    """A finished morphing map; arrays (rows, cols) as in ``visibility.air.MorphingMap``.

    dop, no_go: at the antenna of a rover on the ground, as in FinishedDopMap.
    frame_altitude_m, frame_state, available: over time, as in FoundFrames; empty without frames, and with them all the
        rest is that of the first.
    """

    grid: ElevationGrid
    anchors: tuple[Source, ...]
    parameters: MorphingMapParameters
    answer: MorphingMapSummary
    altitude_m: npt.NDArray[np.float32]
    safe_above_m: npt.NDArray[np.float32]
    state: npt.NDArray[np.uint8]
    no_flight_intervals: npt.NDArray[np.uint8]
    dop: npt.NDArray[np.float32]
    no_go: npt.NDArray[np.uint8]
    frame_altitude_m: npt.NDArray[np.float32]
    frame_state: npt.NDArray[np.uint8]
    available: npt.NDArray[np.float64]

    @property
    def above_ground_m(self) -> npt.NDArray[np.float32]:
        """altitude_m as a height above the ground; NaN as there."""
        return self.altitude_m - self.grid.heights_m

    def ceiling_words(self) -> str:
        """The ceiling as titles and tags say it."""
        if self.parameters.ceiling_above_ground_m is not None:
            return f"{self.parameters.ceiling_above_ground_m:g} m above ground"
        return f"altitude {self.parameters.ceiling_altitude_m:g} m"


@told_as_asked
def calculate_morphing_map(
    grid: ElevationGrid, parameters: MorphingMapParameters, work: Work = UNWATCHED
) -> FinishedMorphingMap:
    """The map that the parameters ask for on this grid.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError.
    """
    limit, area = limit_of(parameters), map_area(grid, parameters.area)
    nothing = np.empty((0, 0, 0), np.float32)
    over_time: FrameArrays = nothing, nothing.astype(np.uint8), nothing.astype(np.float64)
    told: TimeFacts | None = None
    if parameters.frames is not None:
        frames = find_frames(area, parameters, parameters.frames, work.progress)
        sources = RangingSources(frames.first.anchors, frames.unhealthy)
        found, lines = frames.first.map, frames.first_lines
        own, elapsed_s = (*area.sentences(), *frames.warnings), frames.elapsed_s
        over_time, told = (frames.altitude_m, frames.state, frames.available), frames.told
    else:
        lines, sources = sight_lines(grid, parameters, work.progress, SHARE_OF_SIGHT_LINES)
        lines = area.lines(lines)
        ceiling_m, above_ground = parameters.ceiling()
        found = morphing_map(lines, limit, ceiling_m=ceiling_m, ceiling_above_ground=above_ground)
        # the map's warnings are the sight lines' and its own
        own, elapsed_s = (*area.sentences(), *found.warnings[len(lines.warnings) :]), found.elapsed_s
    rover = dop_map(lines, parameters.receiver_above_ground_m, parameters.kind, measure=parameters.measure)
    no_go = rover.no_go(limit.dop_limit, limit.needed_anchors)
    known = area.known()
    known_posts = int(np.count_nonzero(known))
    above_m = (found.altitude_m - area.box.heights_m)[np.isfinite(found.altitude_m) & known]
    answer = MorphingMapSummary(
        **dict(positioning_summary(lines, sources, parameters, elapsed_s + rover.elapsed_s, own)),
        ceiling={"altitude_m": parameters.ceiling_altitude_m, "above_ground_m": parameters.ceiling_above_ground_m},
        states=[
            StateShare(
                state=state.name.lower(),
                words=STATE_WORDS[state],
                posts=area.count(found.state == state),
                share=share_of(int(np.count_nonzero((found.state == state) & known)), known_posts),
            )
            for state in ColumnState
        ],
        receiver_above_ground_m=parameters.receiver_above_ground_m,
        posts_no_go_for_the_rover=area.count(no_go == NO_GO),
        posts_with_several_intervals=area.count(found.no_flight_intervals > 1),
        above_ground_m={
            name: float(np.quantile(above_m, share)) if above_m.size else None for name, share in QUANTILES.items()
        },
        over_time=told,
    )
    work.progress(1.0)
    return FinishedMorphingMap(
        *(area.box, lines.anchors, parameters, answer),
        found.altitude_m,
        found.safe_above_m,
        found.state,
        found.no_flight_intervals,
        rover.dop,
        no_go,
        *over_time,
    )
