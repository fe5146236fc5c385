"""``sightline log``: what is in a log, and how ``detect`` and ``navigate`` would take it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from ..asking.detectors import LogOptions
from ..asking.options import option
from ..output import facts_table, print_json, print_tables, print_warnings

if TYPE_CHECKING:
    from service.live.log_survey import LogSurvey

__all__ = ["log"]

SHOWN_FIELDS, SHOWN_STREAMS, SHOWN_ANCHORS = 8, 40, 20


def log(
    path: Annotated[Path, Parameter(name="LOG", allow_leading_hyphen=False, help="As detect takes it.")],
    /,
    *logs: Annotated[Path, Parameter(allow_leading_hyphen=False, help="More tables of the same drive.")],
    anchor_ids: Annotated[str | None, option("Ids of anchors, by which columns may be named.", "ID,ID,…")] = None,
    form: LogOptions = LogOptions(),
    mapping: Annotated[bool, option("Print the mapping alone, for a file that --map reads.")] = False,
    as_json: Annotated[bool, option("Print JSON on standard output and nothing else.", name="--json")] = False,
) -> None:
    """Show what is in a log, and how detect and navigate would take it: ranges, motions, readings, the mapping."""
    from service.files.logs.form import map_of
    from service.live.log_survey import survey_log

    known = [one.strip() for one in (anchor_ids or "").split(",") if one.strip()]
    survey = survey_log([path, *logs], form.epoch, form.form(), known)
    if mapping:
        if survey.problem:
            raise RequestError(survey.problem)
        print(map_of(survey.mapping))
    elif as_json:
        print_json(survey.document())
    else:
        print_tables(_facts(survey), *_streams(survey))
        if not survey.problem:
            print(f"Mapping, for --map:\n{map_of(survey.mapping)}")
        print_warnings([*survey.warnings, *([survey.problem] if survey.problem else [])])


def _facts(survey: LogSurvey) -> Table:
    facts = [("kind", survey.kind), ("epochs", f"{survey.epochs}, {survey.motions} with a motion")]
    if survey.from_s is not None and survey.to_s is not None:
        facts.append(("time", f"{survey.from_s:.2f} to {survey.to_s:.2f} s ({survey.to_s - survey.from_s:.1f} s)"))
    ranges = [f"{anchor_id}: {count}" for anchor_id, count in survey.ranges.items()]
    more = f" … {len(ranges)} in all" if len(ranges) > SHOWN_ANCHORS else ""
    if (drive := survey.drive) is not None:
        lasts_s = drive.times_s[-1] - drive.times_s[0]
        told = f"{len(drive.times_s)} inertial readings over {lasts_s:.1f} s, {len(drive.fixes)} fixes"
        facts.append(("for navigate", f"{told}, {len(drive.ranges)} ranges, {len(drive.speeds)} speeds"))
    facts.append(("ranges by anchor", f"{', '.join(ranges[:SHOWN_ANCHORS])}{more}" or "none"))
    return facts_table(survey.log, facts)


def _streams(survey: LogSurvey) -> list[Table]:
    if not survey.streams:
        return []
    table = Table(title="Streams", title_justify="left")
    for column in ("stream", "type", "messages", "taken for", "fields"):
        table.add_column(column, justify="right" if column == "messages" else "left", overflow="fold")
    for one in sorted(survey.streams, key=lambda one: (not one.taken_for, one.name))[:SHOWN_STREAMS]:
        shown = f"{', '.join(one.fields[:SHOWN_FIELDS])}{' …' if len(one.fields) > SHOWN_FIELDS else ''}"
        kind = "" if one.kind == one.name else one.kind
        table.add_row(escape(one.name), escape(kind), str(one.count), one.taken_for or "–", escape(shown))
    return [table]
