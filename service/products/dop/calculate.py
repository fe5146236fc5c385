"""The DOP map: how good positioning is at one antenna height over a whole grid, and where it is not good enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from service.parts.asked_frame import told_as_asked
from service.parts.map_facts import Calculation, curvature_of, share_of
from service.parts.positioning import DopMapParameters
from service.parts.ranging_sources import calculation_of, common_summary, sight_lines
from service.products.dop.paths import along_path
from service.products.dop.volumes import air_summary, asks_for_air, check_air
from terrain import ElevationGrid
from visibility import (
    GO,
    NO_GO,
    Anchor,
    Curvature,
    DistantAnchor,
    DopReason,
    MinimumVisibleAltitude,
    dop_map,
    position_error_map,
)

__all__ = ["FinishedDopMap", "calculate_dop_map"]

SHARE_OF_SIGHT_LINES = 0.8
QUANTILES = {"p05": 0.05, "p50": 0.5, "p95": 0.95}


@dataclass(frozen=True, eq=False)
class FinishedDopMap:
    """A finished DOP map; arrays (rows, cols).

    dop: float32, +inf = no fix, NaN = unknown. reasons: uint8, DopReason. count: uint16, anchors surely in sight.
    no_go: uint8, 1 where positioning is not good enough, 0 where it is, 255 where that is unknown.
    sigmas_m: (3, rows, cols) float32, position error horizontally, vertically and in space, one sigma, metres.
    path_numbers, path_sets: along the trajectory, see PathFindings.
    min_altitude_m, hidden_below_m: (anchors, rows, cols) as in MinimumVisibleAltitude, kept where a volume or cuts are
        asked for, else empty; the second is empty also where it is the first.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: DopMapParameters
    calculation: Calculation
    dop: npt.NDArray[np.float32]
    reasons: npt.NDArray[np.uint8]
    count: npt.NDArray[np.uint16]
    no_go: npt.NDArray[np.uint8]
    sigmas_m: npt.NDArray[np.float32]
    path_numbers: npt.NDArray[np.float64]
    path_sets: npt.NDArray[np.uint64]
    min_altitude_m: npt.NDArray[np.float32]
    hidden_below_m: npt.NDArray[np.float32]

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
            warnings=self.calculation.warnings,
            elapsed_s=self.calculation.elapsed_s,
            version=self.calculation.version,
        )

    def summary(self) -> dict[str, Any]:
        """What dop.json says: plain values, ready for JSON, every number with its unit in its name."""
        known = ~np.isnan(self.grid.heights_m)
        known_posts = int(np.count_nonzero(known))
        no_go, reasons = self.no_go[known], self.reasons[known]
        go_posts, no_go_posts = int(np.count_nonzero(no_go == GO)), int(np.count_nonzero(no_go == NO_GO))
        parameters = self.parameters
        return {
            **common_summary(self.grid, self.anchors, self.parameters, self.calculation),
            "receiver_above_ground_m": parameters.receiver_above_ground_m,
            "on_surface": parameters.on_surface,
            "one_dop_per_set": parameters.one_dop_per_set,
            "share_within_limit": share_of(go_posts, known_posts),
            "share_no_go": share_of(no_go_posts, known_posts),
            "share_unknown": share_of(known_posts - go_posts - no_go_posts, known_posts),
            "dop_quantiles": _quantiles(self.dop[known]),
            "position_error_quantiles_m": {
                name: _quantiles(sigma_m[known])
                for name, sigma_m in zip(("horizontal", "vertical", "position"), self.sigmas_m, strict=True)
            },
            "path_points": len(self.path_numbers),
            "volume": air_summary(self.grid, parameters),
            "posts_by_reason": {reason.name.lower(): int(np.count_nonzero(reasons == reason)) for reason in DopReason},
        }


@told_as_asked
def calculate_dop_map(
    grid: ElevationGrid, parameters: DopMapParameters, progress: Callable[[float], None] | None = None
) -> FinishedDopMap:
    """The map that the parameters ask for on this grid; progress is called with the finished share 0..1.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError.
    """
    check_air(grid, parameters)
    lines, sources = sight_lines(grid, parameters, progress, SHARE_OF_SIGHT_LINES)
    kind, above_m, on_surface = parameters.kind, parameters.receiver_above_ground_m, parameters.on_surface
    found = dop_map(
        *(lines, above_m, kind),
        measure=parameters.measure,
        on_surface=on_surface,
        per_visible_set=parameters.one_dop_per_set,
    )
    errors = position_error_map(lines, above_m, kind, on_surface=on_surface)
    path = along_path(lines, parameters)
    if progress is not None:
        progress(1.0)
    return FinishedDopMap(
        grid,
        lines.anchors,
        parameters,
        calculation_of(grid, lines, sources, found.elapsed_s + errors.elapsed_s),
        found.dop,
        found.reasons,
        found.count,
        found.no_go(parameters.dop_limit, parameters.min_anchors or 0),
        np.stack([errors.horizontal_sigma_m, errors.vertical_sigma_m, errors.position_sigma_m]),
        path.numbers,
        path.sets,
        *_kept(lines, asks_for_air(parameters)),
    )


def _kept(lines: MinimumVisibleAltitude, keep: bool) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    nothing = np.empty((0, 0, 0), np.float32)
    same = lines.hidden_below_m is lines.altitude_m
    return (lines.altitude_m, nothing if same else lines.hidden_below_m) if keep else (nothing, nothing)


def _quantiles(dop: npt.NDArray[np.float32]) -> dict[str, float | None]:
    """Over the posts of which the dilution is known; None where no number is: no fix is worse than any number."""
    decided = dop[~np.isnan(dop)]
    if decided.size == 0:
        return dict.fromkeys(QUANTILES)
    # of a method that takes a post's own value, since nothing lies between a number and no fix
    values = np.quantile(decided, list(QUANTILES.values()), method="inverted_cdf")
    return {name: float(value) if np.isfinite(value) else None for name, value in zip(QUANTILES, values, strict=True)}
