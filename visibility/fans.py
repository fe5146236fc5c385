"""Fans of rays: the bearings that a sector's rays take, one fan after the other from its left to its right."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .kernels.sweep import COARSEST

__all__ = ["Fan", "entering_fans", "plain_fan"]

ENTRY_GAP = 2.0  # posts between the places at which neighbouring rays come onto the map
WIDENING = 2.0  # how much the bearings of one fan differ: more fans would have fewer rays, but each has its lines


@dataclass(frozen=True, slots=True)
class Fan:
    """Rays at bearings t_0, t_0 + dt … (posts across per post along); rays - 1 is a multiple of COARSEST.

    coarsest: near the eye only every so many of them run.
    """

    t_0: float
    dt: float
    rays: int
    coarsest: int

    @property
    def end(self) -> float:
        """The last bearing, as kernels compute it: the next fan starts at exactly this one."""
        return self.t_0 + (self.rays - 1) * self.dt

    def lines_before(self, beyond: float, near: float) -> int:
        """How many lines, the nearest near the eye, lie before the first on which one of its rays is on the map."""
        return max(math.floor(beyond / max(abs(self.t_0), abs(self.end)) - near) - 1, 0)


def plain_fan(across_0: float, reach: tuple[float, float, float, float]) -> Fan:
    """The fan of a sector whose lines all start on the map or at its first line.

    across_0: of the eye, in posts. reach: lowest and highest bearing, nearest and farthest line, in posts along.
    """
    t_low, t_high, near, far = reach
    dt = _usual_dt(near, far)
    # one ray through each post of the farthest line
    t_0 = (math.floor(t_low * far + across_0) - across_0) / far
    if across_0.is_integer() and t_low <= 0.0:
        # a ray runs along the eye's own line of posts from the start: walls stand along the grid, and rays that
        # start later between a hidden and a free one take the mean of both with them to the far end
        t_0 = -math.ceil(-t_low / (dt * COARSEST)) * COARSEST * dt
    rays = _whole_steps((t_high - t_0) / dt) + 1
    if t_high == 0.0:
        # an eye on the last border: the last ray runs along it, and those to spare beyond the other end
        t_0 = -(rays - 1) * dt
    return Fan(t_0, dt, rays, COARSEST)


def entering_fans(across_0: float, beyond: float, reach: tuple[float, float, float, float]) -> list[Fan]:
    """The fans of a sector whose lines come onto the map across a border that runs along it.

    A ray at bearing t does so ``beyond / t`` along. Rays that graze the border are a post apart at the far end, but
    come onto the map many posts apart: one has met ground there that its neighbour has not. So there are so many of
    them that they come onto it a post apart, and none is left out near the eye that would make it more.
    across_0, reach: see ``plain_fan``. beyond: posts from the eye to that border.
    """
    t_low, t_high, near, far = reach
    usual = _usual_dt(near, far)
    sign = 1.0 if across_0 < 0.0 else -1.0
    steepest = max(abs(t_low), abs(t_high))
    # from the bearing that grazes most: its size, the largest step, how many of these a ray near the eye may stand for
    pieces: list[tuple[float, float, int]] = []
    size = beyond / far
    while not pieces or size < steepest:
        entry_dt = ENTRY_GAP * size * size / beyond
        dt = min(usual, entry_dt)
        pieces.append((size, dt, _power_of_two(entry_dt / dt)))
        size = steepest if dt == usual else size * WIDENING
    bounds = [*(piece[0] for piece in pieces), max(steepest, pieces[-1][0])]
    spans = [(low, high, dt, coarsest) for (low, dt, coarsest), high in zip(pieces, bounds[1:], strict=True)]
    if sign < 0.0:
        spans = [(-high, -low, dt, coarsest) for low, high, dt, coarsest in reversed(spans)]
    fans: list[Fan] = []
    for low, high, dt, coarsest in spans:
        t_0 = fans[-1].end if fans else low
        steps = _whole_steps((high - t_0) / dt)
        fans.append(Fan(t_0, max(high - t_0, dt) / steps, steps + 1, coarsest))
    return fans


def _usual_dt(near: float, far: float) -> float:
    """One ray through each post of the farthest line; where rays hardly spread, one between them too."""
    return (1.0 if near <= 1.0 else 0.5) / far


def _power_of_two(most: float) -> int:
    return 1 << min(int(math.log2(most)), int(math.log2(COARSEST)))


def _whole_steps(steps: float) -> int:
    """A whole number of the coarsest steps, one at least."""
    return max(math.ceil(steps / COARSEST), 1) * COARSEST
