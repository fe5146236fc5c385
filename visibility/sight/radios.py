"""Radios: what is sent, what is lost in free space, what is needed, and how likely it arrives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from visibility.errors import SignalError

__all__ = ["LIGHT_M_PER_S", "RADIOS", "Polarization", "Radio", "arrival_probability", "free_space_loss_db"]

Reals = npt.NDArray[np.float64]
Polarization = Literal["vertical", "horizontal"]

LIGHT_M_PER_S = 299_792_458.0
# Rec. ITU-R P.526 and P.525 as they are used here
LOWEST_HZ, HIGHEST_HZ = 30e6, 100e9

_erfc = np.vectorize(math.erfc, otypes=[np.float64])


@dataclass(frozen=True, slots=True)
class Radio:
    """The budget of a link: from the power into an antenna to what the receiver at the other end needs.

    frequency_hz: 30 MHz to 100 GHz. transmit_power_dbm: into the antenna. transmit_gain_dbi, receive_gain_dbi: of both
    antennas, the same in all directions that the anchor's antenna limits allow. losses_db: cables, body, polarisation.
    sensitivity_dbm: power at which the receiver still measures a range. spread_db: one-sigma of what the models leave
    out, single trees, reflections, fading; around it the power is log-normal. Raises SignalError.
    """

    frequency_hz: float
    transmit_power_dbm: float
    sensitivity_dbm: float
    transmit_gain_dbi: float = 0.0
    receive_gain_dbi: float = 0.0
    losses_db: float = 0.0
    spread_db: float = 6.0
    polarization: Polarization = "vertical"

    def __post_init__(self) -> None:
        for name in (
            "frequency_hz",
            "transmit_power_dbm",
            "sensitivity_dbm",
            "transmit_gain_dbi",
            "receive_gain_dbi",
            "losses_db",
            "spread_db",
        ):
            if not math.isfinite(getattr(self, name)):
                raise SignalError(f"A radio's {name} must be a finite number, not {getattr(self, name)}.")
        if not LOWEST_HZ <= self.frequency_hz <= HIGHEST_HZ:
            raise SignalError(
                f"A radio's frequency_hz must lie between {LOWEST_HZ:g} and {HIGHEST_HZ:g}, "
                f"not be {self.frequency_hz:g}."
            )
        for name in ("losses_db", "spread_db"):
            if getattr(self, name) < 0.0:
                raise SignalError(f"A radio's {name} must be >= 0, not {getattr(self, name)}.")
        if self.polarization not in get_args(Polarization):
            raise SignalError(f"polarization must be one of {', '.join(get_args(Polarization))}.")

    @property
    def wavelength_m(self) -> float:
        """Wavelength in free space."""
        return LIGHT_M_PER_S / self.frequency_hz

    @property
    def allowed_loss_db(self) -> float:
        """What may be lost between the antennas before the receiver hears too little."""
        gains_db = self.transmit_gain_dbi + self.receive_gain_dbi - self.losses_db
        return self.transmit_power_dbm + gains_db - self.sensitivity_dbm


# Typical budgets, each with where its numbers come from.
RADIOS: dict[str, Radio] = {
    # -41.3 dBm/MHz over 499.2 MHz (47 CFR 15.519; ETSI EN 302 065); DWM1000 data sheet, table 8: 6.8 Mbit/s, 1 % lost
    "uwb": Radio(6489.6e6, -14.3, -93.0),
    # 100 mW e.i.r.p. (ETSI EN 300 328); what IEEE 802.15.4 requires of a receiver at 2450 MHz
    "2.4GHz": Radio(2440e6, 20.0, -85.0),
    # 25 mW e.r.p. = 16.15 dBm e.i.r.p. (ETSI EN 300 220); SX1276 data sheet: LoRa, factor 7, 125 kHz
    "868MHz": Radio(868e6, 14.0, -123.0, transmit_gain_dbi=2.15),
    # 1 W (47 CFR 15.247); the same receiver
    "915MHz": Radio(915e6, 30.0, -123.0),
    # IS-GPS-200: at least -128.5 dBm on the ground at 5° elevation, 25 240 km off; 15 dB-Hz is -160 dBm (Soloviev
    # et al. 2008)
    "gnss-l1": Radio(1575.42e6, 55.9, -160.0),
}


def free_space_loss_db(distance_m: npt.ArrayLike, frequency_hz: float) -> Reals:
    """(n,) loss between isotropic antennas in free space, dB: 20 lg(4 π d / λ), Rec. ITU-R P.525; 0 nearer than λ/4π.

    distance_m: (n,) straight distances, metres.
    """
    turns = 4.0 * math.pi * frequency_hz / LIGHT_M_PER_S * np.asarray(distance_m, np.float64)
    loss_db: Reals = 20.0 * np.log10(np.maximum(turns, 1.0))
    return loss_db


def arrival_probability(margin_db: npt.ArrayLike, spread_db: float) -> Reals:
    """(n,) probability that enough power arrives: Phi(margin / spread), without spread 1 from 0 dB on; NaN stays."""
    margin = np.asarray(margin_db, np.float64)
    if spread_db == 0.0:
        return np.where(np.isnan(margin), np.nan, (margin >= 0.0).astype(np.float64))
    found: Reals = _erfc(-margin / (spread_db * math.sqrt(2.0))) / 2.0
    return found
