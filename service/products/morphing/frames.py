"""The morphing map over time as the service gives it: frames, and from when to when each place is available."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC
from typing import Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from service.estimates import BYTES_PER_CELL, SECONDS_PER_CELL_AND_ANCHOR, Demand, calculation
from service.parts.anchors import FramesIn
from service.parts.map_area import MapArea
from service.parts.map_facts import curvature_of, share_of
from service.parts.positioning import MorphingMapParameters
from service.parts.ranging_sources import limit_of, moving_sources, time_of
from visibility import Anchor, MinimumVisibleAltitude
from visibility.air import Availability, ColumnState, MorphingFrame, availability, morphing_frames
from visibility.sight import SurfaceCache
from visibility.signal import min_usable_altitude

__all__ = [
    "AVAILABLE_BANDS",
    "FoundFrames",
    "FrameFacts",
    "TimeFacts",
    "available_at",
    "find_frames",
    "frame_words",
    "frames_demand",
]

# of a frame: altitude and state of a column, and working it out
BYTES_PER_FRAME, SECONDS_PER_COLUMN = 5, 2e-6

AVAILABLE_BANDS = ("first_s", "last_s", "longest_from_s", "longest_to_s", "share", "unknown_share")


def frames_demand(cells: int, frames: int, moving: int, mode: Literal["fast", "exact"]) -> tuple[Demand, Demand]:
    """What a map over time takes; moving: anchors and satellites, whose sight lines each frame makes anew."""
    memory_bytes = cells * (frames * BYTES_PER_FRAME + BYTES_PER_CELL)
    seconds = cells * frames * (moving * SECONDS_PER_CELL_AND_ANCHOR[mode] + SECONDS_PER_COLUMN)
    return calculation(f"{frames} frames over {cells:,} cells", memory_bytes, seconds, "fewer frames, or a smaller DEM")


class FrameFacts(BaseModel):
    """One frame of a morphing map over time."""

    time_s: float = Field(description="When, seconds on the clock of the frames.")
    time: str | None = Field(description="The same as an instant, where satellites give it.")
    anchors: int = Field(description="Number of anchors then.")
    satellites: int = Field(description="Number of satellites in view then.")
    surfaces_computed: int = Field(
        description="Number of anchors and satellites that had moved, so that their sight lines were calculated anew."
    )
    share_flyable: float | None = Field(description="Part of the known posts flyable up to the ceiling, 0..1.")


class TimeFacts(BaseModel):
    """What a morphing map says about time."""

    frames: list[FrameFacts]
    available_at: dict[str, float] = Field(
        description="Height of which availability is told: altitude_m or above_ground_m, metres."
    )
    share_always_available: float | None = Field(
        description="Part of the known posts in flyable air at that height in all frames, 0..1."
    )
    share_sometimes_available: float | None = Field(description="The same in some frames, 0..1.")
    share_never_available: float | None = Field(description="The same in none, 0..1.")


@dataclass(frozen=True, eq=False)
class FoundFrames:
    """All frames: altitude_m (frames, rows, cols) float32, state the same in uint8, both as in MorphingMap.

    available: (AVAILABLE_BANDS, rows, cols) float64, as in Availability. told: what all of it says in numbers.
    first, first_lines: the first frame and its sight lines.
    """

    altitude_m: npt.NDArray[np.float32]
    state: npt.NDArray[np.uint8]
    available: npt.NDArray[np.float64]
    told: TimeFacts
    first: MorphingFrame
    first_lines: MinimumVisibleAltitude
    warnings: tuple[str, ...]
    unhealthy: tuple[str, ...]
    elapsed_s: float


def find_frames(
    area: MapArea, parameters: MorphingMapParameters, asked: FramesIn, progress: Callable[[float], None]
) -> FoundFrames:
    """All frames that are asked for. Raises AnchorError, FrameError, AlmanacError, VisibilityInputError."""
    grid, known = area.grid, area.known()
    sources = moving_sources(grid, parameters, asked)
    times_s = asked.times_s()
    ceiling_m, above_ground = parameters.ceiling()
    cache = SurfaceCache(
        *(grid, parameters.mode, curvature_of(parameters)),
        unknown=parameters.unknown,
        window=None if area.shape is None else area.window,
        calculate=min_usable_altitude,
    )
    frames = morphing_frames(
        *(grid, sources.all, times_s, limit_of(parameters)),
        ceiling_m=ceiling_m,
        ceiling_above_ground=above_ground,
        cache=cache,
    )
    shape = (len(times_s), *known.shape)
    altitude_m, state = np.empty(shape, np.float32), np.empty(shape, np.uint8)
    told: list[FrameFacts] = []
    start = None if parameters.satellites is None else parameters.satellites.time
    known_posts = int(np.count_nonzero(known))
    warnings: dict[str, None] = {}
    firsts: list[tuple[MorphingFrame, MinimumVisibleAltitude]] = []
    started_s, computed = time.perf_counter(), 0

    def kept() -> Iterator[MorphingFrame]:
        nonlocal computed
        for number, frame in enumerate(frames):
            if not firsts:
                firsts.append((frame, cache.surfaces(frame.anchors)))
            altitude_m[number], state[number] = frame.map.altitude_m, frame.map.state
            warnings.update(dict.fromkeys(frame.map.warnings))
            near = sum(isinstance(anchor, Anchor) for anchor in frame.anchors)
            told.append(
                FrameFacts(
                    time_s=frame.time_s,
                    time=None if start is None else time_of(start, frame.time_s).isoformat(),
                    anchors=near,
                    satellites=len(frame.anchors) - near,
                    surfaces_computed=cache.computed - computed,
                    share_flyable=share_of(int(np.count_nonzero(_flyable(frame.map.state) & known)), known_posts),
                )
            )
            computed = cache.computed
            progress((number + 1) / len(times_s))
            yield frame

    height = available_at(parameters, asked)
    available = _bands(availability(kept(), **height))
    share = available[AVAILABLE_BANDS.index("share")][known]
    facts = TimeFacts(
        frames=told,
        available_at=height,
        share_always_available=share_of(int(np.count_nonzero(share == 1.0)), known_posts),
        share_sometimes_available=share_of(int(np.count_nonzero((share > 0.0) & (share < 1.0))), known_posts),
        share_never_available=share_of(int(np.count_nonzero(share == 0.0)), known_posts),
    )
    [(first, first_lines)] = firsts
    # those of the first frame's sight lines are told with them
    own = tuple(warning for warning in warnings if warning not in first_lines.warnings)
    own += sources.passed_over
    elapsed_s = time.perf_counter() - started_s - first_lines.elapsed_s
    return FoundFrames(*(altitude_m, state, available, facts, first, first_lines, own, sources.unhealthy, elapsed_s))


def frame_words(parameters: MorphingMapParameters) -> list[str]:
    """When each frame is, as titles and bands say it: UTC where satellites give the time, else seconds."""
    times_s = [] if parameters.frames is None else parameters.frames.times_s()
    if parameters.satellites is None:
        return [f"{time_s:g} s" for time_s in times_s]
    start = parameters.satellites.time.astimezone(UTC)
    return [f"{time_of(start, time_s):%Y-%m-%d %H:%M:%S} UTC" for time_s in times_s]


def available_at(parameters: MorphingMapParameters, asked: FramesIn) -> dict[str, float]:
    """The height of which availability is told, as the libraries take it."""
    if asked.altitude_m is not None:
        return {"altitude_m": asked.altitude_m}
    above_m = parameters.receiver_above_ground_m if asked.above_ground_m is None else asked.above_ground_m
    return {"above_ground_m": above_m}


def _bands(found: Availability) -> npt.NDArray[np.float64]:
    return np.stack([np.asarray(getattr(found, name), np.float64) for name in AVAILABLE_BANDS])


def _flyable(state: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
    flyable: npt.NDArray[np.bool_] = (state == ColumnState.EVERYWHERE) | (state == ColumnState.ABOVE)
    return flyable
