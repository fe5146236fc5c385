"""Frames: which body a CRS lies on, and positions in degrees brought into a grid's metric frame."""

from __future__ import annotations

from dataclasses import dataclass

import pyproj

from .errors import FrameError

__all__ = ["Body", "body_of"]


@dataclass(frozen=True, slots=True)
class Body:
    """A celestial body: its name and mean ellipsoid radius (2a + b)/3 in metres."""

    name: str
    radius_m: float


def body_of(crs: pyproj.CRS) -> Body:
    """The body that a CRS describes, told by the size of its ellipsoid. Raises FrameError when it has none."""
    ellipsoid = crs.ellipsoid
    if ellipsoid is None:
        raise FrameError(f"The CRS {crs.name!r} has no ellipsoid, so its radius is unknown.")
    semi_major_m, semi_minor_m = ellipsoid.semi_major_metre, ellipsoid.semi_minor_metre
    names = {"Earth": (6.33e6, 6.41e6), "Mars": (3.35e6, 3.42e6), "Moon": (1.73e6, 1.745e6)}
    name = next((n for n, (low, high) in names.items() if low <= semi_major_m <= high), ellipsoid.name)
    return Body(name, (2.0 * semi_major_m + semi_minor_m) / 3.0)
