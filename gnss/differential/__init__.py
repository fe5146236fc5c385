"""Differential positions: observations, baselines with fixed ambiguities, masks of terrain (seed 002, 5.1.1).

Reading and the solution itself are RTKLIB's, through pyrtklib; `pip install "sightline[rtk]"` brings it.
"""

from .baseline import Baseline, BaselineSettings, Fix, solve_baseline
from .differences import PhaseDifferences, single_differences
from .horizon import HorizonMask, hidden_rows
from .observations import Observations, parse_observations, read_observations
from .orbits import Orbits, parse_orbits, read_orbits
from .receiver_ranges import ReceiverRanges, receiver_ranges
from .transmission import Sent, sent_by

__all__ = [
    "Baseline",
    "BaselineSettings",
    "Fix",
    "HorizonMask",
    "Observations",
    "Orbits",
    "PhaseDifferences",
    "ReceiverRanges",
    "Sent",
    "hidden_rows",
    "parse_observations",
    "parse_orbits",
    "read_observations",
    "read_orbits",
    "receiver_ranges",
    "sent_by",
    "single_differences",
    "solve_baseline",
]
