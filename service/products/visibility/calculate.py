"""The visibility map: who is visible at one receiver height over a whole grid, and what to say about it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from service.parts.doubts import doubted_anchors
from service.parts.map_area import MapArea, map_area
from service.parts.map_facts import MapSummary, curvature_of, preamble, share_of
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import anchors_in_grid
from service.products import UNWATCHED, Work
from terrain import ElevationGrid, height_at
from visibility import HIDDEN, UNKNOWN, VISIBLE, Anchor, Curvature, MinimumVisibleAltitude
from visibility.signal import margin_map, min_usable_altitude

from .request import VisibilityMapParameters

__all__ = [
    "AnchorSummary",
    "CountShare",
    "ReceiverHeight",
    "VisibilityMap",
    "VisibilityMapSummary",
    "calculate_visibility_map",
]

# What is left for counting once the sight lines are done.
SHARE_OF_SIGHT_LINES = 0.95


class AnchorSummary(BaseModel):
    """One anchor in the DEM's frame, and what part of the known ground sees it."""

    id: str = Field(description="Name of the anchor.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    above_ground_m: float | None = Field(description="Height above known ground, metres.")
    visible_share: float | None = Field(description="Part of the known posts where it is visible, 0..1.")
    hidden_share: float | None = Field(description="Part of the known posts where it is hidden, 0..1.")
    unknown_share: float | None = Field(description="Part of the known posts where its sight is unknown, 0..1.")


class CountShare(BaseModel):
    """How many posts see exactly so many anchors."""

    visible_anchors: int = Field(description="Number of anchors surely visible.")
    posts: int = Field(description="Known posts with that number.")
    share: float | None = Field(description="The same as part of all known posts, 0..1.")


class ReceiverHeight(BaseModel):
    """Height of the receiver: one of both."""

    above_ground_m: float | None = Field(description="Above the ground of each post, metres.")
    altitude_m: float | None = Field(description="One altitude everywhere, metres.")


class VisibilityMapSummary(MapSummary):
    """What the map says in numbers, and how far to trust it."""

    receiver: ReceiverHeight
    anchors: list[AnchorSummary]
    count_histogram: list[CountShare]
    undecided_posts: int = Field(
        description="Known posts where nobody is surely visible but somebody may be; 0 visible_anchors counts them too."
    )
    posts_with_unknown_anchors: int = Field(description="Posts where the sight of at least one anchor is unknown.")


@dataclass(frozen=True, eq=False)
class VisibilityMap:
    """A finished map.

    visible: (n_anchors, rows, cols) uint8, 1 visible, 0 hidden, 255 unknown, for the receiver height asked for.
    altitude_m: (n_anchors, rows, cols) float32, minimum visible altitude; NaN = unknown, +inf = at no altitude.
    count: (rows, cols) uint8 (uint16 from 255 anchors on), anchors surely visible.
    unknown_count: same shape and type, anchors whose sight is unknown there.
    margin_db: (n_anchors, rows, cols) float32, margin of the signal at the receiver height, where that decides; NaN =
        unknown, -inf = nothing arrives. With it visible, count and altitude_m tell what is usable. None: sight did.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: VisibilityMapParameters
    answer: VisibilityMapSummary
    visible: npt.NDArray[np.uint8]
    altitude_m: npt.NDArray[np.float32]
    count: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
    unknown_count: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
    margin_db: npt.NDArray[np.float32] | None = None

    @property
    def undecided(self) -> npt.NDArray[np.bool_]:
        """(rows, cols): known posts where nobody is surely visible, but somebody may be."""
        return _undecided(self.grid, self.count, self.unknown_count)


@told_as_asked
def calculate_visibility_map(
    grid: ElevationGrid, parameters: VisibilityMapParameters, work: Work = UNWATCHED
) -> VisibilityMap:
    """The map that the parameters ask for on this grid.

    Raises AnchorError, VisibilityInputError, FrameError.
    """
    anchors, passed_over = doubted_anchors(grid, anchors_in_grid(grid, parameters), parameters.doubts)
    found = min_usable_altitude(
        grid,
        anchors,
        parameters.mode,
        curvature_of(parameters),
        unknown=parameters.unknown,
        progress=work.part(0.0, SHARE_OF_SIGHT_LINES),
    )
    area = map_area(grid, parameters.area)
    found, known = area.lines(found), area.known()
    known_posts = int(np.count_nonzero(known))
    visible = found.visible(
        above_ground_m=parameters.receiver_above_ground_m, altitude_m=parameters.receiver_altitude_m
    )
    margin_db, of_signals = None, tuple[str, ...]()
    if parameters.usable:
        margin_db, of_signals = _margins(grid, area, anchors, parameters, found.curvature)
        visible = _usable(found, margin_db, parameters)
    count, unknown_count = _count(visible, VISIBLE), _count(visible, UNKNOWN)
    undecided = _undecided(found.grid, count, unknown_count) & known
    answer = VisibilityMapSummary(
        **preamble(
            *(found.grid, parameters, found),
            (
                *found.warnings,
                *passed_over,
                *area.sentences(),
                *of_signals,
                *_receiver_warnings(found.grid, parameters),
            ),
            mode=parameters.mode,
            unknown=parameters.unknown,
        ),
        timing={"calculation_s": found.elapsed_s},
        receiver=ReceiverHeight(
            above_ground_m=parameters.receiver_above_ground_m, altitude_m=parameters.receiver_altitude_m
        ),
        anchors=[_anchor(grid, anchor, visible[number], known, known_posts) for number, anchor in enumerate(anchors)],
        count_histogram=_count_histogram(count, known, known_posts, len(anchors)),
        undecided_posts=int(np.count_nonzero(undecided)),
        posts_with_unknown_anchors=area.count(unknown_count > 0),
    )
    work.progress(1.0)
    arrays = (visible, found.altitude_m, count, unknown_count, margin_db)
    return VisibilityMap(found.grid, anchors, parameters, answer, *arrays)


def _undecided(
    grid: ElevationGrid, count: npt.NDArray[np.integer[Any]], unknown_count: npt.NDArray[np.integer[Any]]
) -> npt.NDArray[np.bool_]:
    undecided: npt.NDArray[np.bool_] = (count == 0) & (unknown_count > 0)
    return undecided & ~np.isnan(grid.heights_m)


def _margins(
    grid: ElevationGrid,
    area: MapArea,
    anchors: tuple[Anchor, ...],
    parameters: VisibilityMapParameters,
    curvature: Curvature,
) -> tuple[npt.NDArray[np.float32], tuple[str, ...]]:
    """(margins (n_anchors, rows, cols) over the box of the area at the receiver's height, what to know of them)."""
    if parameters.receiver_altitude_m is None:
        receiver_m = grid.heights_m + np.float32(parameters.receiver_above_ground_m or 0.0)
    else:
        receiver_m = np.where(np.isnan(grid.heights_m), np.nan, parameters.receiver_altitude_m).astype(np.float32)
    receiver_m = np.where(area.over_all(), receiver_m, np.float32(np.nan))
    found, notes = [], dict[str, None]()
    for anchor in anchors:
        assert anchor.radio is not None, "the request has seen to it"
        margin_db, told = margin_map(grid, anchor, anchor.radio, receiver_m, curvature, unknown=parameters.unknown)
        found.append(area.cut(margin_db))
        notes |= dict.fromkeys(told)
    return np.stack(found), tuple(notes)


def _usable(
    found: MinimumVisibleAltitude, margin_db: npt.NDArray[np.float32], parameters: VisibilityMapParameters
) -> npt.NDArray[np.uint8]:
    """(n_anchors, rows, cols) 1 usable, 0 not, 255 unknown, within the antennas' limits."""
    usable = np.where(np.isnan(margin_db), UNKNOWN, np.where(margin_db >= 0.0, VISIBLE, HIDDEN))
    within = found.within_limits(
        above_ground_m=parameters.receiver_above_ground_m, altitude_m=parameters.receiver_altitude_m
    )
    return np.where(within, usable, HIDDEN).astype(np.uint8)


def _receiver_warnings(grid: ElevationGrid, parameters: VisibilityMapParameters) -> tuple[str, ...]:
    receiver_altitude_m = parameters.receiver_altitude_m
    if receiver_altitude_m is None:
        return ()
    below = int(np.count_nonzero(grid.heights_m > receiver_altitude_m))
    if below == 0:
        return ()
    known_posts = grid.rows * grid.cols - grid.unknown_posts
    return (
        f"The receiver's altitude of {receiver_altitude_m:g} m is below the ground at {below:,} of {known_posts:,} "
        "known posts; no anchor is in sight there.",
    )


def _count(visible: npt.NDArray[np.uint8], value: np.uint8) -> npt.NDArray[np.uint8] | npt.NDArray[np.uint16]:
    # 255 is kept free to mean "nothing known" in count.tif
    counts = np.zeros(visible.shape[1:], np.uint8 if visible.shape[0] < 255 else np.uint16)
    for of_one_anchor in visible:
        counts += of_one_anchor == value
    return counts


def _anchor(
    grid: ElevationGrid,
    anchor: Anchor,
    visible: npt.NDArray[np.uint8],
    known: npt.NDArray[np.bool_],
    known_posts: int,
) -> AnchorSummary:
    over_known = visible[known]
    seen, unknown = int(np.count_nonzero(over_known == VISIBLE)), int(np.count_nonzero(over_known == UNKNOWN))
    ground_m = float(height_at(grid, anchor.east_m, anchor.north_m))
    return AnchorSummary(
        id=anchor.id,
        east_m=anchor.east_m,
        north_m=anchor.north_m,
        altitude_m=anchor.altitude_m,
        above_ground_m=None if math.isnan(ground_m) else anchor.altitude_m - ground_m,
        visible_share=share_of(seen, known_posts),
        hidden_share=share_of(known_posts - seen - unknown, known_posts),
        unknown_share=share_of(unknown, known_posts),
    )


def _count_histogram(
    count: npt.NDArray[Any], known: npt.NDArray[np.bool_], known_posts: int, n_anchors: int
) -> list[CountShare]:
    posts = np.bincount(count[known], minlength=n_anchors + 1)
    return [
        CountShare(visible_anchors=number, posts=int(posts[number]), share=share_of(int(posts[number]), known_posts))
        for number in range(n_anchors + 1)
    ]
