"""Measure, print the tables, write them into a page: ``python -m benchmarks [--only GROUP ...] [--write FILE]``.

Missed targets are told in the tables and at the end; the exit code is 1 only where something could not be measured.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks import machine, pages, report
from benchmarks.groups import GROUPS, QUICK


def main() -> None:
    arguments = _arguments()
    groups = QUICK if arguments.quick else GROUPS
    started_s = time.perf_counter()
    tables = []
    for group in arguments.only or list(groups):
        described = machine.description()
        print("\n".join(f"{label}: {value}" for label, value in described.items()), end="\n\n")
        measured = [_measured(measure) for measure in groups[group]]
        tables += measured
        if arguments.write:
            page = arguments.write.read_text(encoding="utf-8") if arguments.write.exists() else ""
            page = pages.with_part(page, group, list(GROUPS), described, measured)
            arguments.write.write_text(page, encoding="utf-8")
    missed = report.missed(tables)
    for line in missed:
        print(f"missed: {line}")
    judged = sum(row.met is not None for table in tables for row in table.rows)
    print(f"{judged - len(missed)} of {judged} targets met in {time.perf_counter() - started_s:.0f} s.")


def _measured(measure: Callable[[], report.Table]) -> report.Table:
    begin_s = time.perf_counter()
    table = measure()
    print(report.as_text(table), f"({report.duration(time.perf_counter() - begin_s)})\n", sep="\n", flush=True)
    return table


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(GROUPS), metavar="GROUP", help=f"of {', '.join(GROUPS)}")
    parser.add_argument(
        "--write",
        type=Path,
        metavar="FILE",
        help="write the tables into this Markdown page, group by group; other parts stay",
    )
    parser.add_argument("--quick", action="store_true", help="small grounds: shows that everything runs")
    arguments = parser.parse_args()
    whole = [group for group in arguments.only or () if arguments.quick and group not in QUICK]
    if whole:
        parser.error(f"There is no --quick of {', '.join(whole)}.")
    return arguments


if __name__ == "__main__":
    main()
