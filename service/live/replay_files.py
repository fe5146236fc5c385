"""The files of a replayed log: verdicts and positions as tables, verdicts as a picture, and its summary."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from detection import AnchorVerdict, EpochResult, PlanningStatus, Sight
from navigation import RoverEstimate
from service.drawing.furniture import INK
from service.drawing.sheet import DPI, save_png
from service.files.csv_table import TableWriter
from service.files.layer import replacing
from service.live.replay import Replay
from service.parts.sentences import counted

__all__ = ["DOUBTS", "ESTIMATES", "FILES", "draw_verdicts", "write_replay", "write_verdict_picture"]

# told apart without colour too: by shape and by height in the lane
MARKS = {
    Sight.CLEAR: ("#2b7bba", "|", 7.0, 0.0),
    Sight.UNKNOWN: ("#8c8c8c", ".", 4.0, -0.18),
    Sight.OCCLUDED: ("#d1410c", "v", 5.5, 0.2),
    Sight.TOO_SHORT: ("#7a3e9d", "^", 5.5, 0.2),
}
STATUS_COLOURS = {
    PlanningStatus.CHECKED: "#2b7bba",
    PlanningStatus.DEGRADED: "#f0a202",
    PlanningStatus.UNCHECKED: "#8c8c8c",
    PlanningStatus.NO_POSITION: "#1a1a1a",
}
WIDTH_IN, LANE_IN, HEAD_IN, FOOT_IN = 11.0, 0.42, 0.95, 0.6
# More lanes than these would not be read.
MOST_LANES = 32
VERDICTS, POSITIONS, PICTURE, SUMMARY = "verdicts.csv", "positions.csv", "verdicts.png", "detection.json"
FILES = (SUMMARY, VERDICTS, POSITIONS, PICTURE)
ESTIMATES = "estimates.csv"  # of a replay with a filter that goes along
DOUBTS = "map_doubts.geojson"  # of a replay that looks at a map


def draw_verdicts(replayed: Replay, title: str) -> Figure:
    """A figure of the whole log."""
    ids = [anchor.id for anchor in replayed.anchors][:MOST_LANES]
    height_in = HEAD_IN + FOOT_IN + LANE_IN * (len(ids) + 1)
    figure = Figure(figsize=(WIDTH_IN, height_in), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.1, FOOT_IN / height_in, 0.72, LANE_IN * (len(ids) + 1) / height_in))
    lanes = {anchor_id: len(ids) - number for number, anchor_id in enumerate(ids)}
    for sight, (colour, marker, size, raised) in MARKS.items():
        places = [
            (result.time_s, lanes[verdict.anchor_id] + raised)
            for result in replayed.results
            for verdict in result.verdicts
            if verdict.sight is sight and verdict.anchor_id in lanes
        ]
        if places:
            axes.plot(*np.array(places).T, marker=marker, ms=size, color=colour, ls="none", mew=1.0)
    _draw_status(axes, replayed)
    axes.set_yticks([0, *lanes.values()], ["position", *(_short(anchor_id) for anchor_id in lanes)])
    axes.set_ylim(-0.5, len(ids) + 0.5)
    axes.set_xlabel("time, s")
    axes.margins(x=0.01)
    axes.grid(axis="x", color="#dddddd", lw=0.6)
    axes.set_axisbelow(True)
    axes.axhline(0.5, color=INK, lw=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.text(0.1, 1 - 0.2 / height_in, title, fontsize=14, fontweight="bold", va="top", color=INK)
    figure.text(0.1, 1 - 0.5 / height_in, _subtitle(replayed), fontsize=10, va="top", color=INK)
    _legend(axes)
    return figure


def write_verdict_picture(replayed: Replay, title: str, path: Path) -> None:
    """The same as PNG."""
    save_png(draw_verdicts(replayed, title), path)


def _draw_status(axes: Axes, replayed: Replay) -> None:
    for status, colour in STATUS_COLOURS.items():
        times_s = [r.time_s for r in replayed.results if r.rejection is None and r.planning is status]
        if times_s:
            axes.plot(times_s, np.zeros(len(times_s)), marker="|", ms=11, mew=1.4, color=colour, ls="none")


def _legend(axes: Axes) -> None:
    handles = [Line2D([], [], color="none")]
    labels = ["anchors"]
    for sight, (colour, marker, size, _) in MARKS.items():
        handles.append(Line2D([], [], marker=marker, ms=size + 1, color=colour, ls="none"))
        labels.append(str(sight))
    handles.append(Line2D([], [], color="none"))
    labels.append("position")
    for status, colour in STATUS_COLOURS.items():
        handles.append(Line2D([], [], marker="|", ms=11, mew=2.5, color=colour, ls="none"))
        labels.append(str(status))
    legend = axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1.02), frameon=False, fontsize=9.5)
    for text in legend.get_texts():
        if text.get_text() in ("anchors", "position"):
            text.set_fontweight("bold")


def _subtitle(replayed: Replay) -> str:
    used = sum(result.rejection is None for result in replayed.results)
    verdicts = [verdict for result in replayed.results for verdict in result.verdicts]
    occluded, short = (sum(v.sight is sight for v in verdicts) for sight in (Sight.OCCLUDED, Sight.TOO_SHORT))
    left_out = len(replayed.anchors) - MOST_LANES
    more = f"; {counted(left_out, 'more anchor')} not drawn" if left_out > 0 else ""
    too_short = f", {short:,} too short" if short else ""
    epochs, ranges = counted(used, "epoch"), counted(len(verdicts), "range")
    return f"{epochs}, {ranges}, {occluded:,} of them occluded{too_short}{more}"


def _short(anchor_id: str) -> str:
    return anchor_id if len(anchor_id) <= 12 else f"{anchor_id[:11]}…"


def write_replay(replayed: Replay, document: Mapping[str, object], folder: Path, name: str) -> list[Path]:
    """Write FILES, and ESTIMATES where there are any, each whole or not at all.

    document: the summary, which comes last, so where it is new all is new. name: of the log. Raises OSError.
    """
    tables = {VERDICTS: _verdict_rows(replayed), POSITIONS: _position_rows(replayed)}
    if replayed.estimates is not None:
        tables[ESTIMATES] = _estimate_rows(replayed.estimates)
    for file, rows in tables.items():
        with replacing(folder / file) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as stream:
            table = TableWriter(stream, end="\r\n")
            for row in rows:
                table.row(row)
    with replacing(folder / PICTURE) as unfinished:
        write_verdict_picture(replayed, f"{name}: verdicts over time", unfinished)
    with replacing(folder / SUMMARY) as unfinished:
        unfinished.write_text(json.dumps(document, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / file for file in dict.fromkeys([*FILES, *tables])]


def _verdict_rows(replayed: Replay) -> Iterator[list[object]]:
    """A row per range in the log: judged, or not used and why."""
    foretold = {"p_sight": replayed.p_sight, "p_usable": replayed.p_usable}
    columns = {name: of for name, of in foretold.items() if of is not None}
    yield ["epoch", "time_s", "anchor_id", "range_m", "sight", "occluded", "probability", "confidence", "score",
           "excess_m", "reason", *columns]  # fmt: skip
    for number, (epoch, result) in enumerate(zip(replayed.epochs, replayed.results, strict=True)):
        told = {verdict.anchor_id: verdict for verdict in result.verdicts}
        why = {rejected.anchor_id: str(rejected.reason) for rejected in result.rejected}
        for measured in epoch.ranges:
            begin = [number, epoch.time_s, measured.anchor_id, measured.range_m]
            verdict = told.get(measured.anchor_id)
            numbers = [of[number].get(measured.anchor_id) for of in columns.values()]
            end = ["" if one is None else _cell(one) for one in numbers]
            if verdict is not None:
                yield [*begin, *_told(verdict), *end]
            else:
                yield [*begin, "", "", "", "", "", "", result.rejection or why.get(measured.anchor_id, ""), *end]


def _told(verdict: AnchorVerdict) -> list[object]:
    numbers = (verdict.probability, verdict.confidence, verdict.score, verdict.excess_m)
    return [verdict.sight, int(verdict.occluded), *(_cell(number) for number in numbers), verdict.reason]


def _position_rows(replayed: Replay) -> Iterator[list[object]]:
    yield ["epoch", "time_s", "rejection", "classification", "planning", "odometry", "east_m", "north_m", "altitude_m",
           "sigma_m", "excluded", "included", "needed", "summary"]  # fmt: skip
    for number, result in enumerate(replayed.results):
        yield [
            number, result.time_s, result.rejection or "", result.classification, result.planning, result.odometry,
            *_place(result), " ".join(result.excluded), " ".join(result.included), result.needed,
            result.summary,
        ]  # fmt: skip


def _estimate_rows(estimates: Sequence[RoverEstimate | None]) -> Iterator[list[object]]:
    """Of epochs after which the filter has begun."""
    yield ["epoch", "time_s", "east_m", "north_m", "altitude_m", "east_m_per_s", "north_m_per_s", "up_m_per_s",
           "sigma_m", "bubble_m", "used", "reacquired"]  # fmt: skip
    for number, one in enumerate(estimates):
        if one is not None:
            numbers = [*one.position_m.tolist(), *one.velocity_m_per_s.tolist()]
            sigma_m = math.sqrt(float(np.trace(one.covariance[:3, :3])))
            yield [
                number, one.time_s, *map(_cell, (*numbers, sigma_m, one.bubble_m)), " ".join(one.used),
                int(one.reacquired),
            ]  # fmt: skip


def _place(result: EpochResult) -> list[object]:
    """East, north, altitude (empty in two dimensions), root of the covariance's trace; all empty without position."""
    if result.position is None:
        return ["", "", "", ""]
    place_m = [_cell(number) for number in result.position.position_m.tolist()]
    sigma_m = math.sqrt(max(0.0, float(result.position.covariance_m2.trace())))
    return [*place_m, *[""] * (3 - len(place_m)), _cell(sigma_m)]


def _cell(number: float) -> str:
    return f"{number:.6g}" if abs(number) < 1e5 else f"{number:.3f}"
