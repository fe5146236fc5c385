"""The DOP map: how good positioning is at one antenna height over a whole grid, and where it is not good enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydantic import Field

from service.parts.map_area import map_area, refuse_outside
from service.parts.map_facts import curvature_of, share_of
from service.parts.positioning_answers import PositioningSummary, positioning_summary, range_sigmas_told
from service.parts.ranging_sources import RangingSources, Source, check_sources, lines_to, ranging_sources
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import points_in_grid
from service.products import UNWATCHED, Work
from service.products.in_common import QUANTILES
from terrain import ElevationGrid
from visibility import (
    Curvature,
    MinimumVisibleAltitude,
    VisibilityInputError,
    dop_along,
    dop_map,
    position_error_map,
    visible_sets,
)
from visibility.dilution import GO, NO_GO, DopReason, least_anchors, position_error_along
from visibility.dilution.position_errors import check_weights
from visibility.sight import check_anchors

from .request import DopMapParameters
from .volumes import VolumeFacts, asks_for_air, check_air, volume_facts

__all__ = ["PATH_COLUMNS", "DopMapSummary", "FinishedDopMap", "calculate_dop_map", "check_dop_map", "path_points"]

SHARE_OF_SIGHT_LINES = 0.8
PATH_COLUMNS = (
    *("east_m", "north_m", "altitude_m", "anchors_in_sight", "unknown"),
    *("gdop", "pdop", "hdop", "vdop", "tdop", "reason"),
    *("horizontal_sigma_m", "vertical_sigma_m", "position_sigma_m"),
)
Floats = npt.NDArray[np.float32]


class DopMapSummary(PositioningSummary):
    """What a DOP map says in numbers, and how far to trust it."""

    receiver_above_ground_m: float = Field(description="Height of the antenna above ground, metres.")
    on_surface: bool = Field(description="Whether only motion along the surface is unknown.")
    share_within_limit: float | None = Field(description="Part of the known posts within the limit, 0..1.")
    share_no_go: float | None = Field(description="Part of the known posts beyond it or with too few anchors, 0..1.")
    share_unknown: float | None = Field(description="Part of the known posts where that is unknown, 0..1.")
    dop_quantiles: dict[str, float | None] = Field(
        description="p05, p50 and p95 of the dilution over the posts where it is known, no unit; null is no fix."
    )
    one_dop_per_set: bool = Field(False, description="Whether all posts of a visible set share one dilution.")
    position_error_quantiles_m: dict[str, dict[str, float | None]] = Field(
        {}, description="p05, p50 and p95 of the horizontal, vertical and position error, one sigma, metres."
    )
    sigmas: str = Field(
        "", description="One-sigma errors of ranges, and of anchors' places, that these errors stand on, in words."
    )
    path_points: int = Field(0, description="Number of points along the path.")
    volume: VolumeFacts | None = Field(None, description="The control volume, where one was asked for.")
    posts_by_reason: dict[str, int] = Field(
        description="Known posts with a fix (ok), too_few anchors, a singular geometry, or unknown sight."
    )


@dataclass(frozen=True, eq=False)
class FinishedDopMap:
    """A finished DOP map; arrays (rows, cols).

    dop: float32, +inf = no fix, NaN = unknown. reasons: uint8, DopReason. count: uint16, anchors surely in sight.
    no_go: uint8, 1 where positioning is not good enough, 0 where it is, 255 where that is unknown.
    sigmas_m: (3, rows, cols) float32, position error horizontally, vertically and in space, one sigma, metres.
    path_numbers, path_sets: along the trajectory, (n, PATH_COLUMNS) float64, and visible sets (n, words) uint64.
    min_altitude_m, hidden_below_m: (anchors, rows, cols) as in MinimumVisibleAltitude, kept where a volume or cuts are
        asked for, else empty; the second is empty also where it is the first.
    """

    grid: ElevationGrid
    anchors: tuple[Source, ...]
    parameters: DopMapParameters
    answer: DopMapSummary
    dop: Floats
    reasons: npt.NDArray[np.uint8]
    count: npt.NDArray[np.uint16]
    no_go: npt.NDArray[np.uint8]
    sigmas_m: Floats
    path_numbers: npt.NDArray[np.float64]
    path_sets: npt.NDArray[np.uint64]
    min_altitude_m: Floats
    hidden_below_m: Floats

    def surfaces(self) -> MinimumVisibleAltitude:
        """The minimum visible altitudes again, where they were kept."""
        # copies, because kernels are compiled for arrays that may be written to
        altitude_m = np.array(self.min_altitude_m)
        curvature = curvature_of(self.parameters)
        return MinimumVisibleAltitude(
            grid=self.grid,
            anchors=self.anchors,
            altitude_m=altitude_m,
            hidden_below_m=np.array(self.hidden_below_m) if self.hidden_below_m.size else altitude_m,
            mode=self.parameters.mode,
            unknown=self.parameters.unknown,
            curvature=Curvature.of(self.grid) if curvature is None else curvature,
            warnings=tuple(self.answer.warnings),
            elapsed_s=self.answer.timing["calculation_s"],
            version=self.answer.version,
            of_signals=self.parameters.usable,
        )


def check_dop_map(grid: ElevationGrid, parameters: DopMapParameters) -> RangingSources:
    """What there is to range to; refuses what no map can be made from.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError.
    """
    map_area(grid, parameters.area)
    sources = ranging_sources(grid, parameters)
    check_anchors(grid, sources.all)
    check_weights(sources.all)
    if not parameters.on_surface:
        check_sources(grid, sources.all, parameters)
        return sources
    # a rover bound to the ground is fixed by anchors on one line too
    given = len(sources.all)
    needed = max(least_anchors(parameters.kind, on_surface=True), parameters.min_anchors or 0)
    if given < needed:
        raise VisibilityInputError(
            f"A map of {parameters.measure} along the surface from {parameters.kind} needs at least {needed} "
            f"anchors; {given} {'is' if given == 1 else 'are'} given."
        )
    return sources


@told_as_asked
def calculate_dop_map(grid: ElevationGrid, parameters: DopMapParameters, work: Work = UNWATCHED) -> FinishedDopMap:
    """The map that the parameters ask for on this grid.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError.
    """
    check_air(map_area(grid, parameters.area).box, parameters)
    sources = check_dop_map(grid, parameters)
    lines = lines_to(*(grid, sources.all, parameters), work.part(0.0, SHARE_OF_SIGHT_LINES))
    kind, above_m, on_surface = parameters.kind, parameters.receiver_above_ground_m, parameters.on_surface
    found = dop_map(
        *(lines, above_m, kind),
        measure=parameters.measure,
        on_surface=on_surface,
        per_visible_set=parameters.one_dop_per_set,
    )
    errors = position_error_map(lines, above_m, kind, on_surface=on_surface)
    no_go = found.no_go(parameters.dop_limit, parameters.min_anchors or 0)
    sigmas_m = np.stack([errors.horizontal_sigma_m, errors.vertical_sigma_m, errors.position_sigma_m])
    path_numbers, path_sets = _along_path(lines, parameters)
    area = map_area(grid, parameters.area)
    lines, known, no_go = area.lines(lines), area.known(), area.cut(no_go)
    dilutions, reasons, sigmas_m = area.cut(found.dop), area.cut(found.reasons), area.cut(sigmas_m)
    known_posts = int(np.count_nonzero(known))
    go_posts, no_go_posts = (int(np.count_nonzero(no_go[known] == value)) for value in (GO, NO_GO))
    answer = DopMapSummary(
        **dict(positioning_summary(lines, sources, parameters, found.elapsed_s + errors.elapsed_s, area.sentences())),
        receiver_above_ground_m=above_m,
        on_surface=on_surface,
        share_within_limit=share_of(go_posts, known_posts),
        share_no_go=share_of(no_go_posts, known_posts),
        share_unknown=share_of(known_posts - go_posts - no_go_posts, known_posts),
        dop_quantiles=_quantiles(dilutions[known]),
        one_dop_per_set=parameters.one_dop_per_set,
        position_error_quantiles_m={
            name: _quantiles(sigma_m[known])
            for name, sigma_m in zip(("horizontal", "vertical", "position"), sigmas_m, strict=True)
        },
        sigmas=range_sigmas_told(lines.anchors),
        path_points=len(path_numbers),
        volume=volume_facts(lines.grid, parameters),
        posts_by_reason={reason.name.lower(): int(np.count_nonzero(reasons[known] == reason)) for reason in DopReason},
    )
    work.progress(1.0)
    return FinishedDopMap(
        *(lines.grid, lines.anchors, parameters, answer, dilutions, reasons, area.cut(found.count), no_go, sigmas_m),
        *(path_numbers, path_sets),
        *_kept(lines, asks_for_air(parameters)),
    )


def path_points(grid: ElevationGrid, parameters: DopMapParameters) -> npt.NDArray[np.float64]:
    """(n, 3) points of the trajectory asked for. Raises AreaError, FrameError, VisibilityInputError."""
    if not parameters.path:
        return np.empty((0, 3))
    points_m = points_in_grid(grid, parameters.path, "path[{}]")
    refuse_outside(grid, parameters.area, points_m, "path[{}]")
    return points_m


def _along_path(
    lines: MinimumVisibleAltitude, parameters: DopMapParameters
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint64]]:
    """Dilutions and errors at each point of the trajectory, and visible sets. Raises what path_points raises."""
    points_m = path_points(lines.grid, parameters)
    sets = visible_sets(lines, points_m)
    dilutions = dop_along(lines, points_m, parameters.kind, on_surface=parameters.on_surface)
    errors = position_error_along(lines, points_m, parameters.kind, on_surface=parameters.on_surface)
    numbers = np.column_stack(
        [
            *points_m.T,
            *(sets.count, sets.unknown),
            *(dilutions.gdop, dilutions.pdop, dilutions.hdop, dilutions.vdop, dilutions.tdop, dilutions.reason),
            *(errors.horizontal_sigma_m, errors.vertical_sigma_m, errors.position_sigma_m),
        ]
    )
    return numbers, sets.mask


def _kept(lines: MinimumVisibleAltitude, keep: bool) -> tuple[Floats, Floats]:
    nothing = np.empty((0, 0, 0), np.float32)
    same = lines.hidden_below_m is lines.altitude_m
    return (lines.altitude_m, nothing if same else lines.hidden_below_m) if keep else (nothing, nothing)


def _quantiles(dop: Floats) -> dict[str, float | None]:
    """Over the posts of which the dilution is known; None where no number is: no fix is worse than any number."""
    decided = dop[~np.isnan(dop)]
    if decided.size == 0:
        return dict.fromkeys(QUANTILES)
    # of a method that takes a post's own value, since nothing lies between a number and no fix
    values = np.quantile(decided, list(QUANTILES.values()), method="inverted_cdf")
    return {name: float(value) if np.isfinite(value) else None for name, value in zip(QUANTILES, values, strict=True)}
