"""What an inertial unit's readings are worth: its noise, from datasheets or as somebody states it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from ..errors import MeasurementError

__all__ = ["IMU_PRESETS", "ImuNoise", "deg_per_h", "deg_per_sqrt_h", "milli_g"]

STANDARD_GRAVITY = 9.80665


def deg_per_sqrt_h(value: float) -> float:
    """rad/√s of an angular random walk in °/√h."""
    return math.radians(value) / 60.0


def deg_per_h(value: float) -> float:
    """rad/s of °/h."""
    return math.radians(value) / 3600.0


def milli_g(value: float) -> float:
    """m/s² of thousandths of standard gravity."""
    return value * STANDARD_GRAVITY / 1000.0


@dataclass(frozen=True)
class ImuNoise:
    """The errors of an inertial unit, one sigma of each axis.

    velocity_walk_m_per_s_sqrt_s, angle_walk_rad_per_sqrt_s: white noise of the readings. *_bias_*: at the start, and
    how it wanders with a correlation time (inf = a random walk of that sigma in an hour). *_scale: of scale factors, 0
    = they are not estimated. force_range_m_per_s2, rate_range_rad_per_s: readings from there on are saturated.
    Raises MeasurementError.
    """

    velocity_walk_m_per_s_sqrt_s: float
    angle_walk_rad_per_sqrt_s: float
    force_bias_m_per_s2: float
    rate_bias_rad_per_s: float
    force_wander_m_per_s2: float = 0.0
    rate_wander_rad_per_s: float = 0.0
    correlation_s: float = 3600.0
    force_scale: float = 0.0
    rate_scale: float = 0.0
    force_range_m_per_s2: float = math.inf
    rate_range_rad_per_s: float = math.inf

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            least_is_zero = field.name.endswith(("wander_m_per_s2", "wander_rad_per_s", "_scale"))
            if not (value > 0.0 or (least_is_zero and value == 0.0)):
                raise MeasurementError(f"{field.name} must be {'zero or more' if least_is_zero else 'above zero'}.")


IMU_PRESETS: dict[str, ImuNoise] = {
    # Analog Devices ADIS16405 rev. B: 0.2 m/s/√h, 2 °/√h, 50 mg, 3 °/s turn-on, 0.2 mg and 0.007 °/s in run
    "ADIS16405": ImuNoise(
        0.2 / 60.0,
        deg_per_sqrt_h(2.0),
        milli_g(50.0),
        math.radians(3.0),
        milli_g(0.2),
        math.radians(0.007),
        100.0,
        force_range_m_per_s2=milli_g(18_000.0),
        rate_range_rad_per_s=math.radians(350.0),
    ),
    # the unit of KF-GINS' own data, as its settings state it
    "Leador-A15": ImuNoise(
        0.03 / 60.0,
        deg_per_sqrt_h(0.003),
        15e-5,
        deg_per_h(0.027),
        15e-5,
        deg_per_h(0.027),
        4.0 * 3600.0,
        300e-6,
        300e-6,
    ),
    # the seed's navigation grade (Honeywell H764G, 0.8 nmi/h): 0.003 °/h, 0.002 °/√h, 25 µg
    "H764G": ImuNoise(milli_g(0.003), deg_per_sqrt_h(0.002), milli_g(0.025), deg_per_h(0.003)),
    # the seed's tactical grade as its Figure 4.6 has it; its section 3 prints 4 °/√h and 0.1 mg instead
    "tactical": ImuNoise(0.01 / math.sqrt(200.0), deg_per_sqrt_h(3.0), milli_g(1.0), deg_per_h(10.0)),
    # the seed's lower grade
    "lower": ImuNoise(2.0 / math.sqrt(200.0), deg_per_sqrt_h(30.0), milli_g(2.0), deg_per_h(100.0)),
}
