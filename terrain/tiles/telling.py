"""What there is to tell about a mosaic, in sentences: what came from where, voids, seams, contradictions, datums."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..crs.frames import body_of
from ..datums.references import HeightReference, VerticalDatum, reference_of_name, vertical_datum_named
from ..errors import DemUnsupportedError
from ..files.placing import Placed
from ..grid import ElevationGrid
from ..told_places import told_place
from ..voids import implausible_heights
from .layer import CONTRADICTION_M, Part
from .levelling import Step, levels_told
from .plan import RULE, MosaicPlan

__all__ = ["Overlap", "check_datums", "overlaps_told", "plan_told", "source_of", "with_sentences"]

# share of an area that may lie beside all tiles before it is told: outlines are straight between few points
BESIDE = 1e-3


@dataclass(frozen=True, slots=True)
class Overlap:
    """Where a coarser layer and finer ones both know the ground: how far they are apart, and where most.

    row, col: of the post of the mosaic where they contradict one another first; None where they do nowhere.
    """

    name: str
    posts: int
    median_m: float
    largest_m: float
    contradictions: int
    row: int | None
    col: int | None


def source_of(plan: MosaicPlan) -> str:
    """What to call the mosaic."""
    tiles = plan.tiles
    return tiles[0].name if len(tiles) == 1 else f"mosaic of {len(tiles):,} tiles"


def check_datums(parts: Sequence[Part], wanted: VerticalDatum | None) -> tuple[str | None, tuple[str, ...]]:
    """(the vertical datum of a mosaic, warnings). wanted: to which tiles were brought that tell theirs.

    Raises DemUnsupportedError where tiles count from different zeros still.
    """
    datums = Counter[str | None]()
    for part in parts:
        datums.update(part.datums)
    named = [datum for datum in datums if datum is not None]
    if wanted is not None:
        named.sort(key=lambda name: vertical_datum_named(name) != wanted)
    kinds = {reference_of_name(datum) for datum in named} - {HeightReference.UNKNOWN}
    if len(kinds) > 1:
        raise DemUnsupportedError(
            f"The tiles count heights from different zeros ({' and '.join(sorted(named))}), up to 100 m apart; bring "
            "them to one vertical datum first."
        )
    warnings = []
    if len({vertical_datum_named(name) or name for name in named}) > 1:
        warnings.append(f"The tiles name several vertical datums ({', '.join(sorted(named))}); {named[0]} is told.")
    if named and datums[None]:
        warnings.append(f"{datums[None]:,} tiles do not say what heights count from; {named[0]} of the others is told.")
    return (named[0] if named else None), tuple(warnings)


def plan_told(plan: MosaicPlan, parts: Sequence[Part], wanted: VerticalDatum | None) -> tuple[list[str], list[str]]:
    """(conversions, warnings) about the tiles, what they said themselves among them. wanted: as of ``check_datums``."""
    conversions, warnings = list[str](), list[str]()
    several = len(plan.tiles) > 1
    if plan.area is not None and plan.uncovered > BESIDE:
        warnings.append(f"{100.0 * plan.uncovered:.3g} % of the area, with its margin, lie in no tile.")
    if len(plan.layers) > 1:
        conversions += [RULE, *(planned.reason() for planned in plan.layers)]
    elif several:
        conversions.append(
            f"{len(plan.tiles):,} tiles on one lattice were put together; posts that several hold were taken once."
        )
    steps = dict[str, Step]()
    for name, step in ((name, step) for part in parts for name, step in part.steps.items()):
        steps[name] = step.with_more(steps[name]) if name in steps else step
    conversions += levels_told(steps, wanted)
    conversions += _with_counts(Counter(dict(plan.levels)), len(plan.tiles))
    read = sum(sum(part.datums.values()) for part in parts)
    for part in parts:
        conversions += _with_counts(part.conversions, read)
        warnings += _with_counts(part.warnings, read)
        if part.filled:
            conversions.append(f"{part.filled:,} posts that are void in one tile were filled from the next.")
        if part.differing:
            warnings.append(
                f"{part.differing:,} posts are held by two tiles that differ, by up to {part.largest_m:.3g} m; the "
                "first by name was taken."
            )
        if part.contradictions and part.contradiction_at is not None:
            x, y = part.contradiction_at
            warnings.append(
                f"Two tiles contradict one another by more than {CONTRADICTION_M:g} m at {part.contradictions:,} "
                f"posts, first at x {x:.10g}, y {y:.10g} in {part.posts.crs.name}; one of them is wrong."
            )
    return conversions, warnings


def overlaps_told(overlaps: Sequence[Overlap], grid: ElevationGrid) -> tuple[list[str], list[str]]:
    """(conversions, warnings) about layers that know the same ground."""
    conversions, warnings = list[str](), list[str]()
    for over in overlaps:
        if over.posts:
            conversions.append(
                f"{over.name} knows {over.posts:,} posts that finer tiles give, {over.median_m:.3g} m apart in the "
                f"median and {over.largest_m:.3g} m at most."
            )
        if over.row is not None and over.col is not None:
            where = told_place(grid, *grid.position_of(float(over.row), float(over.col)))
            warnings.append(
                f"{over.name} contradicts finer tiles by more than {CONTRADICTION_M:g} m at {over.contradictions:,} "
                f"posts, first at {where}; one of them is wrong."
            )
    return conversions, warnings


def with_sentences(
    grid: ElevationGrid,
    conversions: Sequence[str],
    warnings: Sequence[str],
    *,
    placed: Placed | None = None,
    uncovered: tuple[int, int] = (0, 1),
) -> ElevationGrid:
    """The grid with what there is to tell; what it tells already comes last. uncovered: how many
    posts lie in no tile, of how many. Raises DemUnsupportedError where no height is known."""
    told, warned = list(conversions), list(warnings)
    if placed is not None:
        told += placed.conversions
        warned += placed.warnings
    if grid.unknown_posts == grid.heights_m.size:
        raise DemUnsupportedError(f"{grid.provenance.source} knows no height in the area: all of its posts are void.")
    alone, of = uncovered
    if alone:
        warned.append(f"{alone:,} of {of:,} posts ({100.0 * alone / of:.3g} %) lie in no tile; they are unknown.")
    if grid.crs is None or body_of(grid.crs).name == "Earth":
        warned += implausible_heights(grid.heights_m)
    before = grid.provenance
    provenance = replace(
        before,
        conversions=(*dict.fromkeys((*told, *before.conversions)),),
        warnings=(*dict.fromkeys((*warned, *before.warnings)),),
    )
    return replace(grid, provenance=provenance)


def _with_counts(sentences: Counter[str], read: int) -> list[str]:
    """Each sentence of tiles once, with how many of those that were read said it."""
    return [f"{text} ({number:,} of {read:,} tiles)" if read > 1 else text for text, number in sentences.items()]
