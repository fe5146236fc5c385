"""Protection levels over a DEM and along a path, as the service answers them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from planning.bubbles import way_m
from planning.driving import ForetoldProtection, protection_over_map
from planning.watching import GroundErrors
from service.parts.cover import notes_on_cover
from service.parts.map_area import map_area
from service.parts.map_facts import MapSummary, curvature_of, preamble
from service.parts.positioning_answers import PlacedAnchor, placed_anchors, range_sigmas_told
from service.parts.sentences import told_as_asked
from service.products import UNWATCHED, Work
from service.products.in_common import QUANTILES
from terrain import ElevationGrid
from visibility import Anchor, Curvature
from visibility.sight.sight_lines import ERROR_STATEMENT

from .request import ProtectionParameters, anchors_of, path_of

__all__ = ["PATH_COLUMNS", "FinishedProtection", "ProtectionSummary", "calculate_protection", "spaced"]

Array = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]
PATH_COLUMNS = (
    *("distance_m", "east_m", "north_m", "altitude_m"),
    *("horizontal_m", "vertical_m", "unwatched", "anchors_expected"),
)


class PathProtection(BaseModel):
    """What is promised along the path."""

    points: int = Field(description="Number of points.")
    promised: int = Field(description="Number of points where anything is promised.")
    within_alert: int = Field(description="Number of points where both levels are within their alert limits.")
    first_beyond: int | None = Field(
        description="Number of the first point that is not, 0 the first; null where all are."
    )
    horizontal_most_m: float | None = Field(description="Largest horizontal level, metres; null: none or unlimited.")
    vertical_most_m: float | None = Field(description="Largest vertical level, metres; null: none or unlimited.")


class ProtectionSummary(MapSummary):
    """Protection levels in numbers."""

    promised_share: float | None = Field(description="Part of the known posts where anything is promised, 0..1.")
    within_alert_share: float | None = Field(
        description="Part of the known posts where both levels are within their alert limits, 0..1."
    )
    horizontal_quantiles_m: dict[str, float | None] = Field(
        description="p05, p50, p95 of the horizontal level where anything is promised, metres."
    )
    vertical_quantiles_m: dict[str, float | None] = Field(description="The same of the vertical level, metres.")
    sigmas: str = Field(description="One-sigma errors of ranges, in words.")
    path: PathProtection | None = Field(description="Along the path; null without one.")
    anchors: list[PlacedAnchor]


@dataclass(frozen=True, eq=False)
class FinishedProtection:
    """Finished levels: over the posts of the grid float32 (rows, cols), inf where nothing is promised, NaN where no
    ground is known; path_numbers (n, PATH_COLUMNS)."""

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: ProtectionParameters
    answer: ProtectionSummary
    horizontal: Floats
    vertical: Floats
    unwatched: Floats
    path_numbers: Array


@dataclass(frozen=True, slots=True)
class _Lines:
    """How sight lines were calculated."""

    error_statement: str
    curvature: Curvature


def spaced(grid: ElevationGrid, spacing_m: float | None) -> ElevationGrid:
    """Every so-manieth post of a grid, so that they are about spacing_m apart; None: all."""
    if spacing_m is None:
        return grid
    rows, cols = (max(round(spacing_m / cell_m), 1) for cell_m in (grid.cell_north_m, grid.cell_east_m))
    heights_m = np.ascontiguousarray(grid.heights_m[::rows, ::cols])
    return replace(
        grid, heights_m=heights_m, cell_east_m=cols * grid.cell_east_m, cell_north_m=rows * grid.cell_north_m
    )


@told_as_asked
def calculate_protection(
    grid: ElevationGrid, parameters: ProtectionParameters, work: Work = UNWATCHED
) -> FinishedProtection:
    """The levels that are asked for. Raises what ``check_protection`` raises."""
    started_s = time.perf_counter()
    area = map_area(grid, parameters.area)
    anchors, path_m = anchors_of(grid, parameters), path_of(grid, parameters)
    box = spaced(area.box, parameters.spacing_m)
    inside = np.isin(_posts(box), _posts(area.box)[area.known()]) if parameters.area is not None else None
    heights_m = box.heights_m.astype(np.float64) + parameters.receiver_above_ground_m
    if inside is not None:
        heights_m[~inside] = math.nan
    east_m = box.origin_east_m + np.arange(box.cols) * box.cell_east_m
    north_m = box.origin_north_m - np.arange(box.rows) * box.cell_north_m
    posts_m = np.stack([*np.meshgrid(east_m, north_m), heights_m], axis=-1).reshape(-1, 3)
    share = len(posts_m) / (len(posts_m) + len(path_m))
    over, along = (
        protection_over_map(
            grid,
            points_m,
            anchors,
            risk=parameters.risk(),
            fault=parameters.fault,
            least_sight=parameters.least_sight,
            height_sigma_m=parameters.height_m,
            clock=parameters.kind == "pseudorange",
            errors=GroundErrors(parameters.dem_sigma_m),
            curvature=curvature_of(parameters),
            progress=work.part(*part),
        )
        for points_m, part in ((posts_m, (0.0, share)), (path_m, (share, 1.0)))
    )
    horizontal, vertical, unwatched = (
        values.reshape(box.shape).astype(np.float32) for values in (over.horizontal_m, over.vertical_m, over.unwatched)
    )
    known = ~np.isnan(horizontal)
    within = (horizontal <= parameters.horizontal_alert_m) & (vertical <= parameters.vertical_alert_m)
    numbers = _along(path_m, along, parameters.least_sight)
    warnings = (*notes_on_cover(grid), *area.sentences(), *_unknown(over.sight[known.ravel()], along.sight))
    answer = ProtectionSummary(
        **preamble(box, parameters, _Lines(ERROR_STATEMENT, over.curvature), warnings, mode="exact", unknown="blocked"),
        timing={"calculation_s": time.perf_counter() - started_s},
        promised_share=float(np.isfinite(horizontal[known]).mean()) if known.any() else None,
        within_alert_share=float(within[known].mean()) if known.any() else None,
        horizontal_quantiles_m=_quantiles(horizontal),
        vertical_quantiles_m=_quantiles(vertical),
        sigmas=range_sigmas_told(anchors),
        path=_path(numbers, parameters) if len(path_m) else None,
        anchors=placed_anchors(grid, anchors),
    )
    work.progress(1.0)
    return FinishedProtection(box, anchors, parameters, answer, horizontal, vertical, unwatched, numbers)


def _posts(grid: ElevationGrid) -> npt.NDArray[np.complex128]:
    """(rows, cols) where posts are, as one number each."""
    east_m = grid.origin_east_m + np.arange(grid.cols) * grid.cell_east_m
    north_m = grid.origin_north_m - np.arange(grid.rows) * grid.cell_north_m
    posts: npt.NDArray[np.complex128] = np.round(east_m, 3)[None, :] + 1j * np.round(north_m, 3)[:, None]
    return posts


def _along(path_m: Array, found: ForetoldProtection, least_sight: float) -> Array:
    if not len(path_m):
        return np.empty((0, len(PATH_COLUMNS)))
    expected = (np.nan_to_num(found.sight) >= least_sight).sum(axis=1)
    return np.column_stack(
        [way_m(path_m), path_m, found.horizontal_m, found.vertical_m, found.unwatched, expected.astype(np.float64)]
    )


def _path(numbers: Array, parameters: ProtectionParameters) -> PathProtection:
    horizontal, vertical = (numbers[:, PATH_COLUMNS.index(name)] for name in ("horizontal_m", "vertical_m"))
    within = (horizontal <= parameters.horizontal_alert_m) & (vertical <= parameters.vertical_alert_m)
    return PathProtection(
        points=len(numbers),
        promised=int(np.isfinite(horizontal).sum()),
        within_alert=int(within.sum()),
        first_beyond=None if within.all() else int(np.argmin(within)),
        horizontal_most_m=_finite(float(horizontal.max())),
        vertical_most_m=_finite(float(vertical.max())),
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _quantiles(levels: Floats) -> dict[str, float | None]:
    promised = levels[np.isfinite(levels)]
    return {name: float(np.quantile(promised, part)) if promised.size else None for name, part in QUANTILES.items()}


def _unknown(*sights: Array) -> tuple[str, ...]:
    points = sum(int(np.isnan(sight).any(axis=1).sum()) for sight in sights)
    if not points:
        return ()
    return (f"From {points} points unknown ground lies before some anchor, which counts as hidden there.",)
