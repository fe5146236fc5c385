"""What stands on the ground, in the frame of a grid: roofs and the edges at which they end, and trees."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely

from .errors import ElevationGridError

__all__ = ["SkyDepths", "Standing", "Trees"]

Reals = npt.NDArray[np.float64]
Heights = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Standing:
    """Opaque solids, each from the ground up to its roof; what is open below a roof counts as solid.

    edges_m: (n, 2, 3) east, north, altitude of both ends of every edge at which a roof ends or bends. faces_m:
    (m, 3, 3) the triangles around the solids, roofs and walls. bodies: how many solids. notes: what was done to
    get them, sentences.
    Raises ElevationGridError.
    """

    edges_m: Reals
    faces_m: Reals
    bodies: int
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, ends in (("edges_m", 2), ("faces_m", 3)):
            values = np.array(getattr(self, name), np.float64, order="C")
            if values.ndim != 3 or values.shape[1:] != (ends, 3) or not np.isfinite(values).all():
                raise ElevationGridError(f"{name} must be finite numbers (n, {ends}, 3), not shape {values.shape}.")
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of edges and faces."""
        return hashlib.sha256(self.edges_m.tobytes() + self.faces_m.tobytes()).hexdigest()

    @cached_property
    def highest_m(self) -> float:
        """Altitude of the highest roof."""
        return float(self.faces_m[..., 2].max(initial=-np.inf))

    @cached_property
    def outlines(self) -> tuple[shapely.Polygon, ...]:
        """What is under roofs, seen from above: polygons that do not overlap, metres."""
        seen = shapely.polygons(self.faces_m[..., :2])
        together = shapely.union_all(shapely.buffer(seen[shapely.area(seen) > 0.0], 0.0))
        return tuple(part for part in shapely.get_parts(together) if part.geom_type == "Polygon" and part.area > 0.0)


@dataclass(frozen=True, slots=True)
class SkyDepths:
    """Optical depth per metre of canopy by the direction in which a way leads up.

    elevation_edges_rad: (m + 1,) ascending edges of rings; ways below the first or above the last are of that ring.
    depth_per_m: m rows of n numbers >= 0, for n equal sectors clockwise from grid north, the first beginning there.
    Raises ElevationGridError.
    """

    elevation_edges_rad: tuple[float, ...]
    depth_per_m: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        edges, rows = self.elevation_edges_rad, self.depth_per_m
        if len(edges) < 2 or not all(low < high for low, high in pairwise(edges)):
            raise ElevationGridError("Rings of a canopy's depths need two ascending edges or more.")
        if len(rows) != len(edges) - 1 or not rows[0] or len({len(row) for row in rows}) > 1:
            raise ElevationGridError(f"A canopy's depths need {len(edges) - 1} rows of equally many sectors.")
        if not all(math.isfinite(depth) and depth >= 0.0 for row in rows for depth in row):
            raise ElevationGridError("A canopy's depths must be numbers >= 0.")

    def at(self, azimuth_rad: npt.ArrayLike, elevation_rad: npt.ArrayLike) -> Reals:
        """(n,) depths of ways that lead up in these directions."""
        table = np.array(self.depth_per_m)
        ring = np.searchsorted(np.array(self.elevation_edges_rad[1:-1]), np.asarray(elevation_rad), side="right")
        turned = np.asarray(azimuth_rad, np.float64) % (2.0 * np.pi) / (2.0 * np.pi)
        found: Reals = table[ring, np.minimum((turned * table.shape[1]).astype(np.intp), table.shape[1] - 1)]
        return found


@dataclass(frozen=True, eq=False)
class Trees:
    """Canopy over the posts of a grid: it hides nothing, and weakens what passes.

    top_m, base_m: (rows, cols) heights over the ground of crowns and of where they begin, 0 = none, NaN = unknown.
    model: what a way through costs a signal, as ``visibility.signal`` names it; depth_per_m: of the model "density",
    optical depth per metre, or in its place sky, or density_per_m (rows, cols); season: factor on the loss. notes: what
    was done to get them.
    """

    top_m: Heights
    base_m: Heights
    model: str
    depth_per_m: float | None = None
    season: float = 1.0
    notes: tuple[str, ...] = ()
    sky: SkyDepths | None = None
    density_per_m: Heights | None = None

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all but the notes."""
        of_sky = () if self.sky is None else (self.sky,)
        sha = hashlib.sha256(repr((self.model, self.depth_per_m, self.season, *of_sky)).encode())
        sha.update(np.ascontiguousarray(self.top_m).tobytes())
        sha.update(np.ascontiguousarray(self.base_m).tobytes())
        if self.density_per_m is not None:
            sha.update(np.ascontiguousarray(self.density_per_m).tobytes())
        return sha.hexdigest()

    def window(self, rows: slice, cols: slice) -> Trees:
        """Those over some of the posts."""
        return self.over_posts(lambda values: values[rows, cols])

    def over_posts(self, change: Callable[[Heights], Heights]) -> Trees:
        """The same trees over other posts; change: makes the values there of those here."""
        density = None if self.density_per_m is None else change(self.density_per_m)
        return replace(self, top_m=change(self.top_m), base_m=change(self.base_m), density_per_m=density)
