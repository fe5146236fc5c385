"""Whether the rover may be anywhere in a triangle of the ground, everywhere in it, or that is in doubt.

What is everywhere allowed makes paths, what is nowhere allowed makes proofs; a triangle in doubt is split and its parts
are judged again. Slopes need no splitting: a triangle is a plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy
import shapely

from planning.questions.problems import PathProblem
from terrain import ElevationGrid, height_at
from visibility.air import MorphingMap

from .checks import breaks
from .fields import CostField, bit_of
from .leaves import SPLIT, Leaves
from .outcomes import Reason
from .places import OUTWARD, QUARTER, metres_of, outside_of, squares_touched
from .sight_maps import SightMaps

__all__ = ["CLEAR", "CLOSED", "DOUBT", "FINAL", "SLIVER", "Judge", "slopes_of"]

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.uint8]

# nowhere allowed; somewhere, perhaps, and too small to be split; in doubt; in doubt, and splitting does not help;
# everywhere allowed
CLOSED, SLIVER, DOUBT, FINAL, CLEAR = range(5)
# so often a triangle in doubt is split: for what has a shape, and for what sight lines from its corners say
MOST_LEVELS, SIGHT_LEVELS = 5, 2
# places on the rim of the footprint at which the ground under it is looked at, as the validator does
RIM = 24
BY_SIGHT = (Reason.ANCHORS, Reason.DOP)
TRIED = (Reason.SIGHT_LINE, Reason.BUBBLE)
# so many places on rims at once
AT_ONCE = 1_000_000


def slopes_of(grid: ElevationGrid) -> tuple[Floats, Floats]:
    """(east, north), each (rows - 1, cols - 1, 2), rise per metre of the triangles west and east of each diagonal."""
    heights_m = grid.heights_m.astype(np.float64)
    north_west, north_east = heights_m[:-1, :-1], heights_m[:-1, 1:]
    south_west, south_east = heights_m[1:, :-1], heights_m[1:, 1:]
    east = np.stack([south_east - south_west, north_east - north_west], axis=-1) / grid.cell_east_m
    north = np.stack([north_west - south_west, north_east - south_east], axis=-1) / grid.cell_north_m
    return east, north


@dataclass(frozen=True, eq=False)
class _Zone:
    """What an area takes from the rover's middle, as shapes that surely hold all of it and surely nothing else."""

    reason: Reason
    outer: shapely.Geometry
    inner: shapely.Geometry


@dataclass(frozen=True, eq=False)
class Judge:
    """A question, its field, and maps to ask for exact sight lines."""

    problem: PathProblem
    field: CostField
    maps: SightMaps | None

    @cached_property
    def _gradients(self) -> tuple[Floats, Floats]:
        return slopes_of(self.field.grid)

    @cached_property
    def _ground(self) -> tuple[Mask, Mask]:
        """(rows - 1, cols - 1, 2) whether a triangle may be driven in some direction, and in every direction."""
        rover, slope = self.problem.rover, np.hypot(*self._gradients)
        pitch, roll = (
            math.inf if angle >= math.pi / 2 else math.tan(angle) for angle in (rover.max_pitch_rad, rover.max_roll_rad)
        )
        # of two directions of which one is not too steep along and the other not too steep across, some lie between
        some = (slope <= math.tan(rover.max_slope_rad)) & (slope <= math.hypot(pitch, roll))
        return some, some & (slope <= min(pitch, roll))

    @cached_property
    def _zones(self) -> tuple[_Zone, ...]:
        problem, apart_m = self.problem, self.problem.rover.footprint_radius_m
        found = []
        for reason, areas in ((Reason.NO_GO, problem.no_go), (Reason.KEEP_IN, problem.keep_in)):
            if areas:
                union = shapely.union_all(areas)
                zone = union if reason is Reason.NO_GO else outside_of(problem.grid, (union,))
                outer = zone.buffer(apart_m * OUTWARD, quad_segs=QUARTER) if apart_m > 0.0 else zone
                inner = zone.buffer(apart_m, quad_segs=QUARTER) if apart_m > 0.0 else zone
                shapely.prepare(outer)
                shapely.prepare(inner)
                found.append(_Zone(reason, outer, inner))
        return tuple(found)

    def coarsest(self) -> tuple[Leaves, Codes]:
        """The triangles of the ground, and what each is judged."""
        some, straight = self._ground
        against = self.field.reasons & ~bit_of(Reason.SLOPE)
        codes = np.where(against[..., None] != 0, DOUBT, np.where(straight, CLEAR, FINAL)).astype(np.uint8)
        codes[~some] = CLOSED
        codes[self._where(*TRIED) & (codes != CLOSED).any(axis=-1)] = FINAL
        if self.problem.moves:
            codes[self._where(*BY_SIGHT)] = FINAL
        codes[~some] = CLOSED
        for zone in self._zones:
            rest = outside_of(self.field.grid, (zone.inner,))
            codes[self._where(zone.reason) & ~squares_touched(self.field.grid, rest, 0.0)] = CLOSED
        return Leaves.whole(self.field.reasons.shape), codes.ravel()

    def _where(self, *reasons: Reason) -> Mask:
        bits = np.bitwise_or.reduce([bit_of(reason) for reason in reasons])
        found: Mask = (self.field.reasons & bits) != 0
        return found

    def of(self, leaves: Leaves) -> Codes:
        """(n,) what parts of triangles that were in doubt are judged."""
        row, col, half = leaves.triangle
        some, straight = (which[row, col, half] for which in self._ground)
        codes = np.where(some, np.where(straight, CLEAR, FINAL), CLOSED).astype(np.uint8)
        bits = self.field.reasons[row, col]
        for reasons, judged in (
            ((Reason.NO_GO, Reason.KEEP_IN), self._by_areas),
            ((Reason.BORDER,), self._by_border),
            ((Reason.UNKNOWN_GROUND,), self._by_unknown_ground),
            ((Reason.STEP,), self._by_steps),
            ((Reason.MORPHING_MAP,), self._by_morphing_map),
            (BY_SIGHT, self._by_sight),
        ):
            which = (codes != CLOSED) & ((bits & np.bitwise_or.reduce([bit_of(one) for one in reasons])) != 0)
            if which.any():
                codes[which] = np.minimum(codes[which], judged(leaves.some(which)))
        codes[(codes == DOUBT) & (leaves.level >= MOST_LEVELS)] = SLIVER
        return codes

    def _metres(self, leaves: Leaves) -> Floats:
        """(n, 3, 2) corners in east and north."""
        corners = leaves.corners
        return np.stack(metres_of(self.field.grid, corners.reshape(-1, 2)), axis=-1).reshape(corners.shape)

    def reach_m(self, leaves: Leaves) -> Floats:
        """(n,) how far two places of a leaf are apart at most."""
        grid = self.field.grid
        found: Floats = leaves.size * math.hypot(grid.cell_east_m, grid.cell_north_m)
        return found

    def _by_areas(self, leaves: Leaves) -> Codes:
        shapes = shapely.polygons(self._metres(leaves))
        touched, taken = np.zeros((2, len(leaves)), np.bool_)
        for zone in self._zones:
            touched |= shapely.intersects(zone.outer, shapes)
            taken |= shapely.covers(zone.inner, shapes)
        return _judged(~touched, taken)

    def _by_border(self, leaves: Leaves) -> Codes:
        radius_m, corners = self.problem.rover.footprint_radius_m, self._metres(leaves)
        west_m, south_m, east_m, north_m = self.field.grid.bounds_m
        away_m = np.stack(
            [corners[..., 0] - west_m, east_m - corners[..., 0], corners[..., 1] - south_m, north_m - corners[..., 1]]
        )
        nearest_m, farthest_m = away_m.min(axis=(0, 2)), away_m.max(axis=2).min(axis=0)
        return _judged(nearest_m >= radius_m, farthest_m < radius_m)

    @cached_property
    def _unknown(self) -> tuple[shapely.STRtree, scipy.spatial.cKDTree]:
        """Triangles of unknown ground that have known ones near, and unknown posts."""
        grid = self.field.grid
        unknown = np.isnan(self._gradients[0]) | np.isnan(self._gradients[1])
        edge = self._where(Reason.UNKNOWN_GROUND)[..., None] & unknown
        inner = scipy.ndimage.binary_erosion(unknown.all(axis=-1), np.ones((3, 3)))
        triangles = Leaves.whole(self.field.reasons.shape).some((edge & ~inner[..., None]).ravel())
        posts = np.argwhere(np.isnan(grid.heights_m)).astype(np.float64)
        return (
            shapely.STRtree(shapely.polygons(self._metres(triangles))),
            scipy.spatial.cKDTree(np.column_stack(metres_of(grid, posts))),
        )

    def _by_unknown_ground(self, leaves: Leaves) -> Codes:
        """An unknown post under all footprints closes; the validator looks at posts there, and at places on the rim."""
        radius_m, corners = self.problem.rover.footprint_radius_m, self._metres(leaves)
        triangles, posts = self._unknown
        near = np.zeros(len(leaves), np.bool_)
        if radius_m > 0.0:
            near[triangles.query(shapely.polygons(corners), "dwithin", distance=radius_m)[0]] = True
        middle = corners.mean(axis=1)
        nearest = posts.data[posts.query(middle)[1]]
        closed = np.hypot(*(corners - nearest[:, None, :]).transpose(2, 0, 1)).max(axis=1) <= radius_m
        return _judged(~near, closed & near)

    @cached_property
    def _bend(self) -> Floats:
        """(rows - 1, cols - 1) bound of how much gradients under a footprint differ, and around it by a square more."""
        grid, radius_m = self.field.grid, self.problem.rover.footprint_radius_m
        size = [2 * (math.ceil(radius_m / cell_m) + 1) + 1 for cell_m in (grid.cell_north_m, grid.cell_east_m)]
        spread = [
            scipy.ndimage.maximum_filter(np.nan_to_num(axis, nan=np.inf).max(axis=-1), size)
            - scipy.ndimage.minimum_filter(np.nan_to_num(axis, nan=-np.inf).min(axis=-1), size)
            for axis in self._gradients
        ]
        found: Floats = np.hypot(*spread)
        return found

    def _by_steps(self, leaves: Leaves) -> Codes:
        """How far ground on the rim and posts under it depart from the leaf's plane, and how much that may change."""
        grid, rover = self.field.grid, self.problem.rover
        radius_m, limit_m = rover.footprint_radius_m, rover.max_step_m
        row, col, half = leaves.triangle
        middle = self._metres(leaves).mean(axis=1)
        gradient = np.stack([axis[row, col, half] for axis in self._gradients], axis=-1)
        turn = np.linspace(0.0, 2.0 * math.pi, RIM, endpoint=False)
        rim = radius_m * np.column_stack([np.sin(turn), np.cos(turn)])
        ground_m = height_at(grid, *middle.T)
        apart_m = np.zeros(len(leaves))
        for begin in range(0, len(leaves), AT_ONCE // RIM):
            part = slice(begin, begin + AT_ONCE // RIM)
            there_m = height_at(grid, *(middle[part, None, :] + rim).transpose(2, 0, 1))
            plane_m = ground_m[part, None] + gradient[part] @ rim.T
            apart_m[part] = np.nan_to_num(np.abs(there_m - plane_m)).max(axis=1)
        # the rim moves as far as the middle does
        change_m = self.reach_m(leaves) * self._bend[row, col]
        posts_m = self._posts_apart_m(leaves, middle, ground_m, gradient)
        return _judged(np.maximum(apart_m + change_m, posts_m) <= limit_m, apart_m - change_m > limit_m)

    def _posts_apart_m(self, leaves: Leaves, middle: Floats, ground_m: Floats, gradient: Floats) -> Floats:
        """(n,) how far posts under any footprint in a leaf depart from its plane."""
        grid = self.field.grid
        within_m = self.problem.rover.footprint_radius_m + self.reach_m(leaves)
        row, col, _ = leaves.triangle
        down, across = (
            math.ceil(float(within_m.max()) / cell_m) + 1 for cell_m in (grid.cell_north_m, grid.cell_east_m)
        )
        worst_m = np.zeros(len(leaves))
        for r in range(-down, down + 2):
            for c in range(-across, across + 2):
                at = np.clip(row + r, 0, grid.rows - 1), np.clip(col + c, 0, grid.cols - 1)
                east_m, north_m = metres_of(grid, np.column_stack(at).astype(np.float64))
                away = np.column_stack([east_m, north_m]) - middle
                there_m = np.abs(grid.heights_m[at] - ground_m - (away * gradient).sum(axis=1))
                near = np.hypot(*away.T) <= within_m
                worst_m = np.where(near, np.fmax(worst_m, there_m), worst_m)
        return worst_m

    def _by_morphing_map(self, leaves: Leaves) -> Codes:
        grid, air = self.field.grid, self.problem.maps
        assert isinstance(air, MorphingMap), "nothing else marks squares so"
        above_m = grid.heights_m + np.float32(self.problem.rover.receiver_above_ground_m) - air.safe_above_m
        above_m = np.where(np.isfinite(above_m), above_m, np.nan).astype(np.float32)
        places = (grid.cell_east_m, grid.cell_north_m, grid.origin_east_m, grid.origin_north_m)
        surface = ElevationGrid(above_m, *places)
        # just inside, where the neighbours count for nothing
        corners = self._metres(leaves)
        inside = corners + 1e-6 * (corners.mean(axis=1, keepdims=True) - corners)
        found_m = height_at(surface, inside[..., 0], inside[..., 1])
        found_m = np.where(np.isnan(found_m), -np.inf, found_m)
        lowest_m, highest_m = found_m.min(axis=1), found_m.max(axis=1)
        return _judged(lowest_m >= 0.0, highest_m < 0.0)

    def _by_sight(self, leaves: Leaves) -> Codes:
        """Sight lines from the corners, which prove nothing of what is between them; finer nobody asks."""
        assert self.maps is not None, "without anchors nothing marks squares so"
        # corners are whole numbers on the finest grid
        fine = float(SPLIT**MOST_LEVELS)
        corners = (leaves.corners.reshape(-1, 2) * fine).astype(np.int64)
        keys, inverse = np.unique(corners[:, 0] * (1 << 32) + corners[:, 1], return_inverse=True)
        places = np.column_stack([keys >> 32, keys & ((1 << 32) - 1)]) / fine
        seen = self.maps.sightings(places, np.zeros(len(places)))
        kept = ~breaks(self.problem.limits, seen)[inverse].reshape(-1, 3)
        mixed = kept.any(axis=1) & (leaves.level < SIGHT_LEVELS)
        codes: Codes = np.where(kept.all(axis=1), CLEAR, np.where(mixed, DOUBT, SLIVER)).astype(np.uint8)
        return codes


def _judged(clear: Mask, closed: Mask) -> Codes:
    codes: Codes = np.where(closed, CLOSED, np.where(clear, CLEAR, DOUBT)).astype(np.uint8)
    return codes
