"""What aided channels measured, told and written: a summary by satellite, and a row for each interval as CSV."""

from __future__ import annotations

import importlib.metadata
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import BaseModel, Field

from gnss import ReceiverClock
from gnss.receiver import ChannelMeasurement

from .csv_table import TableWriter

__all__ = ["ChannelSummary", "SatelliteOut", "summary_of", "write_channels"]

COLUMNS = (
    *("time_s", "prn", "integration_s", "detected", "pseudorange_m", "pseudorange_sigma_m", "doppler_hz"),
    *("doppler_sigma_hz", "carrier_cycles", "carrier_sigma_cycles", "cn0_db_hz", "bits"),
)


class SatelliteOut(BaseModel):
    """What was expected of one satellite, and what was found."""

    prn: int
    elevation_deg: float = Field(description="Above the horizontal at the beginning, degrees.")
    azimuth_deg: float = Field(description="Clockwise from north, degrees.")
    expected_loss_db: float | None = Field(description="In trees, by the map; null without one.")
    hidden: bool = Field(description="Whether the map has ground or buildings in the way; it is not looked for then.")
    integration_s: float = Field(description="How long is summed, seconds; the longest interval.")
    intervals: int = Field(description="That were measured.")
    detected: int = Field(description="Intervals in which it is above the threshold.")
    cn0_db_hz: float | None = Field(description="Median of those detected; null where there is none.")


class ChannelSummary(BaseModel):
    """A tracked recording in numbers."""

    version: str
    source: str
    satellites: list[SatelliteOut]
    acquired: list[int] = Field(description="Satellites that told the receiver's clock; none where it was given.")
    clock_s: float = Field(description="Receiver's clock ahead of the stated time in the first interval, seconds.")
    clock_drift: float = Field(description="Its drift in the last interval, seconds per second.")
    warnings: list[str]


def summary_of(
    told: Sequence[ChannelMeasurement],
    sky: Sequence[SatelliteOut],
    clocks: Sequence[ReceiverClock],
    acquired: Sequence[int],
    source: str,
    warnings: Sequence[str],
) -> ChannelSummary:
    """The recording in numbers."""
    satellites = []
    for one in sky:
        rows = [row for row in told if row.prn == one.prn]
        strong = [row.cn0_db_hz for row in rows if row.detected and math.isfinite(row.cn0_db_hz)]
        found = {
            "intervals": len(rows),
            "detected": sum(row.detected for row in rows),
            # a recording may be shorter than what was asked for
            "integration_s": round(max((row.duration_s for row in rows), default=one.integration_s), 6),
            "cn0_db_hz": float(np.median(strong)) if strong else None,
        }
        satellites.append(one.model_copy(update=found))
    return ChannelSummary(
        version=importlib.metadata.version("sightline"),
        source=source,
        satellites=satellites,
        acquired=list(acquired),
        clock_s=clocks[0].offset_s,
        clock_drift=clocks[-1].drift,
        warnings=list(warnings),
    )


def write_channels(told: Sequence[ChannelMeasurement], summary: ChannelSummary, folder: Path) -> None:
    """channels.csv and receiver.json; times count from the first sample, by the receiver's clock."""
    with (folder / "channels.csv").open("w", encoding="utf-8", newline="") as file:
        writer = TableWriter(file)
        writer.row(COLUMNS)
        for row in told:
            writer.row(
                [
                    f"{row.middle_s:.6f}",
                    row.prn,
                    f"{row.duration_s:g}",
                    int(row.detected),
                    f"{row.pseudorange_m:.3f}",
                    _finite(row.pseudorange_sigma_m, 3),
                    f"{row.doppler_hz:.4f}",
                    _finite(row.frequency_sigma_hz, 4),
                    f"{row.carrier_cycles:.4f}",
                    _finite(row.phase_sigma_rad / (2.0 * math.pi), 4),
                    _finite(row.cn0_db_hz, 2),
                    "".join("1" if bit > 0 else "0" for bit in row.bits),
                ]
            )
    (folder / "receiver.json").write_text(summary.model_dump_json(indent=1), encoding="utf-8")


def _finite(value: float, digits: int) -> str:
    """Empty where the measurement tells none."""
    return f"{value:.{digits}f}" if math.isfinite(value) else ""
