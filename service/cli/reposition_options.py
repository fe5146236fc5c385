"""``sightline reposition``: its options; the work is done in reposition.py."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from .options import (
    AnchorFiles,
    AnchorTexts,
    AsJson,
    Band,
    CellM,
    Crs,
    CurvatureOption,
    CurvatureWord,
    DemPath,
    HeightUnitOption,
    Kind,
    KindOption,
    LonLat,
    Measure,
    MeasureOption,
    Mode,
    ModeOption,
    Nodata,
    OutFolder,
    ReceiverHeight,
    UnknownGround,
    UnknownOption,
    VerticalDatumOption,
    reading_options,
)

__all__ = ["reposition"]


class Wanted(StrEnum):
    """What shall hold."""

    COVERAGE = "coverage"
    DOP = "dop"


class Cheapest(StrEnum):
    """Which move is the cheapest."""

    DISTANCE = "distance"
    TIME = "time"


def reposition(
    dem: DemPath,
    anchor: AnchorTexts = None,
    lonlat: LonLat = False,
    anchors: AnchorFiles = None,
    occluded: Annotated[
        list[str] | None,
        typer.Option(metavar="ID", help="An anchor that is hidden, whatever the map says. Repeatable."),
    ] = None,
    verdicts: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="detection.json of sightline detect: anchors occluded to its end join them."),
    ] = None,
    persistent: Annotated[
        float, typer.Option(metavar="S", help="How long they must have been occluded in --verdicts, seconds.")
    ] = 10.0,
    movable: Annotated[list[str] | None, typer.Option(metavar="ID", help="May move; default all. Repeatable.")] = None,
    path: Annotated[Path | None, typer.Option(metavar="FILE", help="GeoJSON LineString: the path ahead.")] = None,
    rover: Annotated[
        str | None, typer.Option(metavar="EAST,NORTH", help="Where the rover is, in place of --path.")
    ] = None,
    heading: Annotated[
        float | None, typer.Option(metavar="DEG", help="Its heading, clockwise from grid north, degrees.")
    ] = None,
    ahead: Annotated[float | None, typer.Option(metavar="M", help="So far ahead along it. (default 500)")] = None,
    receiver_height: ReceiverHeight = None,
    objective: Annotated[Wanted, typer.Option(help="What shall hold.")] = Wanted.COVERAGE,
    min_anchors: Annotated[int, typer.Option(metavar="K", help="So many anchors must be in sight.")] = 4,
    dop_limit: Annotated[float, typer.Option(metavar="NUMBER", help="A dilution below this is good enough.")] = 5.0,
    measure: MeasureOption = Measure.PDOP,
    kind: KindOption = Kind.RANGING,
    surface: Annotated[
        bool, typer.Option("--surface", help="The rover is on the ground: only its motion along it is unknown.")
    ] = False,
    share: Annotated[float, typer.Option(metavar="SHARE", help="Of the path along which it shall hold, 0..1.")] = 1.0,
    height: Annotated[
        list[float] | None, typer.Option(metavar="M", help="Height above ground to move to. Repeatable. (60, 120)")
    ] = None,
    cheapest: Annotated[Cheapest, typer.Option(help="Of which the cheapest move is taken.")] = Cheapest.DISTANCE,
    max_flight: Annotated[float | None, typer.Option(metavar="M", help="Longest flight of one move.")] = None,
    speed: Annotated[float | None, typer.Option(metavar="M/S", help="Of drones, level. (default 12)")] = None,
    climb: Annotated[float | None, typer.Option(metavar="M/S", help="Of drones, upwards. (default 3)")] = None,
    descent: Annotated[float | None, typer.Option(metavar="M/S", help="Of drones, downwards. (default 2)")] = None,
    clearance: Annotated[float | None, typer.Option(metavar="M", help="Kept above the ground. (default 20)")] = None,
    no_fly: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="GeoJSON polygons not to fly over. Repeatable.")
    ] = None,
    max_agl: Annotated[float | None, typer.Option(metavar="M", help="Ceiling above ground.")] = None,
    max_altitude: Annotated[float | None, typer.Option(metavar="M", help="Ceiling as an altitude.")] = None,
    max_range: Annotated[float | None, typer.Option(metavar="M", help="Longest range that is measured.")] = None,
    separation: Annotated[float | None, typer.Option(metavar="M", help="Least distance between anchors.")] = None,
    stretch: Annotated[
        float | None, typer.Option(metavar="M", help="Plan moves stretch by stretch of so many metres: leapfrog.")
    ] = None,
    rover_speed: Annotated[float | None, typer.Option(metavar="M/S", help="Of the rover. (default 1)")] = None,
    request: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The request as JSON, as over HTTP, in place of all the above.")
    ] = None,
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    vertical_datum: VerticalDatumOption = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Find which drone should move where, at the least flight, so that what is asked for holds along the way ahead.

    Writes reposition.json, moves.geojson, schedule.csv, anchors.csv, plans.zip
    with a .plan for each drone that moves, and map.png into --out.
    """
    from service.products.repositionings.request import RepositioningParameters

    from .maps import anchors_of
    from .place import GoalOptions, RuleOptions
    from .reposition import RoverOptions, lasting_occlusions, make_repositioning
    from .request_files import given, request_from_file
    from .shape_files import path_fields

    if request is not None:
        asked = request_from_file(request, RepositioningParameters, instead=("detector_id", "persistent_s"))
    else:
        standing = anchors_of(anchor or [], anchors or [], lonlat=lonlat)
        lasting = [] if verdicts is None else lasting_occlusions(verdicts, persistent)
        ids = {one.id for one in standing}
        hidden = [*(occluded or []), *(one for one in lasting if one in ids)]
        fields = {
            "anchors": standing,
            "occluded": list(dict.fromkeys(hidden)),
            "movable": movable,
            "path": None if path is None else path_fields(path),
            "rover": RoverOptions(rover, heading, ahead).fields(lonlat=lonlat),
            "receiver_above_ground_m": receiver_height,
            "goal": GoalOptions(objective.value, min_anchors, dop_limit, measure.value, kind.value, surface).fields(),
            "share": share,
            "heights_above_ground_m": height or None,
            "cheapest": cheapest.value,
            "flight": given(
                {
                    "speed_m_per_s": speed,
                    "climb_m_per_s": climb,
                    "descent_m_per_s": descent,
                    "clearance_m": clearance,
                    "max_flight_m": max_flight,
                }
            ),
            "rules": RuleOptions(no_fly or [], max_agl, max_altitude, max_range, separation).fields(lonlat=lonlat),
            "stretch_m": stretch,
            "rover_m_per_s": rover_speed,
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
        }
        asked = RepositioningParameters.model_validate(given(fields))
    make_repositioning(
        dem,
        asked,
        reading=reading_options(nodata, crs, height_unit, band, cell_m, vertical_datum),
        out=out,
        as_json=as_json,
    )
