"""Names that other programs give to what a log of ranges holds: words, units in names, and which column is which."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from service.errors import RequestError

from .form import LENGTHS_M

__all__ = ["Found", "find_columns", "is_anchor", "is_range", "range_unit_of", "time_unit_of", "words_of"]

WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-zµ]+|\d+")
TIME = {
    "time",
    "timestamp",
    "stamp",
    "zeit",
    "uhrzeit",
    "zeitstempel",
    "epoch",
    "t",
    "ts",
    "sec",
    "secs",
    "seconds",
    "temps",
}
NO_TIME = {"flight", "duration", "tof", "offset", "delay", "sync"}
ANCHOR = {"anchor", "beacon", "dest", "destination", "responder", "station", "anker", "peer", "to", "node", "balise"}
WEAK_ANCHOR = {"id", "mac", "addr", "address", "device", "name", "label"}
NO_ANCHOR = {
    "tag", "from", "source", "src", "initiator", "seq", "sequence", "frame", "session", "msg", "message", "host",
    "local", "x", "y", "z", "lat", "lon",
    "alt", "latitude", "longitude", "altitude", "east", "north", "up", "height", "count",
    "time", "timestamp", "stamp", "range", "distance", "dist", "power", "rssi", "rss",
}  # fmt: skip
RANGE = {
    "range",
    "ranges",
    "ranging",
    "distance",
    "distances",
    "dist",
    "dis",
    "rng",
    "entfernung",
    "abstand",
    "distanz",
}
NO_RANGE = {
    "sigma", "std", "stddev", "stdev", "var", "variance", "covariance", "cov", "err", "error", "accuracy",
    "uncertainty", "min", "max",
    "true", "truth", "gt", "groundtruth", "ground", "ref", "reference", "expected", "rate", "velocity",
    "rms", "quality", "power", "rss", "rssi", "status", "type",
}  # fmt: skip
SIGMA = {"sigma", "std", "stddev", "stdev", "accuracy", "uncertainty"}
TIME_UNITS = {"ms": "ms", "msec": "ms", "millis": "ms", "us": "us", "µs": "us", "usec": "us", "micros": "us"}
TIME_UNITS |= {"ns": "ns", "nsec": "ns", "nanos": "ns", "s": "s", "sec": "s", "secs": "s", "seconds": "s"}
LENGTHS = {**{unit: unit for unit in LENGTHS_M}, "metres": "m", "meters": "m", "feet": "ft", "metre": "m", "meter": "m"}
# range_1, distance [A3], dist-D1 (mm); A1_range, D2 distance
ID_LAST = re.compile(
    r"(?i:ranges?|distances?|dist|dis|rng|[rd](?=\W*\d))(?:[_\s.\-]+(?:to|m)\b)?(?:[_\s.\-:/(\[]+|(?=[A-Z\d]))(?P<id>[\w\-]+?)[\])]?"
)
ID_FIRST = re.compile(r"(?P<id>[\w\-]+?)[_\s.\-:/]+(?:range|ranges|distance|dist|rng)", re.IGNORECASE)
NODE = re.compile(r"(?:anchor|beacon|node|uwb|bs|station|a|b)[_\s\-]*\d+", re.IGNORECASE)
UNIT = re.compile(r"[_\s]*[\[(]?\b(mm|cm|km|m|ft)\b[\])]?$|_(mm|cm|km|m|ft)$")


@dataclass(frozen=True, slots=True)
class Found:
    """What columns were recognised. names: our name to the column; units: that their names say; told: in sentences."""

    names: dict[str, str]
    time_unit: str | None = None
    range_unit: str | None = None
    told: tuple[str, ...] = ()


def words_of(name: str) -> list[str]:
    """The words of a name, small: distanceFromTag, field.header.stamp, Range (m)."""
    return [word.casefold() for word in WORD.findall(name)]


def is_range(name: str) -> bool:
    """Whether a name says range or distance, and not its error, its limit or the truth."""
    words = set(words_of(name))
    return bool(words & RANGE) and not words & NO_RANGE


def is_anchor(name: str) -> int:
    """How surely a name means an anchor's id: 0 not at all, 3 by both an anchor's word and one of ids."""
    words = set(words_of(name))
    if words & NO_ANCHOR:
        return 0
    return 2 * bool(words & ANCHOR) + bool(words & WEAK_ANCHOR)


def _time_rank(name: str) -> int:
    words = words_of(name)
    if not set(words) & TIME or set(words) & NO_TIME or "nsec" in words or "nsecs" in words or "nanosec" in words:
        return 0
    return 3 if "stamp" in words else 2 if words[-1] in ("time", "timestamp") or words[0] == "time" else 1


def time_unit_of(name: str) -> str | None:
    """The unit that the name of a time says, as time_ms or TimeUS; None where it says none."""
    words = words_of(name)
    return TIME_UNITS.get(words[-1]) if len(words) > 1 else None


def range_unit_of(name: str) -> str | None:
    """The unit that the name of a range says, as dist_mm or Range [cm]; None where it says none."""
    words = words_of(name)
    return next((LENGTHS[word] for word in words[1:] if word in LENGTHS), None)


def find_columns(
    table: str, columns: Sequence[str], given: Collection[str], anchor_ids: Collection[str] = (), lone: bool = False
) -> Found:
    """Which columns of a table hold what of time_s, anchor_id, range_m (range_m.ID) and sigma_m.

    given: our names that need not be found. anchor_ids: of the anchors that are known. lone: all ranges go to one
    anchor, and no column need say to which. Raises RequestError where two would do as well.
    """
    names: dict[str, str] = {}
    told: list[str] = []
    time_unit = range_unit = None
    if "time_s" not in given:
        time, more = _time(columns)
        if time is not None:
            names["time_s"], time_unit = time, time_unit_of(time)
            parts = {"nanoseconds": _nanoseconds(time, columns), "date": _date(time, columns)}
            names |= {name: column for name, column in parts.items() if column is not None}
            told += [f"Time is taken from {time!r}, not from {', '.join(map(repr, more))}."] if more else []
    if not any(name.startswith("range_m.") for name in given) and not {"anchor_id", "range_m"} <= set(given):
        anchor = _anchor(table, columns) if "anchor_id" not in given else None
        wide = {} if anchor or "range_m" in given or lone or "anchor_id" in given else _wide(columns, anchor_ids)
        if wide:
            names |= {f"range_m.{anchor_id}": column for anchor_id, column in wide.items()}
            units = {range_unit_of(column) for column in wide.values()} - {None}
            range_unit = units.pop() if len(units) == 1 else None
        else:
            names |= {"anchor_id": anchor} if anchor else {}
            if "range_m" not in given and (measured := _range(table, columns)) is not None:
                names["range_m"], range_unit = measured, range_unit_of(measured)
    sigmas = [column for column in columns if set(words_of(column)) & SIGMA]
    if "sigma_m" not in given and "range_m" in names and len(sigmas) == 1:
        names["sigma_m"] = sigmas[0]
    return Found(names, time_unit, range_unit, tuple(told))


def _time(columns: Sequence[str]) -> tuple[str | None, list[str]]:
    ranked = sorted(columns, key=_time_rank, reverse=True)
    best = [column for column in ranked if _time_rank(column)]
    if not best:
        return None, []
    with_parts = [column for column in best if _nanoseconds(column, columns)]
    first = with_parts[0] if with_parts else best[0]
    return first, [
        column for column in columns if column in best and column != first and _date(first, [column]) is None
    ]


def _nanoseconds(time: str, columns: Sequence[str]) -> str | None:
    words = words_of(time)
    if words[-1] not in ("sec", "secs", "s"):
        return None
    ends = ("nsec", "nsecs", "nanosec", "nanosecs", "ns")
    return next((one for one in columns if words_of(one)[:-1] == words[:-1] and words_of(one)[-1:][0] in ends), None)


def _date(time: str, columns: Sequence[str]) -> str | None:
    return next((one for one in columns if one != time and words_of(one) in (["date"], ["datum"])), None)


def _anchor(table: str, columns: Sequence[str]) -> str | None:
    best = max((is_anchor(column) for column in columns), default=0)
    likely = [column for column in columns if best and is_anchor(column) == best]
    if len(likely) > 1:
        raise RequestError(_either(table, "anchor_id", likely))
    return likely[0] if likely else None


def _range(table: str, columns: Sequence[str]) -> str | None:
    likely = [column for column in columns if is_range(column)]
    if len(likely) > 1:
        raise RequestError(_either(table, "range_m", likely))
    return likely[0] if likely else None


def _either(table: str, name: str, likely: Sequence[str]) -> str:
    shown = " or ".join(repr(column) for column in likely[:4])
    return f"In the log {table} {name} may be {shown}: say which, as in --columns {name}={likely[0]}."


def _wide(columns: Sequence[str], anchor_ids: Collection[str]) -> dict[str, str]:
    """Anchor id to the column of its ranges where each anchor has one; nothing where fewer than two have."""
    named = {column: column for column in columns if column in anchor_ids}
    if len(named) > 1:
        return named
    for pattern in (ID_LAST, ID_FIRST):
        found = {column: match["id"] for column in columns if (match := pattern.fullmatch(UNIT.sub("", column)))}
        found = {
            column: one for column, one in found.items() if is_range(column) or re.match(r"[rd]\W*\d", column, re.I)
        }
        if len(found) > 1:
            return {_known(column, one, anchor_ids): column for column, one in found.items()}
    nodes = [column for column in columns if NODE.fullmatch(column)]
    return {column: column for column in nodes} if len(nodes) > 1 else {}


def _known(column: str, anchor_id: str, anchor_ids: Collection[str]) -> str:
    """Of "D1" it is not clear whether the anchor is D1 or 1; that one which is known."""
    return column if column in anchor_ids else anchor_id
