"""Range logs of any kind as the epochs that a session is sent: what ``POST /range-logs`` answers."""

from __future__ import annotations

import math
from collections.abc import Collection
from pathlib import Path

from pydantic import BaseModel, Field

from detection import OdometryIncrement, RangeEpoch
from service.live.epoch_logs import read_epochs
from service.live.request import EpochIn, OdometryIn, RangeIn

__all__ = ["RangeLogOut", "range_log_of"]

MOST_RANGES = 200_000


class RangeLogOut(BaseModel):
    """The epochs of a log, as ``POST /detectors/{id}/epochs`` takes them."""

    epochs: list[EpochIn] = Field(description="In the order of the log.")
    told: list[str] = Field(description="What was passed over or taken otherwise than written, in sentences.")


def range_log_of(path: Path, anchor_ids: Collection[str], epoch_s: float) -> RangeLogOut:
    """The epochs of a log up to 200,000 ranges; beyond that it says so. Raises RequestError."""
    log = read_epochs(path, epoch_s, anchor_ids=anchor_ids)
    told, kept, ranges = list(log.warnings), list[EpochIn](), 0
    for epoch in log.epochs:
        ranges += len(epoch.ranges)
        if ranges > MOST_RANGES:
            told.append(f"Only the first {len(kept):,} of {len(log.epochs):,} epochs: more are for sightline detect.")
            break
        kept.append(_asked(epoch))
    return RangeLogOut(epochs=kept, told=told)


def _asked(epoch: RangeEpoch) -> EpochIn:
    ranges = [
        RangeIn.model_construct(
            anchor_id=one.anchor_id,
            range_m=one.range_m if math.isfinite(one.range_m) else None,
            sigma_m=one.sigma_m,
            p_sight=one.p_sight,
            time_s=one.time_s,
        )
        for one in epoch.ranges
    ]
    odometry = None if epoch.odometry is None else _motion(epoch.odometry)
    return EpochIn.model_construct(time_s=epoch.time_s, ranges=ranges, odometry=odometry, sequence=epoch.sequence)


def _motion(motion: OdometryIncrement) -> OdometryIn:
    return OdometryIn.model_construct(
        duration_s=motion.duration_s,
        wheel_m=motion.wheel_m,
        accelerometer_m=motion.accelerometer_m,
        heading_deg=None if motion.heading_rad is None else math.degrees(motion.heading_rad),
    )
