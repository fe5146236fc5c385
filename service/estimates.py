"""What a calculation takes of what an operator limits, told before anything is allocated for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

from .errors import LimitError
from .settings import GIB, Settings

__all__ = ["Demand", "budget", "calculation", "refuse_beyond", "sight_lines", "signals_over"]

Limit = Literal[
    "max_anchors", "max_anchor_cells", "max_candidates", "max_voxels", "max_worker_memory_bytes", "max_job_s"
]
# About four times what one core takes; meant to tell seconds from hours, not to predict.
SECONDS_PER_CELL_AND_ANCHOR = {"fast": 20e-9, "exact": 500e-9}
# Of what is usable each cell asks for some 6 signals, which cost as much as the posts that they pass: about the middle
# between gentle ground (0.01 µs) and rough ground (0.12 µs), of which trees take twice as much; at one height for one.
SECONDS_PER_SIGNAL_CELL_AND_SIDE = 40e-9
SIGNALS_PER_CELL = 6
TIMES_WITH_TREES = 2.0
BYTES_PER_CELL = 24
# altitude, hidden-below and visible: float32, float32, uint8
BYTES_PER_CELL_AND_ANCHOR = 9


@dataclass(frozen=True, slots=True)
class Demand:
    """How much of a limited thing a calculation takes.

    limit_name: of ``Settings``. amount: in the unit of the limit. what, remedy: begin and end of the sentence that
    refuses it, as in ``what`` more than the limit of 64 ``remedy``.
    """

    limit_name: Limit
    amount: float
    what: str
    remedy: str = " in one request"


def refuse_beyond(demands: Iterable[Demand], settings: Settings) -> None:
    """Raises LimitError for the first that is beyond its limit; those after it are not even worked out."""
    for demand in demands:
        limit: float = getattr(settings, demand.limit_name)
        if demand.amount > limit:
            raise LimitError(
                f"{demand.what} more than the limit of {_told(demand.limit_name, limit)}{demand.remedy}",
                limit_name=demand.limit_name,
                limit=limit,
                given=demand.amount,
            )


def _told(name: Limit, limit: float) -> str:
    match name:
        case "max_worker_memory_bytes":
            return f"{limit / GIB:.3g} GiB of memory"
        case "max_job_s":
            return f"{limit:g} s"
        case "max_anchor_cells":
            return f"{limit:,} cells x anchors"
    return f"{limit:,}"


def calculation(what: str, memory_bytes: float, seconds: float, remedy: str) -> tuple[Demand, Demand]:
    """Memory, and seconds of one core, of what is told in words; remedy: what to ask for instead."""
    takes = f"{what} would take about {memory_bytes / GIB:.2g} GiB of memory and {seconds:.2g} s,"
    remedy = f"; ask for {remedy}"
    return (
        Demand("max_worker_memory_bytes", memory_bytes, takes, remedy),
        Demand("max_job_s", seconds, takes, remedy),
    )


def sight_lines(cells: int, sources: int, mode: Literal["fast", "exact"]) -> Iterator[Demand]:
    """Of a map of so many anchors and satellites: nearly all that it takes is their sight lines."""
    yield Demand("max_anchors", sources, f"{sources} anchors and satellites are")
    memory_bytes = cells * (BYTES_PER_CELL + sources * BYTES_PER_CELL_AND_ANCHOR)
    seconds = cells * sources * SECONDS_PER_CELL_AND_ANCHOR[mode]
    what, remedy = f"{cells:,} cells x {sources} anchor{'s' * (sources != 1)}", "fewer anchors or a smaller DEM"
    memory, time = calculation(what, memory_bytes, seconds, remedy)
    yield from (Demand("max_anchor_cells", cells * sources, memory.what, memory.remedy), memory, time)


def signals_over(cells: int, sources: int, trees: bool, *, one_height: bool = False) -> Demand:
    """Of a map of what is usable, besides its sight lines: nearly all the time that it takes.

    trees: on the ground. one_height: receivers are at one height above ground, of which each cell asks once.
    """
    per_cell_s = SECONDS_PER_SIGNAL_CELL_AND_SIDE * math.sqrt(cells) * (TIMES_WITH_TREES if trees else 1.0)
    seconds = cells * sources * per_cell_s / (SIGNALS_PER_CELL if one_height else 1)
    what = f"What is usable over {cells:,} cells x {sources:,} anchor{'s' * (sources != 1)}{' with trees' * trees}"
    return Demand(
        "max_job_s", seconds, f"{what} would take about {seconds:.2g} s,", "; ask for fewer anchors or a smaller DEM"
    )


def budget(seconds: float) -> Demand:
    """Of a search that may take so long."""
    return Demand("max_job_s", seconds, f"A budget of {seconds:g} s is", " for one job")
