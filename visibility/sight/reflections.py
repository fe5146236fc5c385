"""How late a hidden anchor's signal comes that the ground reflects once: the error of a range without line of sight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.dilution.ground_normals import post_normals
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import Anchor, DistantAnchor
from visibility.sight.kernels.reflections import shortest_reflections
from visibility.sight.minimum_altitude import VISIBLE, MinimumVisibleAltitude, min_visible_altitude

__all__ = ["Reflections", "reflections"]

# a post counts as in sight where a point so little above it is: on the ground itself rounding decides
ABOVE_POST_M = 1.0


@dataclass(frozen=True, eq=False)
class Reflections:
    """The shortest single reflection between n receivers and k anchors.

    excess_m: (n, k) how much longer than the straight line, metres. point_m: (n, k, 3) where. NaN where no ground in
        sight of both is turned the right way, or the pair was not asked for.
    """

    excess_m: npt.NDArray[np.float64]
    point_m: npt.NDArray[np.float64]


def reflections(
    surfaces: MinimumVisibleAltitude,
    receivers_m: npt.ArrayLike,
    asked: npt.ArrayLike | None = None,
    *,
    roughness_rad: float = math.radians(45.0),
    reach_m: float = math.inf,
) -> Reflections:
    """Single reflections from posts of the ground, as De Vivo et al. (IV-B) simulate signals of hidden satellites.

    A post reflects where both ends are in sight of it, and where its normal lies within roughness_rad of the one that
    a mirror there would need (rock and forest scatter widely), no farther than reach_m from the receiver; of those the
    shortest way is taken, since a receiver holds on to what comes first.
    surfaces: of the anchors, which need no ground between them and the receivers. receivers_m: (n, 3) east, north,
    altitude. asked: (n, k) bool, pairs to work out (those out of sight, mostly); None: all.
    Raises VisibilityInputError, and AnchorError for receivers below the ground.
    """
    receivers = np.array(receivers_m, np.float64, ndmin=2)
    count = len(surfaces.anchors)
    if receivers.shape[1:] != (3,) or not np.isfinite(receivers).all():
        raise VisibilityInputError("receivers_m must hold finite east, north and altitude of each receiver.")
    if not 0.0 < roughness_rad < math.pi / 2.0:
        raise VisibilityInputError(f"roughness_rad must lie between 0 and a right angle, not be {roughness_rad}.")
    if not reach_m > 0.0:
        raise VisibilityInputError(f"reach_m must be above zero, not {reach_m}.")
    wanted = np.ones((len(receivers), count), bool) if asked is None else np.asarray(asked, bool)
    if wanted.shape != (len(receivers), count):
        raise VisibilityInputError(
            f"asked must tell of each of {len(receivers)} receivers and {count} anchors, not {wanted.shape}."
        )
    grid = surfaces.grid
    lit = surfaces.visible(above_ground_m=ABOVE_POST_M) == VISIBLE
    normals = post_normals(grid, 0, grid.rows)
    east_m = grid.origin_east_m + grid.cell_east_m * np.arange(grid.cols)
    north_m = grid.origin_north_m - grid.cell_north_m * np.arange(grid.rows)
    across_m = np.stack(np.meshgrid(east_m, north_m), axis=-1).reshape(-1, 2)
    places_m = np.column_stack([across_m, grid.heights_m.ravel()])
    anchors_m = np.array([_position_m(surfaces, anchor) for anchor in surfaces.anchors])
    excess_m, point_m = np.full(wanted.shape, np.nan), np.full((*wanted.shape, 3), np.nan)
    for number, receiver_m in enumerate(receivers):
        which = np.flatnonzero(wanted[number])
        if not len(which):
            continue
        eye = Anchor("receiver", *receiver_m.tolist())
        seen = min_visible_altitude(grid, [eye], curvature=surfaces.curvature).visible(above_ground_m=ABOVE_POST_M)[0]
        # a post that its neighbours leave without a normal reflects nothing
        here = np.flatnonzero((seen.ravel() == VISIBLE) & ~np.isnan(normals[:, 0]))
        here = here[np.linalg.norm(places_m[here] - receiver_m, axis=1) <= reach_m]
        shortest_m, post = np.empty(len(which)), np.empty(len(which), np.int64)
        bright = np.ascontiguousarray(lit.reshape(count, -1)[which][:, here])
        cosine = math.cos(roughness_rad)
        shortest_reflections(
            places_m[here], normals[here], bright, receiver_m, anchors_m[which], cosine, shortest_m, post
        )
        excess_m[number, which] = shortest_m
        found = post >= 0
        point_m[number, which[found]] = places_m[here[post[found]]]
    return Reflections(excess_m, point_m)


def _position_m(surfaces: MinimumVisibleAltitude, anchor: Anchor | DistantAnchor) -> tuple[float, float, float]:
    if isinstance(anchor, DistantAnchor):
        return anchor.position_m(surfaces.grid)
    return anchor.east_m, anchor.north_m, anchor.altitude_m
