"""Odometry whose clock runs ahead of, or behind, the ranging clock (seed 000, odometry step 1)."""

from __future__ import annotations

from dataclasses import replace

from .odometry import Motion

__all__ = ["aligned"]


def aligned(before: Motion | None, now: Motion, ahead_s: float) -> Motion:
    """The motion over the ranging interval, of increments stamped by a clock that is ahead by so many seconds.

    An increment of a clock that is ahead began and ended too early. What it lacks at its end the rover is taken to have
    done at the same speed; of one that is behind, the beginning belongs to the increment before.
    """
    share = min(max(-ahead_s / now.duration_s, 0.0), 1.0)
    if share == 0.0 or before is None or not before.reliable:
        return now
    borrowed = now.duration_s / before.duration_s * share
    displacement_m = None
    if now.displacement_m is not None and before.displacement_m is not None:
        east_m, north_m = (
            (1.0 - share) * new + borrowed * old
            for new, old in zip(now.displacement_m, before.displacement_m, strict=True)
        )
        displacement_m = east_m, north_m
    length_m = (1.0 - share) * now.length_m + borrowed * before.length_m
    return replace(now, length_m=length_m, displacement_m=displacement_m)
