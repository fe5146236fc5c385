"""A bridge put together: anchors and detector, the frame on Earth, a codec, a record of what came."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import IO

from detection import Detector, DetectorSettings, RangeEpoch, RangingAnchor
from gnss import Place
from navigation import Estimator
from planning.watching import MapDetector, WatchedEpoch
from service.errors import RequestError
from service.files.mission_files import sea_level_m
from service.live.watching import MaybeMapped
from terrain import ElevationGrid, VerticalDatumError, egm96_height_m

from .bridge import Asked, Bridge, Codec
from .lines import LineCodec
from .rounds import Rounds
from .transports import transport_of
from .true_north import GridFrame, LocalFrame, NedOrigin, TrueFrame, Unplaced, origin_of

__all__ = ["Recorder", "Site", "lines_bridge", "mavlink_bridge", "site_of"]


@dataclass(frozen=True, slots=True)
class Site:
    """Anchors, their frame on Earth, and the detector. told: what is to be known of heights and north, in sentences."""

    anchors: tuple[RangingAnchor, ...]
    detector: MaybeMapped
    frame: TrueFrame | Unplaced
    origin: NedOrigin
    geoid_m: float
    told: tuple[str, ...]


def site_of(
    anchors: Sequence[RangingAnchor],
    settings: DetectorSettings,
    middle: Mapping[str, float] | None,
    mapped: MapDetector | None,
    grid: ElevationGrid | None,
    datum: str | None,
    estimator: Estimator | None = None,
) -> Site:
    """A site of anchors. middle: lon_deg, lat_deg, up_m of the place that metres count from, of anchors in degrees.

    grid: of their CRS, for metres of a map. datum: of their altitudes, msl where none is told. estimator: a fresh
    filter that goes along, that of mapped where there is one. Raises FrameError.
    """
    told: list[str] = []
    frame: TrueFrame | Unplaced = Unplaced()
    ellipsoid = datum == "hae"
    if middle is not None:
        frame = LocalFrame(Place(middle["lon_deg"], middle["lat_deg"], middle["up_m"]))
    elif grid is not None and grid.crs is not None:
        frame = GridFrame(grid)
    else:
        told.append("Nobody knows where the anchors are on Earth: their north is taken for true north, and nothing in "
                    "degrees is sent. Give them in degrees, or say --crs or --dem.")  # fmt: skip
    origin = origin_of(frame, anchors, ellipsoid)
    if grid is not None and mapped is not None and isinstance(frame, GridFrame):
        origin, more = _above_sea(origin, grid)
        told += more
    geoid_m = 0.0
    if origin.lon_deg is not None and origin.lat_deg is not None:
        geoid_m = float(egm96_height_m([origin.lon_deg], [origin.lat_deg])[0])
    detector = MaybeMapped(Detector(anchors, settings) if mapped is None else mapped, estimator)
    return Site(tuple(anchors), detector, frame, origin, geoid_m, (*told, *detector.warnings))


def _above_sea(origin: NedOrigin, grid: ElevationGrid) -> tuple[NedOrigin, list[str]]:
    try:
        above_sea_m = float(sea_level_m(grid, origin.at_m[0], origin.at_m[1], origin.at_m[2])[0])
    except VerticalDatumError as error:
        return origin, [f"{error} Its heights are taken as above mean sea level."]
    return NedOrigin(origin.frame, origin.at_m, origin.lon_deg, origin.lat_deg, above_sea_m - origin.at_m[2]), []


class Recorder:
    """Writes each epoch as a line that ``detect`` replays. Raises OSError."""

    def __init__(self, file: IO[str] | None) -> None:
        self._file = file

    def judged(self, asked: Asked, watched: WatchedEpoch) -> None:
        """One epoch, as it came."""
        if self._file is not None:
            self._file.write(f"{json.dumps(_as_told(asked.epoch))}\n")
            self._file.flush()


def _as_told(epoch: RangeEpoch) -> dict[str, object]:
    """The fields of a stream's message; what is no number is null."""
    told: dict[str, object] = {
        "time_s": epoch.time_s,
        "ranges": [
            {name: _number(value) for name, value in asdict(one).items() if name == "range_m" or value is not None}
            for one in epoch.ranges
        ],
    }
    if epoch.sequence is not None:
        told["sequence"] = epoch.sequence
    if epoch.odometry is not None:
        fields = {name: value for name, value in asdict(epoch.odometry).items() if value is not None}
        heading_rad = fields.pop("heading_rad", None)
        told["odometry"] = fields | ({} if heading_rad is None else {"heading_deg": heading_rad * 57.29577951308232})
    if epoch.moved:
        told["moved"] = [asdict(anchor) for anchor in epoch.moved]
    return told


def _number(value: object) -> object:
    return None if isinstance(value, float) and value != value else value


def lines_bridge(site: Site, address: str, round_s: float, recorder: Recorder) -> Bridge:
    """A bridge of lines of JSON. Raises RequestError."""
    ids = [anchor.id for anchor in site.anchors]
    codec: Codec = LineCodec(ids, Rounds(ids, round_s))
    return Bridge(transport_of(address), codec, site.detector.process, recorder.judged)


def mavlink_bridge(
    site: Site,
    address: str,
    round_s: float,
    recorder: Recorder,
    told: Mapping[str, object],
    ids: Mapping[str, str],
    drones: Mapping[int, str],
) -> Bridge:
    """A bridge of MAVLink. told: fields of ``Told``; ids: numbers of beacons to anchors; drones: systems to anchors.

    Raises RequestError, also where pymavlink is missing.
    """
    transport = transport_of(address)
    try:
        from .mavlink import Drones, MavlinkCodec
        from .mavlink_out import Outgoing, Told
    except ImportError as error:
        raise RequestError("MAVLink needs pymavlink: pip install 'sightline[logs]'.") from error
    known = [anchor.id for anchor in site.anchors]
    strange = sorted({*ids.values(), *drones.values()} - set(known))
    if strange:
        raise RequestError(f"There is no anchor {strange[0]!r}; there are {', '.join(known[:12])}.")
    outgoing = Outgoing(Told(**told), site.origin, site.anchors)  # type: ignore[arg-type] # fields of the options, by name
    flying = Drones(drones, site.frame, -site.origin.sea_level_m, site.geoid_m)
    codec: Codec = MavlinkCodec(site.anchors, Rounds(known, round_s), outgoing, ids, flying)
    return Bridge(transport, codec, site.detector.process, recorder.judged)
