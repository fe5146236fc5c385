"""``sightline detect``: its options; the work is done in detect.py."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import AsJson, OutFolder

__all__ = ["detect"]


def detect(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG.csv",
            help="CSV with a range a row (time_s,anchor_id,range_m …) or a moment a row (time_s,range_m.D1 …), "
            "or JSON Lines (.jsonl) of the epochs that a stream takes.",
        ),
    ],
    anchor: Annotated[
        list[str] | None,
        typer.Option(
            "--anchor",
            metavar="ID,EAST,NORTH,HEIGHT",
            help="An anchor, metres; HEIGHT as 612msl, left out in two dimensions. Repeatable.",
        ),
    ] = None,
    anchors: Annotated[
        list[Path] | None,
        typer.Option("--anchors", metavar="FILE", help="Anchors in a .json or .csv file. Repeatable."),
    ] = None,
    dimension: Annotated[int | None, typer.Option(metavar="2|3", help="Whether heights matter. (default 3)")] = None,
    range_sigma: Annotated[
        float | None, typer.Option("--range-sigma", metavar="M", help="One-sigma error of a range. (default 0.1)")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(metavar="M", help="Geometric tolerance in place of k sigmas, metres.")
    ] = None,
    max_speed: Annotated[
        float | None, typer.Option("--max-speed", metavar="M/S", help="Of the rover, metres per second. (default 10)")
    ] = None,
    epoch: Annotated[
        float, typer.Option(metavar="S", help="Ranges within so many seconds belong together; 0: of equal time.")
    ] = 0.0,
    columns: Annotated[
        str | None,
        typer.Option(metavar="NAME=COLUMN,…", help="Columns that the CSV names otherwise: time_s=%time,range_m=dist."),
    ] = None,
    time_unit: Annotated[str, typer.Option(metavar="UNIT", help="Of time_s in CSV: s, ms, us, ns.")] = "s",
    range_unit: Annotated[
        str, typer.Option(metavar="UNIT", help="Of range_m and sigma_m in CSV: m, mm, cm, km, ft.")
    ] = "m",
    more: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Any other setting of the detector. Repeatable."),
    ] = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Replay a log of ranges: which anchors were occluded when, and what position the others give.

    Writes verdicts.csv, positions.csv, verdicts.png and detection.json into
    --out.
    """
    from .detect import replay_log

    given = {
        "dimension": dimension,
        "range_sigma_m": range_sigma,
        "geometric_tolerance_m": tolerance,
        "max_speed_m_per_s": max_speed,
    }
    form = columns or "", time_unit, range_unit
    replay_log(log, anchor or [], anchors or [], given, more or [], epoch, form, out=out, as_json=as_json)
