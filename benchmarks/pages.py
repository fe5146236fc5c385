"""The page of tables: a part for each group, told with the machine it was measured on; a part is replaced by itself."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from .report import Table, as_markdown

__all__ = ["parts_of", "with_part"]

HEAD = """\
# Benchmarks

Written by `make bench`, a part for each group; `python -m benchmarks --only GROUP --write docs/benchmarks.md` writes
one part anew. Every ratio compares two things measured in one run; absolute times are those of the machine that the
part names. Times are the best of several, warm.
"""
MARK = "<!-- group: {} -->"
MARKS = re.compile(r"^<!-- group: ([\w-]+) -->\n", re.MULTILINE)


def parts_of(page: str) -> dict[str, str]:
    """The parts of a page by group, in its order."""
    pieces = MARKS.split(page)[1:]
    return dict(zip(pieces[::2], pieces[1::2], strict=True))


def with_part(page: str, group: str, order: Sequence[str], machine: Mapping[str, str], tables: Sequence[Table]) -> str:
    """The page with this group's part replaced; parts stand in ``order``, groups that it does not name are dropped."""
    told = "; ".join(f"{label} {value}" for label, value in machine.items())
    part = f"\n*Group `{group}`: {told}.*\n\n" + "\n".join(as_markdown(table) for table in tables) + "\n"
    parts = {**parts_of(page), group: part}
    body = "\n".join(f"{MARK.format(name)}\n{parts[name].rstrip()}\n" for name in order if name in parts)
    return f"{HEAD}\n{body.rstrip()}\n"
