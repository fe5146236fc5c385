"""The files of a replayed log: verdicts and positions as tables, verdicts as a picture, and its summary."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path

from detection import AnchorVerdict, EpochResult
from service.files.layer import replacing
from service.files.tables import TableWriter
from service.live.replay import Replay
from service.live.verdict_picture import write_verdict_picture

__all__ = ["DOUBTS", "FILES", "write_replay"]

VERDICTS, POSITIONS, PICTURE, SUMMARY = "verdicts.csv", "positions.csv", "verdicts.png", "detection.json"
FILES = (SUMMARY, VERDICTS, POSITIONS, PICTURE)
DOUBTS = "map_doubts.geojson"  # of a replay that looks at a map


def write_replay(replayed: Replay, document: Mapping[str, object], folder: Path, name: str) -> list[Path]:
    """Write FILES, each whole or not at all; document: the summary, which comes last, so where it is new all is new.

    name: of the log. Raises OSError.
    """
    for file, rows in ((VERDICTS, _verdict_rows(replayed)), (POSITIONS, _position_rows(replayed))):
        with replacing(folder / file) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as stream:
            table = TableWriter(stream, end="\r\n")
            for row in rows:
                table.row(row)
    with replacing(folder / PICTURE) as unfinished:
        write_verdict_picture(replayed, f"{name}: verdicts over time", unfinished)
    with replacing(folder / SUMMARY) as unfinished:
        unfinished.write_text(json.dumps(document, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / file for file in FILES]


def _verdict_rows(replayed: Replay) -> Iterator[list[object]]:
    """A row per range in the log: judged, or not used and why."""
    foretold = replayed.p_sight
    yield ["epoch", "time_s", "anchor_id", "range_m", "sight", "occluded", "probability", "confidence", "score",
           "excess_m", "reason", *([] if foretold is None else ["p_sight"])]  # fmt: skip
    for number, (epoch, result) in enumerate(zip(replayed.epochs, replayed.results, strict=True)):
        told = {verdict.anchor_id: verdict for verdict in result.verdicts}
        why = {rejected.anchor_id: str(rejected.reason) for rejected in result.rejected}
        for measured in epoch.ranges:
            begin = [number, epoch.time_s, measured.anchor_id, measured.range_m]
            verdict = told.get(measured.anchor_id)
            end: list[object] = []
            if foretold is not None:
                p_sight = foretold[number].get(measured.anchor_id)
                end = ["" if p_sight is None else _cell(p_sight)]
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


def _place(result: EpochResult) -> list[object]:
    """East, north, altitude (empty in two dimensions), root of the covariance's trace; all empty without position."""
    if result.position is None:
        return ["", "", "", ""]
    place_m = [_cell(number) for number in result.position.position_m.tolist()]
    sigma_m = math.sqrt(max(0.0, float(result.position.covariance_m2.trace())))
    return [*place_m, *[""] * (3 - len(place_m)), _cell(sigma_m)]


def _cell(number: float) -> str:
    return f"{number:.6g}" if abs(number) < 1e5 else f"{number:.3f}"
