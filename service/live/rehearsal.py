"""One epoch of every kind, so that the first real one finds everything loaded."""

from __future__ import annotations

import time

from service.detectors.bench import Bench
from service.live.limits import DetectorLimits
from service.live.request import ANCHORS, RANGES, DetectorIn, EpochIn
from service.live.sessions import DetectorSession

__all__ = ["rehearse"]


def rehearse() -> None:
    """Load what a detector needs by using it, in both dimensions: a range that lies, odometry, then all ranges lie."""
    ranges = [{**measured, "range_m": measured["range_m"] + 3.0 * (n == 1)} for n, measured in enumerate(RANGES)]
    odometry = {"duration_s": 1.0, "wheel_m": (0.1, 0.0), "accelerometer_m": (0.1, 0.0, 0.0), "heading_deg": 90.0}
    for dimension in (2, 3):
        asked = DetectorIn.model_validate({"anchors": ANCHORS, "settings": {"dimension": dimension}})
        limits = DetectorLimits(len(ANCHORS), asked.settings.search_limit, 0, 1)
        session = DetectorSession("rehearsal", asked, limits, Bench(), time.monotonic, 1.0)
        for time_s in range(3):
            epoch = {"time_s": float(time_s), "ranges": ranges, "odometry": odometry if time_s else None}
            session.answer(EpochIn.model_validate(epoch))
        for time_s in range(3, 15):
            apart = [{**one, "range_m": one["range_m"] * (1.0 + 0.1 * n)} for n, one in enumerate(RANGES)]
            session.answer(EpochIn.model_validate({"time_s": float(time_s), "ranges": apart}))
        session.state()  # it looks for the cause
