"""What a way through trees costs a signal: published models, each within its own range, and a density fitted to logs.

Outside the range that a model was made for the loss is NaN, and a sentence tells it. Losses come on top of free space.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.errors import CoverError

__all__ = [
    "DB_PER_DEPTH",
    "MOST_DENSE",
    "DensityFit",
    "VegetationLoss",
    "density_loss",
    "early_itu_loss",
    "fit_density",
    "p833_slant_loss",
    "p833_woodland_loss",
    "weissberger_loss",
]

Reals = npt.NDArray[np.float64]

# 10 / ln 10: an optical depth of one, a power that falls to 1/e, in dB
DB_PER_DEPTH = 10.0 / math.log(10.0)
MHZ, GHZ = 1e6, 1e9
LONGEST_M = 400.0
MOST_DB, MOST_WAY = 1e3, 1e9  # of losses that a density is fitted to, and of their ways
MOST_DENSE = 1e6  # of a density and of a season's factor
# Rec. ITU-R P.833-10, table 1, one terminal in woodland (mixed forest near St. Petersburg): MHz, dB/m, dB
WOODLAND_MHZ = (105.9, 466.475, 949.0, 1852.2, 2117.5)
WOODLAND_DB_PER_M = (0.04, 0.12, 0.17, 0.30, 0.34)
WOODLAND_MOST_DB = (9.4, 18.0, 26.5, 29.0, 34.1)


@dataclass(frozen=True, eq=False, slots=True)
class VegetationLoss:
    """loss_db: (n,) on top of free space; NaN outside the model's range. notes: what is outside, as sentences."""

    loss_db: Reals
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class DensityFit:
    """depth_per_m: optical depth per metre of way, or per unit that ways were counted in; sigma_per_m: its error.

    rms_db: of what is left of the losses that it was fitted to; count: how many.
    """

    depth_per_m: float
    sigma_per_m: float
    rms_db: float
    count: int


def weissberger_loss(path_m: npt.ArrayLike, frequency_hz: float) -> VegetationLoss:
    """Weissberger's modified exponential decay (1982): dry, leafed trees, 0.23 to 95 GHz, up to 400 m of them."""
    way_m = _ways(path_m)
    of_frequency = (frequency_hz / GHZ) ** 0.284
    loss_db = np.where(way_m <= 14.0, 0.45 * of_frequency * way_m, 1.33 * of_frequency * way_m**0.588)
    return _within("Weissberger's model", loss_db, way_m, frequency_hz, (0.23 * GHZ, 95.0 * GHZ), LONGEST_M)


def early_itu_loss(path_m: npt.ArrayLike, frequency_hz: float) -> VegetationLoss:
    """The early ITU model, 0.2 f^0.3 d^0.6 in MHz and m (adopted by the CCIR in 1986; Seybold, 2005, ch. 7).

    Its source tells no range of validity, and the notes say so.
    """
    way_m = _ways(path_m)
    loss_db = 0.2 * (frequency_hz / MHZ) ** 0.3 * way_m**0.6
    found = _within("The early ITU model", loss_db, way_m, frequency_hz, (0.0, math.inf), math.inf)
    return VegetationLoss(found.loss_db, ("The early ITU model's source tells no range of frequencies or depths.",))


def p833_slant_loss(path_m: npt.ArrayLike, frequency_hz: float, elevation_rad: npt.ArrayLike) -> VegetationLoss:
    """Rec. ITU-R P.833-10 (09/2021) §2.2, slant paths: 0.25 f^0.39 d^0.25 θ^0.05, fitted to pine woodland in Austria.

    f in MHz, θ in degrees. The Recommendation is for 30 MHz to 100 GHz. Where the way does not rise: NaN.
    """
    way_m, up_rad = np.broadcast_arrays(_ways(path_m), np.asarray(elevation_rad, np.float64))
    up_deg = np.degrees(np.where(up_rad > 0.0, up_rad, np.nan))
    loss_db = np.where(way_m > 0.0, 0.25 * (frequency_hz / MHZ) ** 0.39 * way_m**0.25 * up_deg**0.05, 0.0)
    found = _within("ITU-R P.833 for slant paths", loss_db, way_m, frequency_hz, (30.0 * MHZ, 100.0 * GHZ), math.inf)
    level = int(np.count_nonzero((way_m > 0.0) & ~(up_rad > 0.0)))
    told = (f"ITU-R P.833 for slant paths tells nothing of {level} ways that do not rise.",) if level else ()
    return VegetationLoss(found.loss_db, (*found.notes, *told))


def p833_woodland_loss(path_m: npt.ArrayLike, frequency_hz: float) -> VegetationLoss:
    """Rec. ITU-R P.833-10 (09/2021) §2.1, one end in woodland: A·(1 - exp(-d·γ/A)).

    γ and A are by frequency from its table 1; between its 105.9 and 2117.5 MHz both are straight in the logarithms.
    """
    way_m = _ways(path_m)
    at = math.log(min(max(frequency_hz / MHZ, WOODLAND_MHZ[0]), WOODLAND_MHZ[-1]))
    known = np.log(WOODLAND_MHZ)
    per_m, most_db = (math.exp(np.interp(at, known, np.log(of))) for of in (WOODLAND_DB_PER_M, WOODLAND_MOST_DB))
    loss_db = most_db * -np.expm1(-way_m * per_m / most_db)
    limits = (WOODLAND_MHZ[0] * MHZ, WOODLAND_MHZ[-1] * MHZ)
    return _within("ITU-R P.833 for woodland", loss_db, way_m, frequency_hz, limits, math.inf)


def density_loss(path_m: npt.ArrayLike, depth_per_m: float, season: float = 1.0) -> Reals:
    """(n,) dB of a canopy of known density: 4.34 · depth · way; season: factor on the density, 1 = as it was fitted.

    Raises CoverError.
    """
    for name, value in (("depth_per_m", depth_per_m), ("season", season)):
        if not 0.0 <= value <= MOST_DENSE:
            raise CoverError(f"{name} must be a number from 0 to {MOST_DENSE:,.0f}, not {value}.")
    found: Reals = DB_PER_DEPTH * depth_per_m * season * _ways(path_m)
    return found


def fit_density(loss_db: npt.ArrayLike, path_m: npt.ArrayLike) -> DensityFit:
    """The density that explains losses (n,) along ways (n,) best, by least squares; pairs with NaN are left out.

    Losses are what one receiver in the open hears more than one under the trees, dB; losses below zero are noise and
    stay. Ways may be counted in any unit, 1/sin(elevation) for a canopy of unknown height: the density is then the
    optical depth straight up. Raises CoverError for fewer than two pairs, and for losses beyond 1,000 dB.
    """
    loss, way = np.broadcast_arrays(np.asarray(loss_db, np.float64), np.asarray(path_m, np.float64))
    known = np.isfinite(loss) & np.isfinite(way)
    loss, way = loss[known], way[known]
    if (np.abs(loss) > MOST_DB).any() or (np.abs(way) > MOST_WAY).any():
        raise CoverError(f"Losses must lie within ±{MOST_DB:,.0f} dB, and ways through trees within {MOST_WAY:,.0f} m.")
    square = float((way**2).sum())
    if len(loss) < 2 or not square > 0.0:
        raise CoverError(f"A density needs at least two losses along ways through trees, not {len(loss)}.")
    depth_per_m = float((loss * way).sum()) / square / DB_PER_DEPTH
    left_db = loss - DB_PER_DEPTH * depth_per_m * way
    sigma_db = math.sqrt(float((left_db**2).sum()) / (len(loss) - 1))
    return DensityFit(
        max(depth_per_m, 0.0),
        sigma_db / math.sqrt(square) / DB_PER_DEPTH,
        math.sqrt(float((left_db**2).mean())),
        len(loss),
    )


def _ways(path_m: npt.ArrayLike) -> Reals:
    way_m: Reals = np.asarray(path_m, np.float64)
    if (way_m < 0.0).any():
        raise CoverError("A way through trees must be >= 0 m long.")
    return way_m


def _within(
    model: str, loss_db: Reals, way_m: Reals, frequency_hz: float, limits_hz: tuple[float, float], longest_m: float
) -> VegetationLoss:
    if not (math.isfinite(frequency_hz) and frequency_hz > 0.0):
        raise CoverError(f"frequency_hz must be a number > 0, not {frequency_hz}.")
    lowest, highest = limits_hz
    # the rounding of a limit that is written in MHz is not beyond it
    if not lowest * (1.0 - 1e-12) <= frequency_hz <= highest * (1.0 + 1e-12):
        told = f"{model} is for {lowest / MHZ:g} to {highest / MHZ:g} MHz"
        return VegetationLoss(
            np.full(loss_db.shape, np.nan), (f"{told}; nothing is told at {frequency_hz / MHZ:g} MHz.",)
        )
    beyond = way_m > longest_m
    count = int(np.count_nonzero(beyond))
    notes = (f"{model} ends at {longest_m:g} m of trees; {count} longer ways have no loss told.",) if count else ()
    return VegetationLoss(np.where(beyond, np.nan, loss_db), notes)
