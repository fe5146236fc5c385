"""Where ranges and the map disagree for long: evidence about the map, by place and bearing, and how sure it is.

Of each range the map says with what probability it is direct, the other witnesses with what probability it is off.
While the two contradict one another evidence adds up, as a log-likelihood ratio of "the map is wrong here" over "it is
right" that never falls below even odds; epochs close in time count as one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from detection import AnchorVerdict, Say, Witness
from detection.fusion import fused_probability
from visibility.sight import SightDoubt

__all__ = ["Doubts", "Expected", "MapDoubt", "Trust", "off_without_map"]

# evidence of one independent look is cut here: no map and no range is surer than this
MOST_PER_LOOK = math.log(20.0)
LOOK_S = 2.0  # of ranging errors that last, only one look in so many seconds is independent
SURE = math.log(200.0)  # log odds from which a contradiction is told
HIGHEST = 2.0 * SURE  # more makes the end of a contradiction slow to see
KEPT = 1000  # contradictions that a session remembers; the surest stay

USUAL_SIGHT = 0.9  # what a detector takes without a map
# A map is believed as far as it has been right: it begins with so many right words of so many, and all are forgotten
# as new ones come.
RIGHT, WORDS, MEMORY = 19.0, 20.0, 400.0
TOLD = 0.8  # what the map and the ranges say is counted where both are surer than this


class Expected(StrEnum):
    """What the map has of an anchor where ranges say the opposite."""

    IN_SIGHT = "in sight"
    HIDDEN = "hidden"


@dataclass(frozen=True, slots=True)
class MapDoubt:
    """A stretch over which the ranges of an anchor contradict the map.

    expected: what the map has. from_s, to_s: of its ranges, on the base station's clock. ranges: how many.
    places_m: (east, north) of the rover, a few along the stretch. bearing_rad: from the middle one to the anchor,
    clockwise from the map's north: there stands what the map lacks, or does not stand what it has. distance_m: how far
    the anchor is. excess_m: the largest excess of the ranges. probability: that the map is wrong there.
    """

    anchor_id: str
    expected: Expected
    from_s: float
    to_s: float
    ranges: int
    places_m: tuple[tuple[float, float], ...]
    bearing_rad: float
    distance_m: float
    excess_m: float
    probability: float

    def weight(self, reach_m: float) -> SightDoubt:
        """The same as a weight on what a map has, for ``Anchor.doubts`` and other sessions; reach_m: as there.

        Raises VisibilityInputError.
        """
        return SightDoubt(self.places_m, self.probability, self.expected is Expected.IN_SIGHT, reach_m)


def off_without_map(verdict: AnchorVerdict) -> float | None:
    """Probability that a range is off by the witnesses that know no map; None where they are silent."""
    return fused_probability([say for say in verdict.says if say.witness is not Witness.PREDICTION])


class Trust:
    """How far a session believes its map, in sight and hidden each: as far as it has been right; changed in place."""

    def __init__(self) -> None:
        self._right = dict.fromkeys((True, False), RIGHT)
        self._words = dict.fromkeys((True, False), WORDS)

    def note(self, p_direct: float, p_off: float) -> None:
        """Take in what the map had of a range, and what the other witnesses have of it."""
        if max(p_direct, 1.0 - p_direct) > TOLD and max(p_off, 1.0 - p_off) > TOLD:
            word = p_direct > 0.5
            kept = 1.0 - 1.0 / MEMORY
            self._words[word] = kept * self._words[word] + 1.0
            self._right[word] = kept * self._right[word] + float(word == (p_off < 0.5))

    def believed(self, p_direct: float) -> float:
        """The map's word as far as it is believed."""
        clear, hidden = (self._right[word] / self._words[word] for word in (True, False))
        if p_direct >= USUAL_SIGHT:
            return min(p_direct, max(clear, USUAL_SIGHT))
        # a map whose "hidden" is mostly wrong says no more than none
        trust = max(2.0 * hidden - 1.0, 0.0)
        return USUAL_SIGHT + trust * (p_direct - USUAL_SIGHT)


@dataclass(slots=True)
class _Stretch:
    """A contradiction that goes on; changed in place."""

    expected: Expected
    from_s: float
    to_s: float
    odds: float = 0.0
    most: float = 0.0
    ranges: int = 0
    excess_m: float = -math.inf
    places_m: list[tuple[float, float]] = field(default_factory=list)


@dataclass(slots=True)
class Doubts:
    """Contradictions of a session, those that go on and those that are over; changed in place."""

    _open: dict[str, _Stretch] = field(default_factory=dict)
    _over: list[MapDoubt] = field(default_factory=list)

    def note(
        self,
        verdict: AnchorVerdict,
        p_off: float,
        p_direct: float,
        time_s: float,
        rover_m: Sequence[float],
        anchor_m: Sequence[float],
    ) -> None:
        """Take in one verdict beside what the map had: p_direct as ``SightForecast`` has it.

        p_off: ``off_without_map`` of the verdict.
        rover_m, anchor_m: east, north.
        """
        if any(say.says is Say.TOO_SHORT for say in verdict.says):
            return
        agree = p_direct * (1.0 - p_off) + (1.0 - p_direct) * p_off
        step = min(max(-math.log(max(2.0 * agree, 1e-9)), -MOST_PER_LOOK), MOST_PER_LOOK)
        expected = Expected.IN_SIGHT if p_direct > 0.5 else Expected.HIDDEN
        stretch = self._open.get(verdict.anchor_id)
        if stretch is not None and stretch.expected is not expected and step > 0.0:
            self._close(verdict.anchor_id, anchor_m)
            stretch = None
        if stretch is None:
            if step <= 0.0:
                return
            stretch = self._open[verdict.anchor_id] = _Stretch(expected, time_s, time_s)
        share = min((time_s - stretch.to_s) / LOOK_S, 1.0) if stretch.ranges else 1.0
        stretch.odds = min(stretch.odds + share * step, HIGHEST)
        if stretch.odds <= 0.0:
            self._close(verdict.anchor_id, anchor_m)
            return
        stretch.to_s = time_s
        stretch.ranges += 1
        if step > 0.0:
            stretch.most = max(stretch.most, stretch.odds)
            stretch.excess_m = max(stretch.excess_m, verdict.excess_m)
            stretch.places_m.append((rover_m[0], rover_m[1]))
            if len(stretch.places_m) > 32:
                stretch.places_m = stretch.places_m[::2]

    def stands(self, anchor_id: str) -> bool:
        """Whether the ranges of this anchor contradict the map surely, and still do."""
        stretch = self._open.get(anchor_id)
        return stretch is not None and stretch.odds >= SURE

    def hidden(self) -> tuple[str, ...]:
        """Anchors that the ranges surely have for hidden where the map has them in sight, and still do."""
        return tuple(i for i, one in self._open.items() if one.odds >= SURE and one.expected is Expected.IN_SIGHT)

    def found(self, anchors_m: dict[str, Sequence[float]]) -> tuple[MapDoubt, ...]:
        """All that are sure, in the order of their beginnings; anchors_m: where each anchor is."""
        now = [_doubt(i, one, anchors_m[i]) for i, one in self._open.items() if one.most >= SURE]
        return tuple(sorted([*self._over, *now], key=lambda one: (one.from_s, one.anchor_id)))

    def _close(self, anchor_id: str, anchor_m: Sequence[float]) -> None:
        stretch = self._open.pop(anchor_id)
        if stretch.most >= SURE:
            self._over.append(_doubt(anchor_id, stretch, anchor_m))
            if len(self._over) > KEPT:
                self._over.remove(min(self._over, key=lambda one: one.probability))


def _doubt(anchor_id: str, stretch: _Stretch, anchor_m: Sequence[float]) -> MapDoubt:
    places_m = tuple(stretch.places_m)
    middle_m = places_m[len(places_m) // 2]
    east_m, north_m = anchor_m[0] - middle_m[0], anchor_m[1] - middle_m[1]
    return MapDoubt(
        anchor_id, stretch.expected, stretch.from_s, stretch.to_s, stretch.ranges, places_m,
        math.atan2(east_m, north_m) % (2.0 * math.pi), math.hypot(east_m, north_m), stretch.excess_m,
        1.0 / (1.0 + math.exp(-stretch.most)),
    )  # fmt: skip
