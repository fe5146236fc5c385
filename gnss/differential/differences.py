"""Single differences: what two receivers measured of one satellite at one time, one less the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError

from .observations import Observations

__all__ = ["PhaseDifferences", "single_differences"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PhaseDifferences:
    """Rover less base: the satellites' clocks are gone, and over short baselines most of the atmosphere.

    time_s: (t,) common epochs, GPS time since 1980-01-06. satellites: m names. phase_cycles, code_m: (t, m), NaN where
    one of the two has none.
    """

    time_s: Array
    satellites: tuple[str, ...]
    phase_cycles: Array
    code_m: Array

    def double(self, reference: str) -> PhaseDifferences:
        """Each satellite's less the reference's: the receivers' clocks are gone too. Raises GnssInputError."""
        if reference not in self.satellites:
            raise GnssInputError(f"There is no satellite {reference} among {', '.join(self.satellites)}.")
        column = self.satellites.index(reference)
        others = [n for n in range(len(self.satellites)) if n != column]
        return PhaseDifferences(
            self.time_s,
            tuple(self.satellites[n] for n in others),
            self.phase_cycles[:, others] - self.phase_cycles[:, [column]],
            self.code_m[:, others] - self.code_m[:, [column]],
        )


def single_differences(rover: Observations, base: Observations, frequency: int = 0) -> PhaseDifferences:
    """Rover less base on one frequency (0 = L1 or its like, 1 = the second), at epochs that both have to 10 ms.

    Raises GnssInputError where they have none.
    """
    if frequency not in (0, 1):
        raise GnssInputError(f"frequency must be 0 or 1, not {frequency}.")
    of_rover, of_base = _table(rover, frequency), _table(base, frequency)
    common = sorted(of_rover.keys() & of_base.keys())
    if not common:
        raise GnssInputError(f"{rover.source} and {base.source} have no epoch in common.")
    names = tuple(sorted({name for key in common for name in of_rover[key].keys() & of_base[key].keys()}))
    phase, code = np.full((2, len(common), len(names)), np.nan)
    for row, key in enumerate(common):
        for column, name in enumerate(names):
            if name in of_rover[key] and name in of_base[key]:
                (p_r, c_r), (p_b, c_b) = of_rover[key][name], of_base[key][name]
                phase[row, column], code[row, column] = p_r - p_b, c_r - c_b
    return PhaseDifferences(np.array(common, np.float64) / 100.0, names, phase, code)


def _table(observed: Observations, frequency: int) -> dict[int, dict[str, tuple[float, float]]]:
    """By hundredths of a second, by satellite: phase and code."""
    table: dict[int, dict[str, tuple[float, float]]] = {}
    for time_s, name, phase, code in zip(
        observed.time_s,
        observed.satellite,
        observed.phase_cycles[:, frequency],
        observed.code_m[:, frequency],
        strict=True,
    ):
        table.setdefault(round(100.0 * float(time_s)), {})[str(name)] = (float(phase), float(code))
    return table
