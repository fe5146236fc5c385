"""Anchors in one plane (on one line in 2D) and a rover that passes through it: from there on either side may be its."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .tracks import Track

__all__ = ["mirrored_near"]

Floats = npt.NDArray[np.float64]

BLIND = 3.0  # sigmas of a range by which it may be off where a track passes the plane
TELLING = 4.0  # sigmas by which one epoch's ranges tell sides for good


def mirrored_near(track: Track, places_m: Floats, sigma_m: float, dimension: int) -> tuple[Track | None, float]:
    """The same track on the other side of the anchors (m, 3), and how many sigmas an epoch's ranges tell it from there.

    None where it is too far from their plane to have passed it unseen, or where anchors stand so far off that plane
    that its ranges tell sides. Near it ranges know a height only by its square, h²/2r: below √(2·r·3 sigma) hardly.
    """
    d = dimension
    if len(places_m) <= d:
        return None, math.inf
    middle_m, normal, thick_m, wide2_m2 = _plane(places_m.tobytes(), d)
    from_middle_m = track.place_m[:d] - middle_m
    off_m = float(from_middle_m @ normal)
    apart_m = math.sqrt(float(from_middle_m @ from_middle_m) + wide2_m2)  # of the anchors, in the root mean square
    told = 2.0 * abs(off_m) * thick_m / (sigma_m * apart_m)
    if off_m * off_m > 2.0 * apart_m * BLIND * sigma_m or told > TELLING:
        return None, told
    flip = np.eye(d) - 2.0 * np.outer(normal, normal)
    whole = np.eye(len(track.state))
    whole[:d, :d] = whole[3 : 3 + d, 3 : 3 + d] = flip
    state = whole @ track.state
    state[:d] = track.place_m[:d] - 2.0 * off_m * normal
    # it has to be shown by more than the noise of one epoch that the track, which ranges told of, has lost its side
    likely = track.log_likelihood - (told * told if told > 1.0 else 0.0)
    return replace(track, state=state, covariance=whole @ track.covariance @ whole.T, log_likelihood=likely), told


@functools.lru_cache(maxsize=64)
def _plane(places: bytes, d: int) -> tuple[Floats, Floats, float, float]:
    """(middle (d,), normal (d,), how far off it anchors (m, 3) stand, root of the sum, mean square from the middle)."""
    places_m = np.frombuffer(places).reshape(-1, 3)[:, :d]
    middle_m = places_m.mean(axis=0)
    _, sizes_m, axes = np.linalg.svd(places_m - middle_m, full_matrices=False)
    return middle_m, axes[-1], float(sizes_m[-1]), float(sizes_m @ sizes_m) / len(places_m)
