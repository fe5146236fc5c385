"""An almanac: the coarse orbit of every satellite of the constellation, good for weeks."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, fields

from gnss.errors import AlmanacError
from gnss.gps_time import GpsTime

__all__ = ["REFERENCE_INCLINATION_RAD", "Almanac", "AlmanacEntry", "check_orbit", "gps_number", "satellite_id"]

# LNAV and SEM give the inclination as an offset from 0.30 semicircles
REFERENCE_INCLINATION_RAD = 0.30 * math.pi
# roots of orbit radii from the Earth's surface to a quarter of the way to the Moon
SQRT_A_RANGE = (2526.0, 10_000.0)
# no angle, rate or amplitude in its SI unit is anywhere near
LARGEST = 1e6
MOST_SATELLITES = 63


@dataclass(frozen=True, slots=True)
class AlmanacEntry:
    """One satellite of an almanac (De Vivo et al., table I), in radians, metres and seconds.

    node_longitude_rad: Ω0, longitude of the orbit plane at the start of the week of applicability.
    inclination_rad: absolute, not the offset that SEM files give.
    health: 0 = healthy; the orbit of an unhealthy one is never used and may be anything, zeros as a rule.
    svn, ura, configuration: None where the file does not tell. Raises AlmanacError.
    """

    prn: int
    applicable: GpsTime
    eccentricity: float
    inclination_rad: float
    node_rate_rad_per_s: float
    sqrt_semi_major_axis_sqrt_m: float
    node_longitude_rad: float
    argument_of_perigee_rad: float
    mean_anomaly_rad: float
    clock_bias_s: float = 0.0
    clock_drift_s_per_s: float = 0.0
    health: int = 0
    svn: int | None = None
    ura: int | None = None
    configuration: int | None = None

    def __post_init__(self) -> None:
        satellite = satellite_id(self.prn)
        if not self.healthy:
            return
        check_orbit(
            satellite, {field.name: getattr(self, field.name) for field in fields(self) if field.type == "float"}
        )
        if not 0.0 <= self.inclination_rad <= math.pi:
            raise AlmanacError(
                f"{satellite}: the inclination must lie in 0…180 deg, not {math.degrees(self.inclination_rad):g} deg."
            )

    @property
    def id(self) -> str:
        """The satellite's name, G and its number."""
        return satellite_id(self.prn)

    @property
    def healthy(self) -> bool:
        """Whether the satellite may be used."""
        return self.health == 0

    @property
    def semi_major_axis_m(self) -> float:
        """A, metres."""
        return self.sqrt_semi_major_axis_sqrt_m**2


@dataclass(frozen=True, slots=True)
class Almanac:
    """What one almanac file says; source names the file, warnings tell what in it was passed over.

    Raises AlmanacError for no entry or one satellite twice.
    """

    entries: tuple[AlmanacEntry, ...]
    source: str = ""
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.entries:
            raise AlmanacError(f"The almanac {self.source} has no satellite in it.".replace("  ", " "))
        twice = sorted(prn for prn, count in Counter(entry.prn for entry in self.entries).items() if count > 1)
        if twice:
            names = ", ".join(satellite_id(prn) for prn in twice)
            raise AlmanacError(f"Each satellite must stand once in the almanac {self.source}; repeated: {names}.")

    @property
    def healthy(self) -> tuple[AlmanacEntry, ...]:
        """The satellites that may be used, in the file's order. Raises AlmanacError where there is none."""
        usable = tuple(entry for entry in self.entries if entry.healthy)
        if not usable:
            raise AlmanacError(
                f"All {len(self.entries)} satellites of the almanac {self.source} are unhealthy; none can be used."
            )
        return usable

    @property
    def unhealthy_ids(self) -> tuple[str, ...]:
        """The satellites that are left out."""
        return tuple(entry.id for entry in self.entries if not entry.healthy)


def check_orbit(satellite: str, numbers: Mapping[str, float]) -> None:
    """Refuse numbers that make no orbit: not finite, huge, or of an ellipse that no satellite can fly.

    numbers: by field name, with eccentricity and sqrt_semi_major_axis_sqrt_m among them. Raises AlmanacError.
    """
    for name, number in numbers.items():
        if not abs(number) <= LARGEST:
            raise AlmanacError(f"{satellite}: {name} must be a finite number below {LARGEST:g}, not {number:g}.")
    if not 0.0 <= numbers["eccentricity"] < 1.0:
        raise AlmanacError(f"{satellite}: the eccentricity must satisfy 0 <= e < 1, not {numbers['eccentricity']:g}.")
    lowest, highest = SQRT_A_RANGE
    if not lowest <= numbers["sqrt_semi_major_axis_sqrt_m"] <= highest:
        raise AlmanacError(
            f"{satellite}: the square root of the semi-major axis must lie in {lowest:g}…{highest:g} √m, not "
            f"{numbers['sqrt_semi_major_axis_sqrt_m']:g}."
        )


def gps_number(number: int) -> bool:
    """Whether it is the number of a GPS satellite, not one of another system or none."""
    return 1 <= number <= MOST_SATELLITES


def satellite_id(prn: int) -> str:
    """G and two digits, as in RINEX. Raises AlmanacError for a number that no GPS satellite has."""
    if not gps_number(prn):
        raise AlmanacError(f"GPS satellites have numbers from 1 to {MOST_SATELLITES}, not {prn}.")
    return f"G{prn:02d}"
