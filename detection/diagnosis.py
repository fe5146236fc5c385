"""What is wrong with a log as a whole, where hardly any of it makes sense: units, order in time, what ranges share.

Occlusion strikes some ranges for some time. What strikes all of them all the time is a fault of the installation, and
is told with its likely cause.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from .epochs import RangeEpoch, RangeMeasurement, RangingAnchor
from .geometric import MOST_RANGES
from .settings import DetectorSettings
from .systematic import Block, SharedFit, shared_fit
from .units import range_unit, time_unit
from .verdicts import EpochResult, Rejection, Sight

__all__ = ["Cause", "EpochNote", "Suspicion", "diagnose", "note_of", "suspicions_of"]

Floats = npt.NDArray[np.float64]
Heard = tuple[float, float, float, float, float]  # place of the anchor, range, when

HARDLY = 0.2  # share of epochs with a position, or of ranges that are clear, under which something is said in any case
FEW = 0.8  # the same, under which a cause is looked for
ENOUGH = 10  # epochs, and blocks of ranges, before all this means anything
NOTABLE_REJECTIONS, FEW_LATE = 0.05, 4  # share and number of late epochs that are no stragglers any more
# A cause is named that leaves so little of what ranges are off without it, and so little of them off at all.
EXPLAINS = 0.5
# Where a cause leaves more sigmas of a range than so many, it has to explain the more. Of ranges from several moments
# the rover's turns leave some.
NEARLY, NEARLY_MOVING = 4.0, 10.0
SURELY = 2.0  # sigmas of a range: so little is left where a cause explains all
BLOCKS = 32
BLOCK_S = 15.0
FEET = 3.28084
NEAR_FEET = 0.03


class Cause(StrEnum):
    """What a log as a whole may suffer from."""

    RANGE_UNIT = "unit of ranges"
    TIME_UNIT = "unit of time"
    TIME_ORDER = "order in time"
    DIMENSION = "dimension"
    ALTITUDES = "altitudes of anchors"
    OFFSET = "offset of all ranges"
    SCALE = "scale of all ranges"
    SIGMA = "sigma of ranges"
    NOT_FOUND = "not found"


@dataclass(frozen=True, slots=True)
class Suspicion:
    """A likely cause, a sentence, and a number.

    value: of units how many metres or seconds one is, or how many times too long ranges are; metres of an offset or a
    sigma; how often rows go back; NaN where there is none.
    """

    cause: Cause
    sentence: str
    value: float = math.nan


@dataclass(frozen=True, slots=True)
class EpochNote:
    """What a diagnosis keeps of an epoch and its answer. places_m: where anchors stood then."""

    time_s: float
    measured: tuple[RangeMeasurement, ...]
    places_m: Mapping[str, tuple[float, float, float]]
    rejection: Rejection | None
    clear: int
    told: int
    located: bool
    needed: str


def note_of(epoch: RangeEpoch, result: EpochResult, places_m: Mapping[str, tuple[float, float, float]]) -> EpochNote:
    """What of an epoch and its answer a diagnosis needs."""
    clear = sum([verdict.sight is Sight.CLEAR for verdict in result.verdicts])
    return EpochNote(
        epoch.time_s, epoch.ranges, places_m, result.rejection, clear, len(result.verdicts),
        result.position is not None, result.needed,
    )  # fmt: skip


def places_of(anchors: Iterable[RangingAnchor]) -> dict[str, tuple[float, float, float]]:
    """East, north, altitude by id."""
    return {anchor.id: (anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in anchors}


def diagnose(
    anchors: Sequence[RangingAnchor],
    epochs: Sequence[RangeEpoch],
    results: Sequence[EpochResult],
    settings: DetectorSettings,
) -> tuple[Suspicion, ...]:
    """What a log suffers from as a whole, likeliest first; empty where nothing is striking.

    results: what a detector with these settings answered to the epochs, one for each.
    """
    places_m, notes = places_of(anchors), []
    for epoch, result in zip(epochs, results, strict=True):
        if epoch.moved:
            places_m = places_m | places_of(one for one in epoch.moved if one.id in places_m)
        notes.append(note_of(epoch, result, places_m))
    return suspicions_of(notes, settings)


def suspicions_of(notes: Sequence[EpochNote], settings: DetectorSettings) -> tuple[Suspicion, ...]:
    """The same of what was noted."""
    used = [note for note in notes if note.rejection is None]
    located = sum([note.located for note in used]) / max(len(used), 1)
    told = sum([note.told for note in used])
    clear = sum([note.clear for note in used]) / max(told, 1)
    found = [*_times(notes), *_order(notes, located)]
    blocks = _blocks(notes, settings)
    unit = range_unit([(block.anchors_m, block.ranges_m) for block in blocks], settings.dimension)
    if unit is not None:
        found.append(Suspicion(Cause.RANGE_UNIT, unit[1], unit[0]))
    elif not found and len(used) >= ENOUGH and min(located, clear) < FEW:
        heights_m = {up_m for note in used for _, _, up_m in note.places_m.values()}
        found += _shared(blocks, settings.dimension == 3 and heights_m == {0.0}, min(located, clear) < HARDLY, settings)
        if not found and min(located, clear) < HARDLY:
            found += _nothing_else(used, located, clear)
    return tuple(found)


def _times(notes: Sequence[EpochNote]) -> list[Suspicion]:
    unit = time_unit([note.time_s for note in notes])
    return [] if unit is None else [Suspicion(Cause.TIME_UNIT, unit[1], unit[0])]


def _order(notes: Sequence[EpochNote], located: float) -> list[Suspicion]:
    back = sum([after.time_s < before.time_s for before, after in itertools.pairwise(notes)])
    late = sum([note.rejection in (Rejection.LATE, Rejection.OUT_OF_ORDER) for note in notes])
    many_late = late > max(FEW_LATE, NOTABLE_REJECTIONS * len(notes))
    if not back or not (many_late or (located < FEW and len(notes) >= ENOUGH)):
        return []
    times = "once" if back == 1 else f"{back} times"
    what = f"{late} of {len(notes)} epochs were not used" if late else "ranges of one moment do not stand together"
    return [
        Suspicion(
            Cause.TIME_ORDER,
            f"Rows go back in time {times}, and {what}: sort them by time_s.",
            back,
        )
    ]


def _shared(blocks: Sequence[Block], level: bool, hardly: bool, settings: DetectorSettings) -> list[Suspicion]:
    """The one fault shared by all ranges that explains by far best what they are off, if one does.

    level: all anchors stand at altitude 0, in three dimensions. hardly: something is to be said in any case.
    """
    d, sigma_m = settings.dimension, settings.range_sigma_m
    blocks = [block for block in blocks if len(np.unique(block.anchors_m[:, :d], axis=0)) > d]
    if len(blocks) < ENOUGH:
        return [_ALTITUDES] if level else []
    speed = max(settings.max_speed_m_per_s / 3.0, 1e-3)
    plain = shared_fit(blocks, d, sigma_m, speed, "nothing")
    if plain is None:
        return []
    tolerance_m = settings.k_geometric * sigma_m
    typical_m = float(np.median(np.concatenate([block.ranges_m for block in blocks])))
    causes = []
    offset, scale = (shared_fit(blocks, d, sigma_m, speed, what) for what in ("offset", "scale"))
    if offset is not None and abs(offset.offset_m) > max(0.3 * tolerance_m, 3.0 * offset.offset_sigma_m):
        causes.append((offset.sigma_m, _offset(offset)))
    if scale is not None and abs(scale.scale - 1.0) > max(0.3 * tolerance_m / typical_m, 3.0 * scale.scale_sigma):
        causes.append((scale.sigma_m, _scale(scale)))
    in_space = shared_fit([b for b in blocks if len(b.ranges_m) > 3], 3, sigma_m, speed, "nothing") if d == 2 else None
    left_m, best = min(causes, key=lambda cause: cause[0], default=(math.inf, _ALTITUDES))
    if in_space is not None and in_space.sigma_m < EXPLAINS * plain.sigma_m:
        # an offset does about what a height does; anchors that were given heights were given them for a reason
        given = any(block.anchors_m[:, 2].any() for block in blocks)
        if (given and in_space.sigma_m < SURELY * sigma_m) or in_space.sigma_m < EXPLAINS * left_m:
            return [Suspicion(Cause.DIMENSION, _IN_SPACE)]
        best = replace(best, sentence=best.sentence + _OR_IN_SPACE)
    at_once = not any(block.late_s.any() for block in blocks)
    share = EXPLAINS if left_m < (NEARLY if at_once else NEARLY_MOVING) * sigma_m else 0.5 * EXPLAINS
    if left_m < share * plain.sigma_m and not (level and left_m > SURELY * sigma_m):
        return [best]
    if level:
        return [_ALTITUDES]
    return _loose(plain, settings) if hardly and at_once else []


_ALTITUDES = Suspicion(
    Cause.ALTITUDES,
    "The ranges do not meet, and all anchors stand at altitude 0: were their altitudes left out? If all is level, take "
    "two dimensions.",
)
_IN_SPACE = (
    "The ranges meet in space but not in the plane: anchors and rover are not at one height; take three dimensions, "
    "with the anchors' altitudes."
)


_OR_IN_SPACE = " Or anchors and rover are not at one height: try three dimensions."


def _offset(fit: SharedFit) -> Suspicion:
    word = "long" if fit.offset_m > 0.0 else "short"
    sentence = (
        f"All ranges are about {abs(fit.offset_m):.2f} m too {word} (± {max(fit.offset_sigma_m, 0.005):.2f} m): "
        "calibrate the antenna delay."
    )
    return Suspicion(Cause.OFFSET, sentence, fit.offset_m)


def _scale(fit: SharedFit) -> Suspicion:
    for factor, sentence in (
        (FEET, "The ranges are about 3.28 times what fits the anchors: are they in feet?"),
        (1.0 / FEET, "The ranges are about 0.305 times what fits the anchors: are the anchors' places in feet?"),
    ):
        if abs(fit.scale / factor - 1.0) < NEAR_FEET:
            return Suspicion(Cause.RANGE_UNIT, sentence, fit.scale)
    word = "long" if fit.scale > 1.0 else "short"
    much = f"{100.0 * abs(fit.scale - 1.0):.1f} % too {word}"
    if not 0.5 < fit.scale < 1.5:
        much = f"{fit.scale:.3g} times what fits the anchors"
    sentence = f"All ranges are about {much}: calibrate their scale."
    return Suspicion(Cause.SCALE, sentence, fit.scale)


def _loose(plain: SharedFit, settings: DetectorSettings) -> list[Suspicion]:
    """Ranges that scatter far more than they were said to, where nothing that they share explains it."""
    if plain.sigma_m < 2.5 * settings.range_sigma_m:
        return []
    return [
        Suspicion(
            Cause.SIGMA,
            f"Ranges are off by about {plain.sigma_m:.2g} m wherever the rover is put, and range_sigma_m is "
            f"{settings.range_sigma_m:.3g} m: is that too small, are most occluded, or do anchors stand "
            "elsewhere?",
            plain.sigma_m,
        )
    ]


def _nothing_else(used: Sequence[EpochNote], located: float, clear: float) -> list[Suspicion]:
    needs = Counter(note.needed for note in used if note.needed)
    often = f" Most often needed: {needs.most_common(1)[0][0]}" if needs else ""
    if located < HARDLY:
        return [Suspicion(Cause.NOT_FOUND, f"Only {located:.0%} of the epochs have a position.{often}", located)]
    sentence = (
        f"Only {clear:.0%} of the ranges are clear: suspect where the anchors stand, which is which, or the ranging "
        f"itself.{often}"
    )
    return [Suspicion(Cause.NOT_FOUND, sentence, clear)]


def _blocks(notes: Sequence[EpochNote], settings: DetectorSettings) -> list[Block]:
    """Some ranges of about one place each, evenly over the log: an epoch, or as many in a row as make up for one."""
    gathered: list[list[Heard]] = []
    rows: list[Heard] = []
    begin_s = -math.inf
    for note in notes:
        fresh = [
            (*note.places_m[one.anchor_id], one.range_m, note.time_s)
            for one in note.measured
            if one.anchor_id in note.places_m and math.isfinite(one.range_m) and one.range_m > 0.0
        ]
        if len(fresh) > settings.dimension:
            gathered.append(fresh)
            continue
        if not 0.0 <= note.time_s - begin_s <= BLOCK_S or len(rows) >= 4 * settings.dimension + 4:
            gathered.append(rows)
            rows, begin_s = [], note.time_s
        rows = rows + fresh
    enough = [one for one in (*gathered, rows) if len(one) > 1]
    chosen = np.unique(np.linspace(0, len(enough) - 1, min(BLOCKS, len(enough))).astype(int)) if enough else ()
    return [_block(np.array(enough[i][:MOST_RANGES], np.float64)) for i in chosen]


def _block(rows: Floats) -> Block:
    anchors_m = np.ascontiguousarray(rows[:, :3])
    late_s = rows[:, 4] - 0.5 * (rows[:, 4].min() + rows[:, 4].max())
    return Block(anchors_m, np.ascontiguousarray(rows[:, 3]), late_s)
