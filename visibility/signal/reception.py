"""What decides whether a point gets an anchor: the signal where the anchor has a radio, sight where it has none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.sight.anchors import Anchor
from visibility.sight.curvature import Curvature
from visibility.sight.doubts import doubted
from visibility.sight.minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, UnknownGround
from visibility.sight.radios import Radio
from visibility.sight.sight_lines import lines_of_sight
from visibility.sight.sight_points import check_points, points_within_reach
from visibility.signal.links import signals

__all__ = ["Reception", "reception", "usable_probability"]

Reals = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Reception:
    """What n points get of an anchor, limits of its antenna apart.

    verdict: (n,) uint8, VISIBLE 1 where it is got for certain, HIDDEN 0, UNKNOWN 255. clearance_m: (n,) of the sight
        line, as in ``LinesOfSight``; None with a radio where it was not asked for.
    probability: (n,) 0..1; NaN where it is not known.
    margin_db: (n,) of the signal, as in ``Signals``; None without a radio.
    """

    verdict: npt.NDArray[np.uint8]
    clearance_m: Reals | None
    probability: Reals
    margin_db: Reals | None


def reception(
    grid: ElevationGrid,
    from_points_m: npt.ArrayLike,
    to_points_m: npt.ArrayLike,
    radio: Radio | None,
    *,
    curvature: Curvature | None = None,
    unknown: UnknownGround = "unknown",
    dem_sigma_m: float | None = None,
    clearance: bool = False,
) -> Reception:
    """Whether what is sent at points (n, 3) is got at others (n, 3): east, north, altitude, metres.

    With a radio by the margin of ``signals``, from 0 dB on; without by ``lines_of_sight``. probability: with a radio by
    its spread, without by dem_sigma_m, or for certain without either. clearance: whether that
    of the sight line is asked for beside the signal. Raises VisibilityInputError, SignalError.
    """
    if radio is None:
        return _sight(grid, from_points_m, to_points_m, curvature, unknown, dem_sigma_m)
    clearance_m = None
    if clearance:
        sight = lines_of_sight(grid, from_points_m, to_points_m, curvature=curvature, unknown=unknown)
        clearance_m = sight.clearance_m
    heard = signals(grid, from_points_m, to_points_m, radio, curvature=curvature, unknown=unknown)
    enough = np.where(heard.margin_db >= 0.0, VISIBLE, HIDDEN)
    verdict = np.where(np.isnan(heard.margin_db), UNKNOWN, enough).astype(np.uint8)
    return Reception(verdict, clearance_m, heard.probability, heard.margin_db)


def _sight(
    grid: ElevationGrid,
    from_points_m: npt.ArrayLike,
    to_points_m: npt.ArrayLike,
    curvature: Curvature | None,
    unknown: UnknownGround,
    dem_sigma_m: float | None,
) -> Reception:
    sight = lines_of_sight(
        grid, from_points_m, to_points_m, curvature=curvature, unknown=unknown, dem_sigma_m=dem_sigma_m
    )
    probability = sight.probability_clear
    if probability is None:
        probability = np.where(sight.verdict == UNKNOWN, np.nan, (sight.verdict == VISIBLE).astype(np.float64))
    return Reception(sight.verdict, sight.clearance_m, probability, None)


def usable_probability(
    grid: ElevationGrid,
    anchors: Sequence[Anchor],
    points_m: npt.ArrayLike,
    *,
    curvature: Curvature | None = None,
    unknown: UnknownGround = "unknown",
    dem_sigma_m: float | None = None,
) -> Reals:
    """(n, k) probability that a range between each of n points and of k anchors arrives.

    Of an anchor with a radio that enough of its signal does, with the spread of the radio; of one without that it is in
    sight, with dem_sigma_m. 0 beyond the limits of the anchor's antenna; NaN where it is not known, unknown ground
    between and doubted sight. points_m: (n, 3) east, north, altitude, metres in the grid's frame.
    Raises VisibilityInputError, SignalError.
    """
    at_m = check_points(grid, "points_m", points_m)
    bent = Curvature.over(grid, curvature)
    found = np.empty((len(at_m), len(anchors)))
    for number, anchor in enumerate(anchors):
        from_m = np.broadcast_to((anchor.east_m, anchor.north_m, anchor.altitude_m), at_m.shape)
        got = reception(grid, from_m, at_m, anchor.radio, curvature=bent, unknown=unknown, dem_sigma_m=dem_sigma_m)
        known = np.where(doubted(anchor.doubts, at_m), np.nan, got.probability)
        found[:, number] = np.where(points_within_reach(anchor, at_m, bent), known, 0.0)
    return found
