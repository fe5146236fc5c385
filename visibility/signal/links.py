"""The signal of links over ground, roofs and canopy: what is lost where, the margin, and how likely a range arrives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.errors import SignalError
from visibility.sight.curvature import Curvature
from visibility.sight.minimum_altitude import UnknownGround
from visibility.sight.radios import LIGHT_M_PER_S, Polarization, Radio, arrival_probability, free_space_loss_db
from visibility.sight.roofs import roofs_for_kernels
from visibility.sight.sight_points import check_points, in_posts
from visibility.signal.foliage import Foliage, foliage_of
from visibility.signal.kernels.diffraction import SUMS, clear_sums, diffraction_loss, put_ground
from visibility.signal.kernels.links import BITS, LEAVES_GRID, LOSS, OVER_UNKNOWN, diffraction_losses

__all__ = ["Signals", "profile_diffraction_db", "signals"]

Reals = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Signals:
    """The answer to ``signals``; every array has one entry per link, n of them, and NaN where it is not known.

    free_space_db, diffraction_db, canopy_db: (n,) what is lost; diffraction +inf where an end lies below the ground or
        a roof. canopy_m: (n,) way between crown bases and tops.
    received_dbm: (n,) power at the receiver. margin_db: (n,) that less the receiver's sensitivity; usable from 0 on.
    probability: (n,) that enough arrives, with the radio's spread.
    over_unknown, leaves_dem: (n,) bool, as in ``LinesOfSight``.
    warnings: what to know, sentences.
    """

    free_space_db: Reals
    diffraction_db: Reals
    canopy_m: Reals
    canopy_db: Reals
    received_dbm: Reals
    margin_db: Reals
    probability: Reals
    over_unknown: npt.NDArray[np.bool_]
    leaves_dem: npt.NDArray[np.bool_]
    radio: Radio
    warnings: tuple[str, ...]


def signals(
    grid: ElevationGrid,
    from_points_m: npt.ArrayLike,
    to_points_m: npt.ArrayLike,
    radio: Radio,
    *,
    foliage: Foliage | None = None,
    curvature: Curvature | None = None,
    unknown: UnknownGround = "unknown",
) -> Signals:
    """The signal of n links between points (n, 3) east, north, altitude, metres in the grid's frame.

    Free space (Rec. ITU-R P.525), diffraction over ground and roofs (P.526, delta-Bullington, every edge of the
    triangulation), and what canopy takes. Reflections, and what passes through walls, are left out.
    foliage: canopy over the same grid, and what it costs; None: what stands on the grid (``with_foliage``).
    unknown: of links over unknown ground: NaN, or as if it did not block ("open"), or nothing arrives ("blocked").
    Raises VisibilityInputError, SignalError, CoverError.
    """
    start_m, end_m = check_points(grid, "from_points_m", from_points_m), check_points(grid, "to_points_m", to_points_m)
    if len(start_m) != len(end_m):
        raise SignalError(f"Each link needs two points, not {len(start_m)} and {len(end_m)}.")
    foliage = foliage_of(grid) if foliage is None else foliage
    if foliage is not None and foliage.canopy.grid.shape != grid.shape:
        raise SignalError("The canopy of a link must be over the same grid.")
    curvature = Curvature.over(grid, curvature)
    links = np.stack([in_posts(grid, start_m), in_posts(grid, end_m)], axis=1)
    found = np.empty((len(links), 2))
    vertical = radio.polarization == "vertical"
    wave = (grid.cell_east_m, grid.cell_north_m, curvature.drop_per_m2, radio.wavelength_m, vertical)
    diffraction_losses(grid.heights_m, wave, *roofs_for_kernels(grid), links, found)
    diffraction_db, bits = found[:, LOSS].copy(), found[:, BITS].astype(np.uint8)
    over_unknown = (bits & OVER_UNKNOWN) > 0
    if unknown != "open":
        diffraction_db[over_unknown & np.isfinite(diffraction_db)] = np.nan if unknown == "unknown" else np.inf
    step_m = end_m - start_m
    distance_m = np.sqrt((step_m**2).sum(axis=1))
    free_space_db = free_space_loss_db(distance_m, radio.frequency_hz)
    canopy_m, canopy_db, warnings = np.zeros(len(links)), np.zeros(len(links)), tuple[str, ...]()
    if foliage is not None:
        canopy_m, loss = foliage.between(start_m, end_m, radio.frequency_hz, curvature)
        canopy_db, warnings = loss.loss_db, loss.notes
    margin_db = radio.allowed_loss_db - free_space_db - diffraction_db - canopy_db
    return Signals(
        free_space_db=free_space_db,
        diffraction_db=diffraction_db,
        canopy_m=canopy_m,
        canopy_db=canopy_db,
        received_dbm=margin_db + radio.sensitivity_dbm,
        margin_db=margin_db,
        probability=arrival_probability(margin_db, radio.spread_db),
        over_unknown=over_unknown,
        leaves_dem=(bits & LEAVES_GRID) > 0,
        radio=radio,
        warnings=warnings,
    )


def profile_diffraction_db(
    distance_m: npt.ArrayLike,
    ground_m: npt.ArrayLike,
    from_m: float,
    to_m: float,
    frequency_hz: float,
    *,
    effective_radius_m: float = math.inf,
    polarization: Polarization = "vertical",
) -> float:
    """Loss by diffraction over one profile of ground, dB: Rec. ITU-R P.526 §4.5, delta-Bullington.

    distance_m, ground_m: (n,) in order from one antenna to the other, both ends included. from_m, to_m: altitudes of
    the antennas. effective_radius_m: k times the body's. Raises SignalError.
    """
    places_m, heights_m = np.asarray(distance_m, np.float64), np.asarray(ground_m, np.float64)
    if places_m.ndim != 1 or places_m.shape != heights_m.shape or len(places_m) < 2:
        raise SignalError("A profile needs as many distances as heights, at least two of each.")
    reach_m = float(places_m[-1] - places_m[0])
    if not (np.isfinite(places_m).all() and np.isfinite(heights_m).all() and (np.diff(places_m) >= 0.0).all()):
        raise SignalError("A profile needs finite heights, at distances that do not fall.")
    if not (reach_m > 0.0 and effective_radius_m > 0.0 and frequency_hz > 0.0):
        raise SignalError("A profile needs a length, an effective radius and a frequency > 0.")
    share = (places_m - places_m[0]) / reach_m
    bulge_m = reach_m**2 * share * (1.0 - share) / (2.0 * effective_radius_m)
    above_m = heights_m + bulge_m - (from_m + share * (to_m - from_m))
    sums = np.zeros(SUMS)
    clear_sums(sums)
    for t, height_m, over_m, round_m in zip(*map(np.ndarray.tolist, (share, heights_m, above_m, bulge_m)), strict=True):
        put_ground(sums, t, height_m, over_m, round_m)
    wavelength_m = LIGHT_M_PER_S / frequency_hz
    ends_m = (float(from_m), float(to_m))
    vertical = polarization == "vertical"
    return float(diffraction_loss(sums, reach_m, ends_m, float(effective_radius_m), wavelength_m, vertical))
