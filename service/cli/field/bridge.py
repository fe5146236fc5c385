"""``sightline bridge``: ranges from a live link through a detector in this process, and back what it says."""

from __future__ import annotations

import signal
import sys
import threading
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from service.errors import RequestError

from ..asking.detectors import DetectorOptions, MapOptions
from ..asking.doubts import TRUSTING
from ..asking.options import GROUP, option

if TYPE_CHECKING:
    from detection import RangingAnchor
    from service.live.bridges.bridge import Bridge
    from service.live.bridges.running import Site
    from terrain import ElevationGrid

__all__ = ["bridge"]

EVERY_S = 10.0
ADDRESS = "udp:HOST:PORT (listen), udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT (listen), serial:DEVICE:BAUD."
bridge = App(name="bridge", help="Live links: ranges in, positions and occlusions out. Runs until it is stopped.")


@GROUP
@dataclass(frozen=True, slots=True)
class SiteOptions:
    """Anchors, and where on Earth they are."""

    anchor: Annotated[
        tuple[str, ...],
        option("An anchor, metres; HEIGHT as 612msl or 660hae. Repeatable.", "ID,EAST,NORTH,HEIGHT"),
    ] = ()
    anchors: Annotated[tuple[Path, ...], option("Anchors in a .json or .csv file. Repeatable.", "FILE")] = ()
    crs: Annotated[str | None, option("Of anchors in metres, EPSG:32632: north is then made true north.", "CRS")] = None
    round: Annotated[float, option("Ranges within so many seconds are one round.", "S")] = 0.25
    estimator: Annotated[
        Literal["constant_velocity", "hypotheses"] | None,
        option("A filter that goes along: its places are sent, once it has begun."),
    ] = None
    record: Annotated[Path | None, option("Write what comes as lines that detect replays.", "FILE")] = None


@GROUP
@dataclass(frozen=True, slots=True)
class MavlinkOptions:
    """What is said over MAVLink."""

    position: Annotated[
        Literal["vision", "gps", "none"],
        option("Send VISION_POSITION_ESTIMATE, GPS_INPUT, or nothing.", "vision|gps|none"),
    ] = "vision"
    no_texts: Annotated[bool, option("Send no status texts on occlusion.")] = False
    beacons: Annotated[bool, option("Set BCN_LATITUDE, _LONGITUDE, _ALT and _ORIENT_YAW of ArduPilot.")] = False
    origin: Annotated[bool, option("Send SET_GPS_GLOBAL_ORIGIN, from which positions then count.")] = False
    targets: Annotated[bool, option("Send the anchors as ADSB_VEHICLE, once a second.")] = False
    vehicle: Annotated[int, option("MAVLink system of the vehicle.", "N")] = 1
    component: Annotated[int, option("As which component of it we speak.", "N")] = 197
    beacon: Annotated[tuple[str, ...], option("The number of a beacon that is an anchor. Repeatable.", "N=ID")] = ()
    drone: Annotated[
        tuple[str, ...], option("The system of a drone that carries an anchor. Repeatable.", "SYSTEM=ID")
    ] = ()


@bridge.command
def mavlink(
    address: Annotated[str, Parameter(name="ADDRESS", help=ADDRESS)],
    /,
    *,
    site: SiteOptions = SiteOptions(),
    said: MavlinkOptions = MavlinkOptions(),
    settings: DetectorOptions = DetectorOptions(),
    ground: MapOptions = MapOptions(),
) -> None:
    """Take ranges, odometry and positions from an autopilot or its radios, and tell it position and occlusions."""
    from service.live.bridges.running import Recorder, mavlink_bridge

    told: dict[str, object] = {
        "position": said.position,
        "texts": not said.no_texts,
        "beacons": said.beacons,
        "origin": said.origin,
        "targets": said.targets,
        "vehicle": said.vehicle,
        "system": said.vehicle,
        "component": said.component,
    }
    beacons, drones = _pairs("--beacon", said.beacon), _pairs("--drone", said.drone)
    if any(not number.isdecimal() for number in drones):
        raise RequestError("--drone takes the number of a MAVLink system, as in 12=D1.")
    place = _site(site, settings, ground)
    with _record(site.record) as file:
        made = mavlink_bridge(
            place, address, site.round, Recorder(file), told, beacons, {int(n): one for n, one in drones.items()}
        )
        _run(made, place, address)


@bridge.command
def lines(
    address: Annotated[str, Parameter(name="ADDRESS", help=ADDRESS)],
    /,
    *,
    site: SiteOptions = SiteOptions(),
    settings: DetectorOptions = DetectorOptions(),
    ground: MapOptions = MapOptions(),
) -> None:
    """Take epochs, ranges and motions as lines of JSON, and answer each epoch by a line."""
    from service.live.bridges.running import Recorder, lines_bridge

    place = _site(site, settings, ground)
    with _record(site.record) as file:
        _run(lines_bridge(place, address, site.round, Recorder(file)), place, address)


def _site(options: SiteOptions, settings: DetectorOptions, ground: MapOptions) -> Site:
    from navigation import ESTIMATORS
    from service.live.bridges.running import site_of
    from service.parts.unused import notes_on_ranging_anchors

    from ..asking.anchor_files import ranging_anchors, ranging_asked

    asked = settings.asked()
    level = asked.dimension == 2
    if not options.round > 0.0:
        raise RequestError(f"--round must be a number of seconds > 0, not {options.round}.")
    named = ranging_asked(options.anchor, options.anchors, level=level)
    placed, frame = ranging_anchors(named, level=level)
    radios = {one.id: one.radio for one in named if one.radio is not None}
    dem = ground.grid(frame, None, None, TRUSTING)
    estimator = None if options.estimator is None else ESTIMATORS[options.estimator](placed, asked.settings())
    over = None if dem is None else ground.detector(dem, placed, asked.settings(), None, estimator, radios=radios)
    if options.crs is not None and (dem is not None or frame is not None):
        raise RequestError("--crs is of anchors in metres without a DEM; these have a place on Earth already.")
    grid = dem if options.crs is None else _about(placed, options.crs)
    datum = next((one.altitude_datum for one in named if one.altitude_datum is not None), None)
    unused = notes_on_ranging_anchors(named, asked.settings().range_sigma_m, over_map=over is not None)
    site = site_of(placed, asked.settings(), frame, over, grid, datum, estimator)
    return replace(site, told=(*site.told, *unused))


def _about(anchors: list[RangingAnchor], crs: str) -> ElevationGrid:
    """A frame of that CRS about the anchors."""
    import numpy as np

    from terrain import ElevationGrid as Grid
    from terrain import parse_crs

    easts, norths = [one.east_m for one in anchors], [one.north_m for one in anchors]
    width_m, height_m = (max(max(values) - min(values), 1.0) for values in (easts, norths))
    flat = np.zeros((2, 2), np.float32)
    return Grid(flat, width_m, height_m, min(easts), min(norths) + height_m, crs=parse_crs(crs))


def _pairs(option_name: str, texts: tuple[str, ...]) -> dict[str, str]:
    found = {}
    for text in texts:
        number, equals, anchor_id = text.partition("=")
        if not (equals and number and anchor_id):
            raise RequestError(f"{option_name} {text!r} is not of the form NUMBER=ID.")
        found[number.strip()] = anchor_id.strip()
    return found


def _record(path: Path | None) -> nullcontext[IO[str] | None] | IO[str]:
    return nullcontext(None) if path is None else path.open("a", encoding="utf-8")


def _run(made: Bridge, site: Site, address: str) -> None:
    """Until it is stopped, telling on stderr how it goes."""
    stop = threading.Event()
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda *_: stop.set())
    for sentence in site.told:
        print(f"Warning: {sentence}", file=sys.stderr)
    print(f"Bridge at {address}, {len(site.anchors)} anchors.", file=sys.stderr, flush=True)
    made.run(stop, lambda: print(_state(made), file=sys.stderr, flush=True), EVERY_S)
    print(_state(made), file=sys.stderr)


def _state(made: Bridge) -> str:
    counts, link = made.counts, made.link_counts
    problem = f" Last problem: {link.problem}." if link.problem else ""
    return (
        f"{counts.epochs} epochs, {counts.ranges} ranges, {counts.occluded} occluded, {counts.positions} positions; "
        f"{counts.lost} epochs and {link.unsent} messages lost, {made.bad} bad, {link.cuts} cuts.{problem}"
    )
