"""``sightline fly``: its options; the work is done in fly.py."""

from __future__ import annotations

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
    DemPath,
    HeightUnitOption,
    Kind,
    Measure,
    Mode,
    Nodata,
    OutFolder,
    VerticalDatumOption,
    reading_options,
)

__all__ = ["fly"]

POINT = "EAST,NORTH,HEIGHT"


def fly(
    dem: DemPath,
    start: Annotated[
        str | None, typer.Option(metavar=POINT, help="Where the drone is; HEIGHT 80agl or 612msl. Required.")
    ] = None,
    goal: Annotated[str | None, typer.Option(metavar=POINT, help="Where it shall be. Required.")] = None,
    map: Annotated[
        Path | None, typer.Option(metavar="FILE", help="morph.json: stay above its map and below its ceiling.")
    ] = None,
    anchor: AnchorTexts = None,
    lonlat: Annotated[bool, typer.Option("--lonlat", help="All pairs are longitude,latitude.")] = False,
    anchors: AnchorFiles = None,
    dop_limit: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Of the morphing map of these anchors. (default 2.5)")
    ] = None,
    min_anchors: Annotated[int | None, typer.Option(metavar="K", help="So many must be in sight there too.")] = None,
    kind: Annotated[Kind | None, typer.Option(help="What is measured. (default ranging)")] = None,
    measure: Annotated[Measure | None, typer.Option(help="Which dilution of precision. (default pdop)")] = None,
    mode: Annotated[Mode | None, typer.Option(help="How its sight lines are calculated. (default fast)")] = None,
    ceiling: Annotated[
        str | None,
        typer.Option(metavar="HEIGHT", help="Top of the air, 2500msl or 300agl; anchors need one."),
    ] = None,
    bubble: Annotated[
        float | None, typer.Option(metavar="M", help="Distance kept from all ground, metres. (default 20)")
    ] = None,
    climb_weight: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="What a metre of climb costs besides its way. (default 1)")
    ] = None,
    speed: Annotated[float | None, typer.Option(metavar="M/S", help="Of the drone. (default 12)")] = None,
    iterations: Annotated[int | None, typer.Option(metavar="N", help="Of the planner. (default 20000)")] = None,
    time_limit: Annotated[float | None, typer.Option(metavar="S", help="Its time-out. (default 60)")] = None,
    seed: Annotated[
        int | None, typer.Option(metavar="N", help="The same seed gives the same flight. (default 0)")
    ] = None,
    request: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The request as JSON, as over HTTP, in place of all the above.")
    ] = None,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    vertical_datum: VerticalDatumOption = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Plan a flight for a drone above the Digital Morphing Map and a safety bubble away from the ground.

    Writes flight.json, flight.geojson, map.png and, of a flight, flight.csv,
    flight.plan and profile.png into --out.
    """
    from .fly import FlyOptions, flight_request, make_flight

    options = FlyOptions(
        start=start,
        goal=goal,
        anchor_texts=anchor or [],
        anchor_files=anchors or [],
        lonlat=lonlat,
        ceiling=ceiling,
        morphing_map={
            "dop_limit": dop_limit,
            "min_anchors": min_anchors,
            "kind": kind,
            "measure": measure,
            "mode": mode,
        },
        budget={"iterations": iterations, "seconds": time_limit},
        rest={"bubble_m": bubble, "climb_weight": climb_weight, "speed_m_per_s": speed, "seed": seed},
    )
    make_flight(
        dem,
        flight_request(request, map, options),
        reading=reading_options(nodata, crs, height_unit, band, cell_m, vertical_datum),
        out=out,
        as_json=as_json,
    )
