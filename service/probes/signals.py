"""The signals of anchors at places, and how probes and profiles tell one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import Anchor, Curvature
from visibility.sight.minimum_altitude import UnknownGround
from visibility.signal import Signals, signals

from .request import SignalTold

__all__ = ["anchor_signals", "signal_told"]

Floats = npt.NDArray[np.float64]


def anchor_signals(
    grid: ElevationGrid,
    anchors: Sequence[Anchor],
    receivers_m: Floats,
    curvature: Curvature,
    unknown: UnknownGround,
) -> tuple[Signals | None, ...]:
    """Of each anchor its signals at receivers (n, 3) east, north, altitude; None where it has no radio."""
    found: list[Signals | None] = []
    for anchor in anchors:
        if anchor.radio is None:
            found.append(None)
            continue
        from_m = np.broadcast_to((anchor.east_m, anchor.north_m, anchor.altitude_m), receivers_m.shape)
        found.append(signals(grid, from_m, receivers_m, anchor.radio, curvature=curvature, unknown=unknown))
    return tuple(found)


def signal_told(heard: Signals | None, line: int) -> SignalTold | None:
    """The signal of one of many links; None without any."""
    if heard is None:
        return None
    return SignalTold.model_construct(
        free_space_db=float(heard.free_space_db[line]),
        diffraction_db=_number(heard.diffraction_db[line]),
        canopy_m=_number(heard.canopy_m[line]),
        canopy_db=_number(heard.canopy_db[line]),
        received_dbm=_number(heard.received_dbm[line]),
        margin_db=_number(heard.margin_db[line]),
        probability=_number(heard.probability[line]),
    )


def _number(value: float | np.floating) -> float | None:
    return float(value) if math.isfinite(value) else None
