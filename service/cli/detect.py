"""``sightline detect``: a log of ranges through the detector, to a table and files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.markup import escape
from rich.table import Table

from detection import AnchorVerdict, Cause, Detector, EpochResult, Suspicion, diagnose
from service.errors import RequestError
from service.files.range_log import LENGTHS_M, TIMES_S, LogForm
from service.files.range_log_messages import read_epochs
from service.files.replacing import replacing
from service.files.tables import TableWriter
from service.live.replay import Replay, replay
from service.live.settings import DetectorSettingsIn
from service.live.verdict_picture import write_verdict_picture
from service.parts.sentences import sentence_of

from .detect_anchors import ranging_anchors
from .maps import leaving_nothing_new, output_folder
from .output import facts_table, print_json, print_tables, print_warnings, progress_bar, share_text

__all__ = ["replay_log"]

VERDICTS, POSITIONS, PICTURE, SUMMARY = "verdicts.csv", "positions.csv", "verdicts.png", "detection.json"
FILES = (SUMMARY, VERDICTS, POSITIONS, PICTURE)
CURES = {
    Cause.TIME_ORDER: " Or gather the ranges of one moment with --epoch S.",
    Cause.DIMENSION: " (--dimension 3)",
    Cause.SIGMA: " (--range-sigma)",
}
# More episodes than these are for the file, not for the eye.
SHOWN_EPISODES = 15


def replay_log(
    log: Path,
    anchor_texts: list[str],
    anchor_files: list[Path],
    given: dict[str, Any],
    more: list[str],
    epoch_s: float,
    form: tuple[str, str, str],
    *,
    out: Path | None,
    as_json: bool,
) -> None:
    """Read, replay, write into ``out`` and print. What can be wrong in the request is found before the work.

    form: what --columns, --time-unit and --range-unit say.
    """
    settings = _settings(given, more)
    anchors, frame = ranging_anchors(anchor_texts, anchor_files, level=settings.dimension == 2)
    Detector(anchors, settings.settings())  # refuses what makes no detector before the log is read
    if not (math.isfinite(epoch_s) and epoch_s >= 0.0):
        raise RequestError(f"--epoch must be a number of seconds >= 0, not {epoch_s}.")
    read = read_epochs(log, epoch_s, LogForm(_columns(form[0]), form[1], form[2]))
    if not read.epochs:
        raise RequestError(f"The log {log.name} holds no ranges.")
    folder = None if out is None else output_folder(out, FILES)
    with progress_bar("Epochs") as progress:
        replayed = replay(anchors, read.epochs, settings.settings(), progress)
    summary = {"log": log.name, "frame": frame, **_finite(replayed.summary())}
    summary["warnings"] = [*read.warnings, *_warnings(summary), *_suspected(replayed), *summary["health"]["warnings"]]
    written = [] if folder is None else _write(replayed, summary, folder, log.name)
    if as_json:
        print_json({**summary, "files": [str(path) for path in written]})
        return
    print_tables(_facts(summary), _anchors_table(summary), *_episodes_tables(summary))
    print_warnings(summary["warnings"])
    for path in written:
        print(path)


def _columns(text: str) -> dict[str, str]:
    """NAME=COLUMN,NAME=COLUMN as a mapping. Raises RequestError."""
    columns = {}
    for part in text.split(",") if text else ():
        name, equals, column = part.partition("=")
        if not equals:
            raise RequestError(f"--columns {text!r} is not of the form NAME=COLUMN,NAME=COLUMN.")
        columns[name.strip()] = column.strip()
    return columns


def _suspected(replayed: Replay) -> list[str]:
    """What the log as a whole suffers from, and what to type against it."""
    return [
        f"{one.sentence}{_cure(one)}"
        for one in diagnose(replayed.anchors, replayed.epochs, replayed.results, replayed.settings)
    ]


def _cure(suspicion: Suspicion) -> str:
    if suspicion.cause is Cause.TIME_UNIT:
        return f" Then say --time-unit {min(TIMES_S, key=lambda unit: abs(TIMES_S[unit] - suspicion.value))}."
    if suspicion.cause is Cause.RANGE_UNIT and suspicion.value > 1.0:
        likely = min(LENGTHS_M, key=lambda unit: abs(math.log(LENGTHS_M[unit] * suspicion.value)))
        return f" If the ranges are: --range-unit {likely}."
    return CURES.get(suspicion.cause, "")


def _settings(given: dict[str, Any], more: list[str]) -> DetectorSettingsIn:
    fields = {name: value for name, value in given.items() if value is not None}
    for text in more:
        name, equals, value = text.partition("=")
        if not equals or name.strip() not in DetectorSettingsIn.model_fields:
            known = ", ".join(DetectorSettingsIn.model_fields)
            raise RequestError(f"--set {text!r} is not of the form NAME=VALUE with a NAME out of {known}.")
        try:
            fields[name.strip()] = json.loads(value)
        except json.JSONDecodeError:
            fields[name.strip()] = value.strip()  # a word, which needs no quotes here
    try:
        return DetectorSettingsIn.model_validate(fields)
    except ValidationError as error:
        raise RequestError(f"The settings: {sentence_of(error)}") from error


def _write(replayed: Replay, summary: dict[str, Any], folder: Path, name: str) -> list[Path]:
    """Every file whole or not at all; the summary comes last, so where it is new all is new."""
    with leaving_nothing_new(folder, FILES):
        for file, rows in ((VERDICTS, _verdict_rows(replayed)), (POSITIONS, _position_rows(replayed))):
            with replacing(folder / file) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as stream:
                table = TableWriter(stream, end="\r\n")
                for row in rows:
                    table.row(row)
        with replacing(folder / PICTURE) as unfinished:
            write_verdict_picture(replayed, f"{name}: verdicts over time", unfinished)
        with replacing(folder / SUMMARY) as unfinished:
            unfinished.write_text(json.dumps(summary, allow_nan=False, indent=1), encoding="utf-8")
    return [folder / file for file in FILES]


def _verdict_rows(replayed: Replay) -> Iterator[list[Any]]:
    """A row per range in the log: judged, or not used and why."""
    yield ["epoch", "time_s", "anchor_id", "range_m", "sight", "occluded", "probability", "confidence", "score",
           "excess_m", "reason"]  # fmt: skip
    for number, (epoch, result) in enumerate(zip(replayed.epochs, replayed.results, strict=True)):
        told = {verdict.anchor_id: verdict for verdict in result.verdicts}
        why = {rejected.anchor_id: str(rejected.reason) for rejected in result.rejected}
        for measured in epoch.ranges:
            begin = [number, epoch.time_s, measured.anchor_id, measured.range_m]
            verdict = told.get(measured.anchor_id)
            if verdict is not None:
                yield [*begin, *_told(verdict)]
            else:
                yield [*begin, "", "", "", "", "", "", result.rejection or why.get(measured.anchor_id, "")]


def _told(verdict: AnchorVerdict) -> list[Any]:
    numbers = (verdict.probability, verdict.confidence, verdict.score, verdict.excess_m)
    return [verdict.sight, int(verdict.occluded), *(_cell(number) for number in numbers), verdict.reason]


def _position_rows(replayed: Replay) -> Iterator[list[Any]]:
    yield ["epoch", "time_s", "rejection", "classification", "planning", "odometry", "east_m", "north_m", "altitude_m",
           "sigma_m", "excluded", "included", "needed", "summary"]  # fmt: skip
    for number, result in enumerate(replayed.results):
        yield [
            number, result.time_s, result.rejection or "", result.classification, result.planning, result.odometry,
            *_place(result), " ".join(result.excluded), " ".join(result.included), result.needed,
            result.summary,
        ]  # fmt: skip


def _place(result: EpochResult) -> list[Any]:
    """East, north, altitude (empty in two dimensions), root of the covariance's trace; all empty without position."""
    if result.position is None:
        return ["", "", "", ""]
    place_m = [_cell(number) for number in result.position.position_m.tolist()]
    sigma_m = math.sqrt(max(0.0, float(result.position.covariance_m2.trace())))
    return [*place_m, *[""] * (3 - len(place_m)), _cell(sigma_m)]


def _cell(number: float) -> str:
    return f"{number:.6g}" if abs(number) < 1e5 else f"{number:.3f}"


def _facts(summary: dict[str, Any]) -> Table:
    times = summary["epoch_time_ms"]
    rejected = ", ".join(f"{count} {reason}" for reason, count in summary["rejections"].items())
    return facts_table(
        summary["log"],
        [
            ("epochs", f"{summary['epochs_used']} of {summary['epochs']} used"),
            ("classified", _counted(summary["classifications"])),
            ("positions", f"{_counted(summary['planning'])}; available {share_text(summary['availability'])}"),
            ("odometry", _counted(summary["odometry"])),
            ("not used", rejected or "nothing"),
            ("most often needed", next(iter(summary["needed"]), "nothing")),
            ("time per epoch", f"median {times['median']:.2f} ms, p99 {times['p99']:.2f} ms"),
        ],
    )


def _counted(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {word}" for word, count in counts.items()) or "–"


def _anchors_table(summary: dict[str, Any]) -> Table:
    table = Table(title="Anchors", title_justify="left")
    table.add_column("anchor", style="bold")
    counts = ("ranges", "clear", "occluded", "too\nshort", "unknown")
    for column in (*counts, "share\noccluded", "median\nexcess m", "at the end"):
        table.add_column(column, justify="right")
    for anchor in summary["anchors"]:
        excess_m = anchor["median_excess_m"]
        table.add_row(
            escape(anchor["id"]),
            *(str(anchor.get(column.replace("\n", " "), 0)) for column in counts),
            share_text(anchor["occluded_share"]),
            "–" if excess_m is None else f"{excess_m:+.2f}",
            anchor["last_sight"] or "–",
        )
    return table


def _episodes_tables(summary: dict[str, Any]) -> list[Table]:
    episodes = sorted(summary["episodes"], key=lambda episode: episode["ranges"], reverse=True)[:SHOWN_EPISODES]
    if not episodes:
        return []
    shown = "" if len(episodes) == len(summary["episodes"]) else f" (the longest {len(episodes)})"
    found = len(summary["episodes"])
    table = Table(title=f"{found} occlusion{'' if found == 1 else 's'}{shown}", title_justify="left")
    table.add_column("anchor", style="bold")
    for column in ("from s", "to s", "ranges", "greatest\nexcess m"):
        table.add_column(column, justify="right")
    for episode in sorted(episodes, key=lambda episode: (episode["from_s"], episode["anchor_id"])):
        excess_m = episode["greatest_excess_m"]
        table.add_row(
            escape(episode["anchor_id"]),
            f"{episode['from_s']:.2f}",
            f"{episode['to_s']:.2f}",
            str(episode["ranges"]),
            "–" if excess_m is None else f"{excess_m:+.2f}",
        )
    return [table]


def _warnings(summary: dict[str, Any]) -> list[str]:
    silent = [anchor["id"] for anchor in summary["anchors"] if not anchor["ranges"]]
    warnings = [f"No range of {', '.join(silent)} could be used."] if silent else []
    if summary["frame"]:
        at = f"{summary['frame']['lon_deg']:.6f}, {summary['frame']['lat_deg']:.6f}"
        warnings.append(f"Anchors came in degrees: east and north are metres from longitude, latitude {at}.")
    if summary["rejections"].get("unknown anchor"):
        warnings.append("Ranges to anchors that were not named with --anchor or --anchors were not used.")
    if summary["searches_cut_short"]:
        short, used = summary["searches_cut_short"], summary["epochs_used"]
        warnings.append(f"In {short} of {used} epochs the search was cut short at search_limit sets of ranges.")
    return warnings


def _finite(value: Any) -> Any:
    """The same with null for what JSON has no number for."""
    if isinstance(value, dict):
        return {name: _finite(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
