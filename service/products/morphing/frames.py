"""The morphing map over time as the service gives it: frames, and from when to when each place is available."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC
from typing import Any

import numpy as np
import numpy.typing as npt

from service.parts.frames import FramesIn
from service.parts.map_facts import curvature_of, share_of
from service.parts.moving_sources import moving_sources, time_of
from service.parts.positioning import MorphingMapParameters
from service.parts.ranging_sources import limit_of
from terrain import ElevationGrid
from visibility import (
    Anchor,
    Availability,
    ColumnState,
    MinimumVisibleAltitude,
    MorphingFrame,
    SurfaceCache,
    availability,
    morphing_frames,
)

__all__ = ["AVAILABLE_BANDS", "FoundFrames", "available_at", "find_frames", "frame_words", "frames_summary"]

AVAILABLE_BANDS = ("first_s", "last_s", "longest_from_s", "longest_to_s", "share", "unknown_share")


@dataclass(frozen=True, eq=False)
class FoundFrames:
    """All frames: altitude_m (frames, rows, cols) float32, state the same in uint8, both as in MorphingMap.

    available: (AVAILABLE_BANDS, rows, cols) float64, as in Availability. sources: of each frame, where near anchors
        are, which satellites there are, and how many surfaces were calculated anew, ready for JSON.
    first, first_lines: the first frame and its sight lines.
    """

    altitude_m: npt.NDArray[np.float32]
    state: npt.NDArray[np.uint8]
    available: npt.NDArray[np.float64]
    sources: list[dict[str, Any]]
    first: MorphingFrame
    first_lines: MinimumVisibleAltitude
    warnings: tuple[str, ...]
    unhealthy: tuple[str, ...]
    elapsed_s: float


def find_frames(
    grid: ElevationGrid,
    parameters: MorphingMapParameters,
    asked: FramesIn,
    progress: Callable[[float], None] | None = None,
) -> FoundFrames:
    """All frames that are asked for. Raises AnchorError, FrameError, AlmanacError, VisibilityInputError."""
    sources = moving_sources(grid, parameters, asked)
    times_s = asked.times_s()
    ceiling_m, above_ground = parameters.ceiling()
    cache = SurfaceCache(grid, parameters.mode, curvature_of(parameters), unknown=parameters.unknown)
    frames = morphing_frames(
        *(grid, sources.all, times_s, limit_of(parameters)),
        ceiling_m=ceiling_m,
        ceiling_above_ground=above_ground,
        cache=cache,
    )
    shape = (len(times_s), *grid.shape)
    altitude_m, state = np.empty(shape, np.float32), np.empty(shape, np.uint8)
    told: list[dict[str, Any]] = []
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
            told.append({**_sources(frame), "surfaces_computed": cache.computed - computed})
            computed = cache.computed
            if progress is not None:
                progress((number + 1) / len(times_s))
            yield frame

    found = availability(kept(), **available_at(parameters, asked))
    [(first, first_lines)] = firsts
    # those of the first frame's sight lines are told with them
    own = tuple(warning for warning in warnings if warning not in first_lines.warnings)
    own += sources.passed_over
    elapsed_s = time.perf_counter() - started_s - first_lines.elapsed_s
    return FoundFrames(
        *(altitude_m, state, _bands(found), told, first, first_lines, own, sources.unhealthy, elapsed_s),
    )


def frames_summary(
    asked: FramesIn,
    parameters: MorphingMapParameters,
    sources: list[dict[str, Any]],
    state: npt.NDArray[np.uint8],
    available: npt.NDArray[np.float64],
    known: npt.NDArray[np.bool_],
) -> dict[str, Any]:
    """What frames say in numbers, ready for JSON; known: (rows, cols), where the ground is."""
    start = None if parameters.satellites is None else parameters.satellites.time
    flyable = (state == ColumnState.EVERYWHERE) | (state == ColumnState.ABOVE)
    known_posts = int(np.count_nonzero(known))
    share = available[AVAILABLE_BANDS.index("share")][known]
    return {
        "frames": [
            {
                "time_s": told["time_s"],
                "time": None if start is None else time_of(start, told["time_s"]).isoformat(),
                "anchors": len(told["anchors"]),
                "satellites": len(told["satellites"]),
                "surfaces_computed": told["surfaces_computed"],
                "share_flyable": share_of(int(np.count_nonzero(open_)), known_posts),
            }
            for told, open_ in zip(sources, flyable, strict=True)
        ],
        "available_at": available_at(parameters, asked),
        "share_always_available": share_of(int(np.count_nonzero(share == 1.0)), known_posts),
        "share_sometimes_available": share_of(int(np.count_nonzero((share > 0.0) & (share < 1.0))), known_posts),
        "share_never_available": share_of(int(np.count_nonzero(share == 0.0)), known_posts),
    }


def frame_words(parameters: MorphingMapParameters, sources: Sequence[dict[str, Any]]) -> list[str]:
    """When each frame is, as titles and bands say it: UTC where satellites give the time, else seconds."""
    if parameters.satellites is None:
        return [f"{told['time_s']:g} s" for told in sources]
    start = parameters.satellites.time.astimezone(UTC)
    return [f"{time_of(start, told['time_s']):%Y-%m-%d %H:%M:%S} UTC" for told in sources]


def available_at(parameters: MorphingMapParameters, asked: FramesIn) -> dict[str, float]:
    """The height of which availability is told, as the libraries take it."""
    if asked.altitude_m is not None:
        return {"altitude_m": asked.altitude_m}
    above_m = parameters.receiver_above_ground_m if asked.above_ground_m is None else asked.above_ground_m
    return {"above_ground_m": above_m}


def _bands(found: Availability) -> npt.NDArray[np.float64]:
    return np.stack([np.asarray(getattr(found, name), np.float64) for name in AVAILABLE_BANDS])


def _sources(frame: MorphingFrame) -> dict[str, Any]:
    near = [anchor for anchor in frame.anchors if isinstance(anchor, Anchor)]
    return {
        "time_s": frame.time_s,
        "anchors": [{"id": a.id, "east_m": a.east_m, "north_m": a.north_m, "altitude_m": a.altitude_m} for a in near],
        "satellites": [anchor.id for anchor in frame.anchors if not isinstance(anchor, Anchor)],
    }
