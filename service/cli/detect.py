"""``sightline detect``: a log of ranges through the detector, to a table and files."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .asking.detectors import DetectorOptions, LogOptions, MapOptions, ReplayOptions
from .asking.doubts import TRUSTING, DoubtOptions
from .asking.estimators import EstimatorOptions
from .asking.ground import AreaOptions, Margin, area_asked
from .asking.options import Output, option
from .output import (
    facts_table,
    leaving_nothing_new,
    output_folder,
    print_json,
    print_tables,
    print_warnings,
    progress_bar,
    share_text,
)

if TYPE_CHECKING:
    from detection import Calibration, RangeEpoch, Suspicion
    from service.files.logs.form import LogForm
    from service.live.replay import Replay, ReplaySummary

__all__ = ["detect"]

LOG = (
    "A table of ranges (CSV; several, or a folder of them: one for each anchor), JSON Lines (.jsonl) of the epochs of "
    "a stream, a ROS bag, MCAP, PX4 ULog, DataFlash or MAVLink telemetry; sightline log LOG shows how it is taken."
)
# More episodes than these are for the file, not for the eye.
SHOWN_EPISODES = 15
SHOWN_IDS = 5
PLAIN = "m"


def detect(
    log: Annotated[Path, Parameter(allow_leading_hyphen=False, help=LOG)],
    /,
    *logs: Annotated[Path, Parameter(allow_leading_hyphen=False, help="More tables of the same drive.")],
    anchor: Annotated[
        tuple[str, ...],
        option("An anchor, metres; HEIGHT as 612msl, left out in two dimensions. Repeatable.", "ID,EAST,NORTH,HEIGHT"),
    ] = (),
    anchors: Annotated[tuple[Path, ...], option("Anchors in a .json or .csv file. Repeatable.", "FILE")] = (),
    settings: DetectorOptions = DetectorOptions(),
    more: ReplayOptions = ReplayOptions(),
    along: EstimatorOptions = EstimatorOptions(),
    form: LogOptions = LogOptions(),
    ground: MapOptions = MapOptions(),
    doubts: DoubtOptions = TRUSTING,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    output: Output = Output(),
) -> None:
    """Replay LOG.csv, a log of ranges: which anchors were occluded when, and what position the others give.

    Writes verdicts.csv, positions.csv, verdicts.png and detection.json into
    --out; with --dem also map_doubts.geojson, where ranges contradict the map,
    with --estimator also estimates.csv.
    """
    from detection import Detector
    from service.live.epoch_logs import read_epochs
    from service.live.replay import replay
    from service.live.replay_files import DOUBTS, ESTIMATES, FILES, write_replay
    from service.live.watching import write_doubts
    from service.parts.unused import notes_on_ranging_anchors

    from .asking.anchor_files import ranging_anchors, ranging_asked

    asked = settings.asked()
    named = ranging_asked(anchor, anchors, level=asked.dimension == 2)
    placed, frame = ranging_anchors(named, level=asked.dimension == 2)
    Detector(placed, asked.settings())  # refuses what makes no detector before the log is read
    within = area_asked(area.part(in_degrees=False))
    radios = {one.id: one.radio for one in named if one.radio is not None}
    grid = ground.grid(frame, within, margin_m, doubts)
    if along.estimator is not None and output.out is None:
        raise RequestError("--estimator writes estimates.csv: give --out DIR.")
    if not (math.isfinite(form.epoch) and form.epoch >= 0.0):
        raise RequestError(f"--epoch must be a number of seconds >= 0, not {form.epoch}.")
    known = [one.id for one in placed]
    read = read_epochs([log, *logs], form.epoch, form.form(), known)
    if not read.epochs:
        raise RequestError(f"The log {log.name} holds no ranges.")
    going = along.begin(placed, asked.settings(), grid, frame, [log, *logs], form.form(), read)
    over = (placed, asked.settings(), within, going.estimator, doubts, radios)
    mapped = None if grid is None else ground.detector(grid, *over)
    calibration = more.calibrated(placed, read.epochs, asked.settings())
    epochs = read.epochs if calibration is None else [calibration.applied(epoch) for epoch in read.epochs]
    files = (*FILES, *([] if mapped is None else [DOUBTS]), *([] if going.estimator is None else [ESTIMATES]))
    folder = None if output.out is None else output_folder(output.out, files)
    with progress_bar("Epochs") as progress:
        replayed = replay(placed, epochs, asked.settings(), progress, mapped, going.estimator, going.readings)
    summary = replayed.summary()
    of_anchors = notes_on_ranging_anchors(named, asked.settings().range_sigma_m, over_map=mapped is not None)
    over_map = of_anchors if mapped is None else [*of_anchors, *mapped.warnings, *_doubted(replayed)]
    warnings = [*read.warnings, *going.warnings(), *over_map, *_warnings(replayed, summary, frame)]
    warnings += _suspected(replayed, read.form)
    warnings += [] if form.epoch else _one_by_one(read.epochs)
    warnings += summary.health.warnings
    warnings += _calibrated(calibration)
    document = {"log": log.name, "frame": frame, **summary.document(), "warnings": warnings}
    if calibration is not None:
        document["calibration"] = asdict(calibration)
    if (felt := going.readings) is not None:
        document["imu"] = {"readings": len(felt), "used": felt.used, "riding": felt.riding}
    written: list[Path] = []
    if folder is not None:
        with leaving_nothing_new(folder, files):
            if mapped is not None:
                write_doubts(mapped.grid, replayed.doubts, folder / DOUBTS)
                written.append(folder / DOUBTS)
            written += write_replay(replayed, document, folder, log.name)
    if output.as_json:
        print_json({**document, "files": [str(path) for path in written]})
        return
    print_tables(_facts(log.name, summary), _anchors_table(summary), *_episodes_tables(summary))
    print_warnings(warnings)
    for path in written:
        print(path)


def _calibrated(calibration: Calibration | None) -> list[str]:
    """What was applied to all ranges, with its sigma."""
    if calibration is None:
        return []
    if calibration.scale_sigma > 0.0:
        return [f"Ranges were divided by {calibration.scale:.4f} ± {calibration.scale_sigma:.4f} (--calibrate scale)."]
    told = {anchor_id: (o, calibration.offset_sigmas_m[anchor_id]) for anchor_id, o in calibration.offsets_m.items()}
    if len(set(told.values())) == 1:
        ((offset_m, sigma_m),) = set(told.values())
        return [f"{offset_m:.3f} ± {sigma_m:.3f} m were taken off all ranges (--calibrate offset)."]
    each = ", ".join(f"{anchor_id} {offset_m:.3f} ± {sigma_m:.3f}" for anchor_id, (offset_m, sigma_m) in told.items())
    return [f"Taken off the ranges of each anchor, metres (--calibrate anchors): {each}."]


def _doubted(replayed: Replay) -> list[str]:
    if not replayed.doubts:
        return []
    by_anchor = ", ".join(sorted({doubt.anchor_id for doubt in replayed.doubts}))
    return [f"Ranges contradict the map in {len(replayed.doubts)} stretches, of {by_anchor}: map_doubts.geojson."]


def _one_by_one(epochs: Sequence[RangeEpoch]) -> list[str]:
    """What to type where no two ranges have the same time, so that none can check another."""
    alone = [epoch for epoch in epochs if len(epoch.ranges) == 1]
    anchors = {epoch.ranges[0].anchor_id for epoch in alone}
    if len(anchors) < 3 or len(alone) < 0.9 * len(epochs):
        return []
    steps = sorted(later.time_s - one.time_s for one, later in pairwise(epochs) if later.time_s > one.time_s)
    round_s = steps[len(steps) // 2] * len(anchors) if steps else 0.0
    said = f"{round_s:.2g}" if round_s > 0.0 else "S"
    return [f"Ranges come one by one; --epoch {said} gathers those of a round, so that they can check one another."]


def _suspected(replayed: Replay, form: LogForm) -> list[str]:
    """What the log as a whole suffers from, and what to type against it; form: what was typed about it."""
    from detection import diagnose

    return [
        _cured(one, form) for one in diagnose(replayed.anchors, replayed.epochs, replayed.results, replayed.settings)
    ]


def _cured(suspicion: Suspicion, form: LogForm) -> str:
    from detection import Cause
    from service.files.logs.form import LENGTHS_M, TIMES_S

    told, factor = suspicion.sentence, suspicion.value
    if suspicion.cause is Cause.TIME_UNIT:
        seconds = factor * TIMES_S[form.time_unit or "s"]
        return f"{told} Then say --time-unit {min(TIMES_S, key=lambda unit: abs(TIMES_S[unit] - seconds))}."
    if suspicion.cause in (Cause.RANGE_UNIT, Cause.SCALE):
        given = form.range_unit or PLAIN
        fits = _unit_of(LENGTHS_M[given] / factor, LENGTHS_M)
        if given == PLAIN:
            return told if fits is None else f"{told} If the ranges are: --range-unit {fits}."
        # what was just said of the ranges is likelier wrong than where anchors stand
        times = f"{factor:.3g}" if factor < 100.0 else f"{factor:,.0f}"
        is_it = "is that their unit?" if fits is None else f"are they in {fits}? Then say --range-unit {fits}."
        return f"Taken with --range-unit {given} the ranges are about {times} times what fits the anchors: {is_it}"
    cures = {
        Cause.TIME_ORDER: " Or gather the ranges of one moment with --epoch S.",
        Cause.DIMENSION: " (--dimension 3)",
        Cause.OFFSET: " Or have it taken off: --calibrate offset.",
    }
    return f"{told}{cures.get(suspicion.cause, '')}"


def _unit_of(metres: float, units: Mapping[str, float]) -> str | None:
    """The unit that is so many metres, to a twentieth; None where none is."""
    likely = min(units, key=lambda unit: abs(math.log(units[unit] / metres)))
    return likely if abs(math.log(units[likely] / metres)) < 0.05 else None


def _facts(log: str, summary: ReplaySummary) -> Table:
    times = summary.epoch_time_ms
    rejected = ", ".join(f"{count} {reason}" for reason, count in summary.rejections.items())
    return facts_table(
        log,
        [
            ("epochs", f"{summary.epochs_used} of {summary.epochs} used"),
            ("one sigma of a range", f"{summary.settings.range_sigma_m:g} m where the log gives none"),
            ("classified", _counted(summary.classifications)),
            ("positions", f"{_counted(summary.planning)}; available {share_text(summary.availability)}"),
            ("odometry", _counted(summary.odometry)),
            ("not used", rejected or "nothing"),
            ("most often needed", next(iter(summary.needed), "nothing")),
            ("time per epoch", f"median {times['median']:.2f} ms, p99 {times['p99']:.2f} ms"),
        ],
    )


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {word}" for word, count in counts.items()) or "–"


def _anchors_table(summary: ReplaySummary) -> Table:
    table = Table(title="Anchors", title_justify="left")
    table.add_column("anchor", style="bold")
    counts = ("clear", "occluded", "too\nshort", "unknown")
    for column in ("ranges", *counts, "share\noccluded", "median\nexcess m", "at the end"):
        table.add_column(column, justify="right")
    for anchor in summary.anchors:
        excess_m = anchor.median_excess_m
        table.add_row(
            escape(anchor.anchor.id),
            str(anchor.ranges),
            *(str(anchor.sights.get(column.replace("\n", " "), 0)) for column in counts),
            share_text(anchor.occluded_share),
            "–" if excess_m is None else f"{excess_m:+.2f}",
            anchor.last_sight or "–",
        )
    return table


def _episodes_tables(summary: ReplaySummary) -> list[Table]:
    episodes = sorted(summary.episodes, key=lambda episode: episode.ranges, reverse=True)[:SHOWN_EPISODES]
    if not episodes:
        return []
    shown = "" if len(episodes) == len(summary.episodes) else f" (the longest {len(episodes)})"
    found = len(summary.episodes)
    table = Table(title=f"{found} occlusion{'' if found == 1 else 's'}{shown}", title_justify="left")
    table.add_column("anchor", style="bold")
    for column in ("from s", "to s", "ranges", "greatest\nexcess m"):
        table.add_column(column, justify="right")
    for episode in sorted(episodes, key=lambda episode: (episode.from_s, episode.anchor_id)):
        excess_m = episode.greatest_excess_m
        table.add_row(
            escape(episode.anchor_id),
            f"{episode.from_s:.2f}",
            f"{episode.to_s:.2f}",
            str(episode.ranges),
            f"{excess_m:+.2f}" if math.isfinite(excess_m) else "–",
        )
    return [table]


def _warnings(replayed: Replay, summary: ReplaySummary, frame: Mapping[str, float] | None) -> list[str]:
    silent = [one.anchor.id for one in summary.anchors if not one.ranges]
    warnings = [f"No range of {', '.join(silent)} could be used."] if silent else []
    if frame is not None:
        at = f"{frame['lon_deg']:.6f}, {frame['lat_deg']:.6f}"
        warnings.append(f"Anchors came in degrees: east and north are metres from longitude, latitude {at}.")
    if summary.rejections.get("unknown anchor"):
        strange = Counter(one.anchor_id for epoch in replayed.epochs for one in epoch.ranges)
        for anchor in replayed.anchors:
            del strange[anchor.id]
        ids = [repr(name) for name, _ in strange.most_common(SHOWN_IDS)]
        more = f" and {len(strange) - SHOWN_IDS} more" if len(strange) > SHOWN_IDS else ""
        warnings.append(f"Ranges to {', '.join(ids)}{more} were not used: no --anchor or --anchors names them.")
    if summary.searches_cut_short:
        short, used = summary.searches_cut_short, summary.epochs_used
        warnings.append(
            f"In {short} of {used} epochs the search was cut short after --set search_limit=N sets of ranges."
        )
    return warnings
