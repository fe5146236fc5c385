"""A drive in a tangent frame of a turning planet, and what a perfect unit reads of it: derivatives of splines.

Nothing here is a mechanisation: force and turn rate follow from the path by differentiation.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

WGS84_A_M, WGS84_F = 6_378_137.0, 1.0 / 298.257223563


Array = npt.NDArray[np.float64]


class Drive:
    """A smooth path over gentle hills: vehicle along its course, pitched with the ground, rolled a little in turns."""

    def __init__(self, seed: int, duration_s: float = 300.0, speed_m_per_s: float = 8.0) -> None:
        rng = np.random.default_rng(seed)
        knots = np.arange(-40.0, duration_s + 41.0, 20.0)
        turn = CubicSpline(knots, rng.normal(0.0, 0.08, len(knots)))
        self.times_s = np.arange(0.0, duration_s + 1e-9, 0.005)
        heading = CubicSpline(knots, turn.antiderivative()(knots) + rng.uniform(0.0, 2.0 * np.pi))
        speed = CubicSpline(knots, speed_m_per_s * rng.uniform(0.6, 1.2, len(knots)))
        climb = CubicSpline(knots, rng.normal(0.0, 0.03, len(knots)))
        fine = np.arange(-1.0, duration_s + 1.0, 0.005)
        velocity = np.stack(
            [speed(fine) * np.sin(heading(fine)), speed(fine) * np.cos(heading(fine)), speed(fine) * climb(fine)],
            axis=1,
        )
        self.velocity = CubicSpline(fine, velocity)
        self.position = self.velocity.antiderivative()
        self._angles = heading, lambda t: np.arctan(climb(t)), lambda t: -0.3 * turn(t)

    def angles(self, times_s: Array) -> Array:
        """(k, 3) heading clockwise from north, pitch nose up, roll right side down."""
        return np.stack([angle(times_s) for angle in self._angles], axis=-1)

    def attitude(self, times_s: Array) -> Rotation:
        """Rotations from forward, left, up to east, north, up."""
        heading, pitch, roll = self.angles(times_s).T
        return Rotation.from_euler("ZYX", np.stack([np.pi / 2.0 - heading, -pitch, roll], axis=1))

    def readings(self, gravity: Callable[[Array], Array], rate_rad_per_s: Array) -> tuple[Array, Array]:
        """(forces, turn rates) (k, 3), means over each step, that a perfect unit reads; gravity(places)."""
        steps = np.diff(self.times_s)
        attitudes = self.attitude(self.times_s)
        # turn since the step before, as the stars see it
        turns = (
            attitudes[:-1].inv() * Rotation.from_rotvec(np.outer(steps, rate_rad_per_s)) * attitudes[1:]
        ).as_rotvec()
        forces = np.zeros((len(self.times_s), 3))
        nodes, weights = np.polynomial.legendre.leggauss(3)
        for node, weight in zip(nodes, weights, strict=True):
            at = self.times_s[:-1] + 0.5 * steps * (1.0 + node)
            velocity = self.velocity(at)
            felt = self.velocity(at, 1) + 2.0 * np.cross(rate_rad_per_s, velocity) - gravity(self.position(at))
            forces[1:] += 0.5 * weight * self.attitude(at).inv().apply(felt)
        rates = np.zeros_like(forces)
        rates[1:] = turns / steps[:, None]
        forces[0], rates[0] = forces[1], rates[1]
        return forces, rates


def along(function: Callable[[Array], Array], places_m: Array, every: int = 100) -> Array:
    """A slow and smooth function of places along a path, asked at every so-manieth and drawn straight between."""
    asked = np.unique(np.r_[np.arange(0, len(places_m), every), len(places_m) - 1])
    values = np.array([function(place) for place in places_m[asked]])
    return np.stack([np.interp(np.arange(len(places_m)), asked, column) for column in values.T], axis=1)


def normal_gravity(latitude_rad: float, height_m: float) -> float:
    """Magnitude by WGS 84 (NGA.STND.0036, eqs. 4-1 and 4-3)."""
    sine2 = np.sin(latitude_rad) ** 2
    ground = 9.7803253359 * (1.0 + 0.00193185265241 * sine2) / np.sqrt(1.0 - 0.00669437999014 * sine2)
    m = 0.00344978650684
    return ground * (
        1.0
        - 2.0 / WGS84_A_M * (1.0 + WGS84_F + m - 2.0 * WGS84_F * sine2) * height_m
        + 3.0 * height_m**2 / WGS84_A_M**2
    )
