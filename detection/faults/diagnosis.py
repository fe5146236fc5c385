"""What is wrong with a log as a whole, where hardly any of it makes sense: units, order in time, what ranges share.

Occlusion strikes some ranges for some time. What strikes all of them all the time is a fault of the installation, and
is told with its likely cause.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..epochs import RangeEpoch, RangeMeasurement, RangingAnchor
from ..geometric import MOST_RANGES
from ..settings import DetectorSettings
from ..units import range_unit, time_unit
from ..verdicts import EpochResult, OdometryCondition, Rejection, Sight
from .causes import ENOUGH, FEW, HARDLY, SPACE, shared_cause
from .frames import UNKNOWN_STEP, Step, frame_of_headings, places_in_degrees
from .suspicions import Cause, Suspicion
from .systematic import Block

__all__ = ["EpochNote", "blocks_of", "diagnose", "note_of", "suspicions_of"]

Floats = npt.NDArray[np.float64]
Places = Mapping[str, tuple[float, float, float]]
Heard = tuple[str, float, float, Places]  # anchor, range, when, where anchors stood

NOTABLE_REJECTIONS, FEW_LATE = 0.05, 4  # share and number of late epochs that are no stragglers any more
BLOCKS = 80
ABSURD = 1e12  # no range is so long in any unit
BLOCK_S = 15.0
TRUSTED = (OdometryCondition.RELIABLE, OdometryCondition.MISLED)


@dataclass(frozen=True, slots=True)
class EpochNote:
    """What a diagnosis keeps of an epoch and its answer. places_m: where anchors stood then."""

    time_s: float
    measured: tuple[RangeMeasurement, ...]
    places_m: Places
    rejection: Rejection | None
    clear: int
    told: int
    located: bool
    needed: str
    step: Step = UNKNOWN_STEP


def note_of(epoch: RangeEpoch, result: EpochResult, places_m: Places) -> EpochNote:
    """What of an epoch and its answer a diagnosis needs."""
    clear = sum([verdict.sight is Sight.CLEAR for verdict in result.verdicts])
    return EpochNote(
        epoch.time_s, epoch.ranges, places_m, result.rejection, clear, len(result.verdicts),
        result.position is not None, result.needed, _step_of(epoch, result),
    )  # fmt: skip


def _step_of(epoch: RangeEpoch, result: EpochResult) -> Step:
    """Where odometry leads by its heading as it was told, and where ranges that check one another meet."""
    driven_m = place_m = None
    motion = epoch.odometry
    if motion is not None and motion.heading_rad is not None and result.odometry in TRUSTED:
        wheels_m = motion.wheel_m or motion.accelerometer_m
        if wheels_m is not None:
            length_m = math.hypot(*wheels_m[:2])
            driven_m = (length_m * math.sin(motion.heading_rad), length_m * math.cos(motion.heading_rad))
    if result.position is not None and result.position.checked:
        place_m = (float(result.position.position_m[0]), float(result.position.position_m[1]))
    return Step(driven_m, place_m)


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
    blocks = blocks_of(notes, settings)
    degrees = places_in_degrees(blocks, settings.dimension)
    unit = None if degrees else range_unit([(block.anchors_m, block.ranges_m) for block in blocks], settings.dimension)
    if unit is not None:
        found.append(Suspicion(Cause.RANGE_UNIT, unit[1], unit[0]))
    elif degrees:
        found += degrees
    elif not found and len(used) >= ENOUGH:
        heights_m = {up_m for note in used for _, _, up_m in note.places_m.values()}
        found += shared_cause(blocks, settings.dimension == 3 and heights_m == {0.0}, min(located, clear), settings)
        if not found:
            found += frame_of_headings([note.step for note in used], settings.range_sigma_m)
        if not found and min(located, clear) < HARDLY:
            found += _nothing_else(used, located, clear, settings.dimension)
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


def _nothing_else(used: Sequence[EpochNote], located: float, clear: float, dimension: int) -> list[Suspicion]:
    needs = Counter(note.needed for note in used if note.needed)
    often = f" Most often needed: {needs.most_common(1)[0][0]}" if needs else ""
    if located < HARDLY:
        return [Suspicion(Cause.NOT_FOUND, f"Only {located:.0%} of the epochs have a position.{often}", located)]
    few = sum([len(_heard(note)) <= dimension for note in used]) / len(used)
    if few > 1.0 - HARDLY:
        space = "in space" if dimension == SPACE else "in the plane"
        sentence = (
            f"{few:.0%} of the epochs have {dimension} ranges or fewer, which cannot check one another {space}: "
            f"whether they are clear is not known.{often}"
        )
        return [Suspicion(Cause.TOO_FEW, sentence, few)]
    sentence = (
        f"Only {clear:.0%} of the ranges are clear: suspect where the anchors stand, which is which, or the ranging "
        f"itself.{often}"
    )
    return [Suspicion(Cause.NOT_FOUND, sentence, clear)]


def _heard(note: EpochNote) -> list[Heard]:
    """The ranges of an epoch to anchors that there are, as far as they are lengths."""
    return [
        (one.anchor_id, one.range_m, note.time_s, note.places_m)
        for one in note.measured
        if one.anchor_id in note.places_m and 0.0 < one.range_m < ABSURD
    ]


def blocks_of(notes: Sequence[EpochNote], settings: DetectorSettings, most: int = BLOCKS) -> list[Block]:
    """Some ranges of about one place each, evenly over the log: an epoch, or as many in a row as make up for one."""
    gathered: list[list[Heard]] = []
    rows: list[Heard] = []
    begin_s = -math.inf
    for note in notes:
        fresh = _heard(note)
        if len(fresh) > settings.dimension:
            gathered.append(fresh)
            continue
        if not 0.0 <= note.time_s - begin_s <= BLOCK_S or len(rows) >= 4 * settings.dimension + 4:
            gathered.append(rows)
            rows, begin_s = [], note.time_s
        rows = rows + fresh
    enough = [one for one in (*gathered, rows) if len(one) > 1]
    chosen = np.unique(np.linspace(0, len(enough) - 1, min(most, len(enough))).astype(int)) if enough else ()
    return [_block(enough[i][:MOST_RANGES]) for i in chosen]


def _block(rows: Sequence[Heard]) -> Block:
    ids, ranges_m, times_s, places_m = zip(*rows, strict=True)
    anchors_m = np.array([where[anchor_id] for anchor_id, where in zip(ids, places_m, strict=True)], np.float64)
    middle_s = 0.5 * (min(times_s) + max(times_s))
    return Block(anchors_m, np.array(ranges_m), np.array(times_s) - middle_s, middle_s, ids, places_m[-1])
