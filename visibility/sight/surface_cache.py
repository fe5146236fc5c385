"""Minimum-visible-altitude surfaces kept per anchor, so that an anchor that moved recomputes only itself."""

from __future__ import annotations

import time

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from terrain.version import VERSION
from visibility.sight.anchors import Anchor, check_anchors
from visibility.sight.curvature import Curvature
from visibility.sight.distant import DistantAnchor
from visibility.sight.minimum_altitude import MinimumVisibleAltitude, Mode, UnknownGround, min_visible_altitude

__all__ = ["SurfaceCache"]

Pair = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]


class SurfaceCache:
    """Answers ``min_visible_altitude`` for one grid, and remembers each anchor's surface until it is not asked for.

    computed, reused: how many anchors' surfaces were calculated and how many remembered, since the cache was made.
    """

    def __init__(
        self,
        grid: ElevationGrid,
        mode: Mode = "fast",
        curvature: Curvature | None = None,
        *,
        unknown: UnknownGround = "unknown",
    ) -> None:
        self.grid = grid
        self.mode: Mode = mode
        self.curvature = Curvature.over(grid, curvature)
        self.unknown: UnknownGround = unknown
        self.computed = 0
        self.reused = 0
        self._surfaces: dict[Anchor | DistantAnchor, Pair] = {}

    def surfaces(self, anchors: tuple[Anchor | DistantAnchor, ...]) -> MinimumVisibleAltitude:
        """As ``min_visible_altitude`` of these anchors; forgets those of the last answer that are not among them.

        Unlike there, none at all are an answer too: there may be times without any.

        Raises AnchorError, VisibilityInputError.
        """
        started_s = time.perf_counter()
        warnings = check_anchors(self.grid, anchors) if anchors else ()
        missing = tuple(anchor for anchor in anchors if anchor not in self._surfaces)
        kept = {anchor: self._surfaces[anchor] for anchor in anchors if anchor in self._surfaces}
        if missing:
            found = min_visible_altitude(self.grid, missing, self.mode, self.curvature, unknown=self.unknown)
            for number, anchor in enumerate(missing):
                kept[anchor] = (found.altitude_m[number], found.hidden_below_m[number])
        self.computed += len(missing)
        self.reused += len(anchors) - len(missing)
        self._surfaces = kept
        nothing = np.empty((0, *self.grid.shape), np.float32)
        altitude_m = np.stack([kept[anchor][0] for anchor in anchors]) if anchors else nothing
        same = all(kept[anchor][0] is kept[anchor][1] for anchor in anchors) or not self.grid.unknown_posts
        hidden_below_m = altitude_m if same else np.stack([kept[anchor][1] for anchor in anchors])
        return MinimumVisibleAltitude(
            grid=self.grid,
            anchors=anchors,
            altitude_m=altitude_m,
            hidden_below_m=hidden_below_m,
            mode=self.mode,
            unknown=self.unknown,
            curvature=self.curvature,
            warnings=warnings,
            elapsed_s=time.perf_counter() - started_s,
            version=VERSION,
        )
