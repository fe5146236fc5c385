"""Differential positions: observations, baselines with fixed ambiguities, masks of terrain (seed 002, 5.1.1).

Reading and the solution itself are RTKLIB's, through pyrtklib; `pip install "sightline[rtk]"` brings it.
"""

from .baseline import Baseline, BaselineSettings, Fix, solve_baseline
from .differences import PhaseDifferences, single_differences
from .horizon import HorizonMask, hidden_rows
from .observations import Observations, parse_observations, read_observations
from .orbits import Orbits, read_orbits
from .transmission import Sent, sent_by

__all__ = [
    "Baseline",
    "BaselineSettings",
    "Fix",
    "HorizonMask",
    "Observations",
    "Orbits",
    "PhaseDifferences",
    "Sent",
    "hidden_rows",
    "parse_observations",
    "read_observations",
    "read_orbits",
    "sent_by",
    "single_differences",
    "solve_baseline",
]
