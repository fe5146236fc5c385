"""``sightline receiver track``: aided channels through a recording whose trajectory is known."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.table import Table

from service.errors import RequestError

from ..asking.options import GROUP, Output, Reading, option
from ..asking.recordings import SampleFile, SampleOptions, satellite_numbers
from ..asking.texts import numbers_of
from ..output import facts_table, leaving_nothing_new, output_folder, print_json, print_tables, print_warnings

if TYPE_CHECKING:
    from gnss.receiver import Aiding, ChannelMeasurement, Samples
    from service.files.channel_files import ChannelSummary, SatelliteOut

__all__ = ["track"]

FILES = ("channels.csv", "receiver.json")
LISTENED_S = 0.1  # for the receiver's clock
SPREAD_DB = 5.0  # by which models of trees err from satellite to satellite (docs/signal.md)
PLACES = 10  # along the way, at which the map is asked
CELLS = 200  # of delay and frequency, about


@GROUP
@dataclass(frozen=True, slots=True)
class AidingOptions:
    """What foretells the replicas."""

    navigation: Annotated[Path | None, option("RINEX navigation file of that time. Required.", "FILE")] = None
    time: Annotated[
        str | None, option("UTC of the file's first sample, such as 2014-12-20T00:00:27Z. Required.", "ISO8601")
    ] = None
    trajectory: Annotated[
        Path | None,
        option("CSV of time_s from the first sample on, and x_m,y_m,z_m or lon_deg,lat_deg,height_m.", "FILE"),
    ] = None
    at: Annotated[str | None, option("Instead: where the antenna stood, height above the ellipsoid.", "LON,LAT,H")] = (
        None
    )
    lever_arm: Annotated[
        str | None, option("From there to the antenna, forward, left, up, metres.", "FORWARD,LEFT,UP")
    ] = None
    clock_s: Annotated[
        float | None, option("Receiver's clock ahead of --time. (default found by acquisition)", "S", "--clock")
    ] = None
    drift: Annotated[float, option("With --clock: its drift, seconds per second.", "NUMBER", "--clock-drift")] = 0.0


@GROUP
@dataclass(frozen=True, slots=True)
class ChannelOptions:
    """How satellites are chosen and summed."""

    prn: Annotated[str | None, option("Satellites. (default all above the mask)", "N,N,…")] = None
    mask_deg: Annotated[float, option("Lower ones are left out, degrees.", "DEG", "--mask")] = 5.0
    integration_s: Annotated[
        float | None, option("0.02 to 1. (default 1, with --dem by what is expected)", "S", "--integration")
    ] = None
    reach_hz: Annotated[float, option("How far a carrier may be from what is foretold.", "HZ", "--reach")] = 2.0
    seconds: Annotated[float | None, option("How much of the file. (default all)", "S")] = None
    false_alarm: Annotated[float, option("Probability that noise is taken for one satellite.", "P")] = 1e-3


@GROUP
@dataclass(frozen=True, slots=True)
class TerrainOptions:
    """The map: what it hides is not looked for, and trees on it set how long is summed."""

    dem: Annotated[str | None, option("Ground, and with --canopy trees, about the receiver.", "FILE")] = None
    antenna_height: Annotated[float, option("Above the ground, metres.", "M")] = 2.0
    open_sky_db_hz: Annotated[float, option("C/N0 where nothing is in the way.", "DB_HZ", "--open-sky")] = 42.0


def track(
    path: SampleFile,
    /,
    *,
    samples: SampleOptions,
    aiding: AidingOptions = AidingOptions(),
    channels: ChannelOptions = ChannelOptions(),
    terrain: TerrainOptions = TerrainOptions(),
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Measure satellites through a recording along a known trajectory.

    Pseudorange, Doppler, carrier phase, C/N0 and data bits of each satellite and interval, channels.csv and
    receiver.json into --out. Exit code 2 where none is detected.
    """
    from gnss.receiver import find_clock, recorded_s, track
    from service.files.channel_files import summary_of

    if terrain.dem is None and (reading != Reading() or terrain != TerrainOptions()):
        raise RequestError("Options of the map go with --dem.")
    duration_s = channels.seconds
    if duration_s is None:
        duration_s = recorded_s(path, samples.rate_hz, samples.type, samples.start_s)
    asked, warnings = _aiding(samples, aiding)
    sky = _sky(asked, channels, terrain, reading, duration_s, warnings)
    prns = [one.prn for one in sky if not one.hidden]
    if not prns:
        raise RequestError("No satellite is left to look for: all are below the mask, hidden, or not in the file.")

    def read(begin_s: float, span_s: float) -> Samples:
        found = samples.read(path, span_s, begin_s)
        warnings.extend(one for one in found.warnings if one not in warnings)
        return found

    acquired: list[int] = []
    if aiding.clock_s is None:
        clock, agreed = find_clock(read(0.0, min(duration_s, LISTENED_S)), asked, prns)
        asked, acquired = dataclasses.replace(asked, clock=clock), [one.prn for one in agreed]
    told: list[ChannelMeasurement] = []
    clocks = []
    for rows, used in track(
        read,
        asked,
        prns,
        duration_s,
        integrations_s={one.prn: one.integration_s for one in sky},
        reach_hz=channels.reach_hz,
        false_alarm=channels.false_alarm,
    ):
        told += rows
        clocks.append(used.clock)
    if not any(one.detected for one in told):
        raise RequestError(
            f"No satellite of {len(prns)} is detected in {1e3 * duration_s:.4g} ms; are --time, the trajectory, "
            "--rate, --type and --clock right?"
        )
    _tell(told, summary_of(told, sky, clocks, acquired, path.name, warnings), output)


def _tell(told: Sequence[ChannelMeasurement], summary: ChannelSummary, output: Output) -> None:
    from service.files.channel_files import write_channels

    if output.out is not None:
        folder = output_folder(output.out, FILES)
        with leaving_nothing_new(folder, FILES):
            write_channels(told, summary, folder)
    if output.as_json:
        print_json(summary.model_dump(mode="json"))
        return
    table = Table(title=summary.source, title_justify="left")
    for column in ("PRN", "elevation", "summed", "detected", "C/N0 dB-Hz", "expected loss"):
        table.add_column(column, justify="right")
    for one in summary.satellites:
        found = "hidden" if one.hidden else f"{one.detected} of {one.intervals}"
        summed = "" if one.hidden else f"{one.integration_s:g} s"
        strength = "–" if one.cn0_db_hz is None else f"{one.cn0_db_hz:.1f}"
        loss = "–" if one.expected_loss_db is None else f"{one.expected_loss_db:.1f} dB"
        table.add_row(str(one.prn), f"{one.elevation_deg:.0f}°", summed, found, strength, loss)
    by = f", by {', '.join(map(str, summary.acquired))}" if summary.acquired else ", as told"
    facts = [("ahead", f"{1e6 * summary.clock_s:.3f} µs{by}"), ("drift", f"{1e9 * summary.clock_drift:.2f} ns/s")]
    print_tables(table, facts_table("The receiver's clock", facts))
    print_warnings(summary.warnings)


def _aiding(samples: SampleOptions, options: AidingOptions) -> tuple[Aiding, list[str]]:
    """What aids, with the clock that was given or none yet; warnings."""
    import numpy as np

    from gnss import GpsTime, Place, ReceiverClock, place_ecef_m, read_rinex_navigation
    from gnss.receiver import Aiding
    from service.files.trajectory_file import read_trajectory

    if options.navigation is None or options.time is None or (options.trajectory is None) == (options.at is None):
        raise RequestError("Aiding needs --navigation, --time, and one of --trajectory and --at.")
    if options.clock_s is None and options.drift != 0.0:
        raise RequestError("--clock-drift goes with --clock.")
    try:
        utc = datetime.fromisoformat(options.time)
    except ValueError as fault:
        raise RequestError(
            f"--time {options.time!r} is no ISO 8601 time with its offset, such as 2014-12-20T00:00:27Z."
        ) from fault
    orbits = read_rinex_navigation(options.navigation)
    warnings = list(orbits.warnings)
    if options.at is not None:
        if options.lever_arm is not None:
            raise RequestError("--lever-arm goes with --trajectory; --at is the antenna's own place.")
        place = Place(*_three(options.at, "--at", "LON,LAT,H: degrees, and metres above the ellipsoid"))
        times_s, antennas_m = np.zeros(1), place_ecef_m(place)[None]
    else:
        assert options.trajectory is not None, "one of the two was given"
        arm_m = _three(options.lever_arm or "0,0,0", "--lever-arm", "FORWARD,LEFT,UP in metres")
        times_s, antennas_m, unused = read_trajectory(options.trajectory, arm_m)
        times_s, warnings = times_s - samples.start_s, warnings + unused
    clock = ReceiverClock(options.clock_s or 0.0, options.drift)
    return Aiding(orbits, GpsTime.of_utc(utc).plus(samples.start_s), times_s, antennas_m, clock), warnings


def _sky(
    aiding: Aiding,
    channels: ChannelOptions,
    terrain: TerrainOptions,
    reading: Reading,
    duration_s: float,
    warnings: list[str],
) -> list[SatelliteOut]:
    """The satellites that may be there, from the highest down, and how long each is summed: where it is weakest."""
    import numpy as np

    from gnss import ephemeris_positions_ecef_m, instants, look_angles
    from gnss.receiver import BIT_S, bits_needed
    from gnss.sky import place_of_ecef
    from service.files.channel_files import SatelliteOut
    from visibility.satellites import expected_sky

    names = aiding.ephemerides.healthy_ids
    if channels.prn is not None:
        names = tuple(f"G{prn:02d}" for prn in satellite_numbers(channels.prn))
        missing = [name for name in names if name not in aiding.ephemerides.healthy_ids]
        if missing:
            raise RequestError(f"The navigation file has no healthy ephemeris of {', '.join(missing)}.")
    place = place_of_ecef(np.asarray(aiding.antennas_ecef_m)[0])
    seen = look_angles(place, ephemeris_positions_ecef_m(aiding.ephemerides, names, instants(aiding.start))[:, 0])
    high = np.flatnonzero(seen.elevation_rad > math.radians(channels.mask_deg))
    high = high[np.argsort(-seen.elevation_rad[high])]
    hidden, loss_db = np.zeros(len(high), bool), np.zeros(len(high))
    if terrain.dem is not None:
        grid, angles = reading.read(terrain.dem), (seen.azimuth_rad[high], seen.elevation_rad[high])
        moments = np.linspace(0.0, duration_s, PLACES if len(np.asarray(aiding.times_s)) > 1 else 1)
        told = [
            expected_sky(grid, place_of_ecef(antenna_m), *angles, terrain.antenna_height)
            for antenna_m in aiding.antennas_m(moments)
        ]
        hidden = np.all([one.hidden for one in told], axis=0)
        loss_db = np.max([np.where(one.hidden & ~hidden, 0.0, one.loss_db) for one in told], axis=0)
        warnings += sorted({note for one in told for note in one.warnings})
    satellites = []
    for row, behind, loss in zip(high, hidden, loss_db, strict=True):
        integration_s = 1.0 if channels.integration_s is None else channels.integration_s
        if channels.integration_s is None and terrain.dem is not None and math.isfinite(loss):
            integration_s = bits_needed(terrain.open_sky_db_hz - loss - SPREAD_DB, cells=CELLS) * BIT_S
        satellites.append(
            SatelliteOut(
                prn=int(names[row][1:]),
                elevation_deg=math.degrees(seen.elevation_rad[row]),
                azimuth_deg=math.degrees(seen.azimuth_rad[row]),
                expected_loss_db=float(loss) if terrain.dem is not None and math.isfinite(loss) else None,
                hidden=bool(behind),
                integration_s=integration_s,
                intervals=0,
                detected=0,
                cn0_db_hz=None,
            )
        )
    return satellites


def _three(text: str, name: str, form: str) -> list[float]:
    numbers = numbers_of(text)
    if numbers is None or len(numbers) != 3:
        raise RequestError(f"{name} {text!r} is not of the form {form}.")
    return numbers
