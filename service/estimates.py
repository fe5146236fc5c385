"""What a calculation will take, told before anything is allocated for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .errors import LimitError
from .settings import GIB, Settings

__all__ = [
    "Estimate",
    "estimate_map",
    "refuse_beyond_limits",
    "refuse_budget",
    "refuse_frames",
    "refuse_map",
    "refuse_placement",
    "refuse_site_map",
    "refuse_volume",
]

# About four times what one core takes; meant to tell seconds from hours, not to predict.
SECONDS_PER_CELL_AND_ANCHOR = {"fast": 20e-9, "exact": 500e-9}
BYTES_PER_CELL = 24
# places, normals, weights and what each target has in sight
BYTES_PER_TARGET = 320
# of a frame over time: altitude and state of a column, and working it out
BYTES_PER_FRAME, SECONDS_PER_COLUMN = 5, 2e-6
# of a map of sites: what is seen of each post and from it, with and without unknown ground, turned four ways
BYTES_PER_SITE, SECONDS_PER_STEP = 80, 1e-9
# altitude, hidden-below and visible: float32, float32, uint8
BYTES_PER_CELL_AND_ANCHOR = 9


@dataclass(frozen=True, slots=True)
class Estimate:
    """Cells of the DEM, anchors, and what they take: bytes of memory and seconds of one core."""

    cells: int
    anchors: int
    memory_bytes: int
    seconds: float

    def sentence(self) -> str:
        """In words."""
        return (
            f"{self.cells:,} cells x {self.anchors} anchor{'s' if self.anchors != 1 else ''} would take about "
            f"{self.memory_bytes / GIB:.2g} GiB of memory and {self.seconds:.2g} s"
        )


def estimate_map(cells: int, anchors: int, mode: Literal["fast", "exact"]) -> Estimate:
    """What a map of so many cells and anchors takes, satellites among them: nearly all of it is their sight lines."""
    return Estimate(
        cells,
        anchors,
        cells * BYTES_PER_CELL + cells * anchors * BYTES_PER_CELL_AND_ANCHOR,
        cells * anchors * SECONDS_PER_CELL_AND_ANCHOR[mode],
    )


def refuse_budget(budget_s: float, settings: Settings) -> None:
    """Raises LimitError for a plan that may take longer than a job may run."""
    if budget_s > settings.max_job_s:
        raise LimitError(
            f"A budget of {budget_s:g} s is more than the limit of {settings.max_job_s:g} s for one job",
            limit_name="max_job_s",
            limit=settings.max_job_s,
            given=budget_s,
        )


def refuse_map(cells: int, sources: int, mode: Literal["fast", "exact"], settings: Settings) -> None:
    """Raises LimitError for a map of too many anchors and satellites, or one that would take too much."""
    if sources > settings.max_anchors:
        raise LimitError(
            f"{sources} anchors and satellites are more than the limit of {settings.max_anchors} in one request",
            limit_name="max_anchors",
            limit=settings.max_anchors,
            given=sources,
        )
    refuse_beyond_limits(estimate_map(cells, sources, mode), settings)


def refuse_placement(cells: int, candidates: int, mode: Literal["fast", "exact"], settings: Settings) -> None:
    """Raises LimitError for a placement among too many candidates, or one that would take too much.

    Surfaces are held for a few candidates at a time; what grows with both is one bit of sight for each pair.
    """
    if candidates > settings.max_candidates:
        raise LimitError(
            f"{candidates:,} candidates are more than the limit of {settings.max_candidates:,} in one request",
            limit_name="max_candidates",
            limit=settings.max_candidates,
            given=candidates,
        )
    memory_bytes = cells * (BYTES_PER_TARGET + candidates // 4)
    seconds = cells * candidates * SECONDS_PER_CELL_AND_ANCHOR[mode]
    _refuse_beyond(f"{candidates:,} candidates over {cells:,} cells", "candidates", memory_bytes, seconds, settings)


def refuse_site_map(cells: int, directions: int, steps: int, settings: Settings) -> None:
    """Raises LimitError for a map of sites that would take too much; steps: of the longest ray."""
    seconds = cells * directions * steps * SECONDS_PER_STEP
    what = f"{directions} directions of {steps:,} steps over {cells:,} cells"
    _refuse_beyond(what, "directions, a shorter range", cells * BYTES_PER_SITE, seconds, settings)


def refuse_frames(cells: int, frames: int, moving: int, mode: Literal["fast", "exact"], settings: Settings) -> None:
    """Raises LimitError for a morphing map over time that would take too much; moving: anchors and satellites."""
    memory_bytes = cells * (frames * BYTES_PER_FRAME + BYTES_PER_CELL)
    seconds = cells * frames * (moving * SECONDS_PER_CELL_AND_ANCHOR[mode] + SECONDS_PER_COLUMN)
    _refuse_beyond(f"{frames} frames over {cells:,} cells", "frames", memory_bytes, seconds, settings)


def _refuse_beyond(what: str, fewer: str, memory_bytes: int, seconds: float, settings: Settings) -> None:
    for name, asked, limit, words in (
        ("max_worker_memory_bytes", memory_bytes, settings.max_worker_memory_bytes, "bytes of memory"),
        ("max_job_s", seconds, settings.max_job_s, "s"),
    ):
        if asked > limit:
            raise LimitError(
                f"{what} would take about {asked:,.3g} {words}, more than the limit of {limit:,.3g} {words}; ask for "
                f"fewer {fewer}, or a smaller DEM",
                limit_name=name,
                limit=limit,
                given=asked,
            )


def refuse_volume(voxels: int, settings: Settings) -> None:
    """Raises LimitError for a control volume of too many voxels."""
    if voxels > settings.max_voxels:
        raise LimitError(
            f"The volume has {voxels:,} voxels, more than the limit of {settings.max_voxels:,}; ask for thicker "
            "layers, a lower ceiling or smaller bounds",
            limit_name="max_voxels",
            limit=settings.max_voxels,
            given=voxels,
        )


def refuse_beyond_limits(estimate: Estimate, settings: Settings) -> None:
    """Raises LimitError, with the estimate in its sentence."""
    given: dict[str, tuple[float, float, str]] = {
        "max_anchor_cells": (
            estimate.cells * estimate.anchors,
            settings.max_anchor_cells,
            f"{settings.max_anchor_cells:,} cells x anchors",
        ),
        "max_worker_memory_bytes": (
            estimate.memory_bytes,
            settings.max_worker_memory_bytes,
            f"{settings.max_worker_memory_bytes / GIB:.3g} GiB of memory",
        ),
        "max_job_s": (estimate.seconds, settings.max_job_s, f"{settings.max_job_s:g} s"),
    }
    for name, (asked, limit, words) in given.items():
        if asked > limit:
            raise LimitError(
                f"{estimate.sentence()}, more than the limit of {words}; ask for fewer anchors or a smaller DEM",
                limit_name=name,
                limit=limit,
                given=asked,
            )
