"""``sightline place``: candidates, targets, rules and a goal in; placed anchors, files and maps out."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.products.placements.answer import PlacementSummary
from service.products.placements.request import PlacementParameters

from .anchor_texts import position_fields
from .height_words import height_field
from .maps import make_map
from .output import facts_table, share_text
from .request_files import given
from .shape_files import path_fields, place_fields, polygon_fields, stand_off_fields, weight_fields

__all__ = ["CandidateOptions", "GoalOptions", "RuleOptions", "TargetOptions", "make_placement"]

BASE_FORM = "--base {} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 10agl or 612msl."
Fields = dict[str, object]


@dataclass(frozen=True, slots=True)
class CandidateOptions:
    """Where an anchor could be put: a lattice, masts and sites."""

    spacing_m: float | None
    heights: list[str]
    where: Path | None
    masts: list[str]
    sites: list[str]

    def fields(self) -> list[Fields]:
        """As the request has them. Raises RequestError."""
        found: list[Fields] = []
        if self.spacing_m is not None:
            if not self.heights:
                raise RequestError("--spacing needs at least one --height, such as 120agl or 900msl.")
            lattice = {"spacing_m": self.spacing_m, **_heights(self.heights)}
            areas = [None] if self.where is None else polygon_fields(self.where)
            found += [given({**lattice, "area": area}) for area in areas]
        elif self.heights or self.where is not None:
            raise RequestError("--height and --where need --spacing.")
        for what, texts in (("mast", self.masts), ("site", self.sites)):
            for text in texts:
                name, comma, height = text.rpartition(",")
                if not comma:
                    raise RequestError(f"--{what} {text!r} is not of the form FILE,HEIGHT such as roads.geojson,10agl.")
                found.append({"what": what, "places": place_fields(Path(name)), **_heights([height])})
        if not found:
            raise RequestError("No candidates: give --spacing with --height, --mast, --site or --request.")
        return found


@dataclass(frozen=True, slots=True)
class TargetOptions:
    """Where the rover has to see anchors."""

    area: Path | None
    path: Path | None
    corridor_width_m: float | None
    weights: Path | None
    receiver_above_ground_m: float | None

    def fields(self) -> Fields:
        """As the request has them. Raises RequestError."""
        found = asdict(self)
        if self.area is not None:
            polygons = polygon_fields(self.area)
            if len(polygons) > 1:
                raise RequestError(f"The file {self.area.name} holds {len(polygons)} polygons; --area takes one.")
            found["area"] = polygons[0]
        if self.weights is not None:
            found["weights"] = weight_fields(self.weights)
        if self.path is not None:
            found["path"] = path_fields(self.path)
        return given(found)


@dataclass(frozen=True, slots=True)
class GoalOptions:
    """What is good; its fields are those of the request."""

    objective: str
    min_anchors: int
    dop_limit: float
    measure: str
    kind: str
    on_surface: bool
    spare: int = 0

    def fields(self) -> Fields:
        """As the request has them."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class RuleOptions:
    """Where anchors may be."""

    no_fly: list[Path]
    max_above_ground_m: float | None
    max_altitude_m: float | None
    max_range_m: float | None
    min_separation_m: float | None
    min_above_ground_m: float | None = None
    stand_off: tuple[str, ...] = ()
    bases: tuple[str, ...] = ()
    link_range_m: float | None = None
    relays: int = 0

    def fields(self, *, lonlat: bool) -> Fields:
        """As the request has them. Raises RequestError."""
        return given(
            {
                "no_fly": [polygon for file in self.no_fly for polygon in polygon_fields(file)],
                "stand_off": [shape for text in self.stand_off for shape in stand_off_fields(text)],
                "min_above_ground_m": self.min_above_ground_m,
                "max_above_ground_m": self.max_above_ground_m,
                "max_altitude_m": self.max_altitude_m,
                "max_range_m": self.max_range_m,
                "min_separation_m": self.min_separation_m,
                "link": self._link(lonlat),
            }
        )

    def _link(self, lonlat: bool) -> Fields | None:
        if not self.bases:
            if self.link_range_m is not None or self.relays:
                raise RequestError("--link-range and --relays need --base EAST,NORTH,HEIGHT.")
            return None
        bases = [position_fields(text, lonlat=lonlat, complaint=BASE_FORM.format(repr(text))) for text in self.bases]
        return given({"bases": bases, "max_range_m": self.link_range_m, "relays": self.relays})


def make_placement(dem: str, asked: PlacementParameters, scheduler: str | None, *, or_local: bool, **rest: Any) -> None:
    """Read, calculate, write and print; ``rest`` as for make_map. Ctrl-C ends the search with the best so far.

    scheduler: address of a Dask scheduler to work on. Raises RequestError.
    """
    if or_local and scheduler is None:
        raise RequestError("--or-local goes with --scheduler.")
    from service.products.placements.product import PLACEMENT
    from service.products.product import Work

    if scheduler is not None:
        asked = asked.model_copy(update={"run_on": "cluster_or_here" if or_local else "cluster"})
    with _interrupt_as_stop() as stop:
        work = Work(stop=stop, scheduler=scheduler)
        make_map(dem, PLACEMENT, asked, _tables, summary="place.json", what="Placing anchors", work=work, **rest)


@contextmanager
def _interrupt_as_stop() -> Iterator[Callable[[], bool]]:
    """A function that tells whether Ctrl-C was pressed; a second one interrupts as ever."""
    pressed = False
    before = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield lambda: pressed
    finally:
        signal.signal(signal.SIGINT, before)


def _heights(texts: list[str]) -> Fields:
    form = "The height {!r} is not of the form 120agl (above ground) or 900msl (altitude)."
    heights = [height_field(text, form.format(text)) for text in texts]
    datums = {height["altitude_datum"] for height in heights if "altitude_datum" in height}
    if len(datums) > 1:
        raise RequestError("The heights of one set of places count from one datum: all as msl, or all as hae.")
    found: Fields = {
        name: [height[name] for height in heights if name in height] for name in ("above_ground_m", "altitude_m")
    }
    return found | ({"altitude_datum": datums.pop()} if datums else {})


def _tables(answer: PlacementSummary) -> tuple[Table, ...]:
    shares = answer.value_share is not None

    def told(value: float) -> str:
        return share_text(value) if shares else f"{value:.3f} m"

    table = Table(title=escape(answer.goal), title_justify="left")
    table.add_column("placed", style="bold")
    for column in ("east m", "north m", "altitude m", "above\nground m", "adds", "left when\nit is lost"):
        table.add_column(column, justify="right", no_wrap=True)
    for placed in answer.placed:
        above_m = placed.above_ground_m
        table.add_row(
            escape(placed.id),
            f"{placed.east_m:.0f}",
            f"{placed.north_m:.0f}",
            f"{placed.altitude_m:.1f}",
            "–" if above_m is None else f"{above_m:.1f}",
            told(placed.number("marginal")),
            told(placed.number("after_loss")),
        )
    hover, targets = answer.hover, answer.targets
    facts = [
        ("before", told(answer.number("before"))),
        ("with the placed anchors", told(answer.number("value"))),
        ("the same, mode exact", told(answer.number("exact"))),
        ("no choice exceeds", told(answer.number("bound"))),
        ("greedy alone", told(answer.number("greedy"))),
        *_dilution_facts(answer),
        (f"hovering ±{hover.hover_m:g} m off, worst of {hover.draws}", told(hover.number("worst"))),
        ("found by", answer.method + (", proved best" if answer.proved else "")),
        ("candidates", f"{answer.candidates.left:,}"),
        *((f"  removed, {name}", f"{number:,}") for name, number in answer.candidates.removed.items()),
    ]
    if answer.fewest_possible is not None:
        facts.insert(0, ("anchors needed at least", str(answer.fewest_possible)))
    if answer.stopped:
        facts.insert(0, ("stopped early", "this is the best so far"))
    if targets.within_limits_m is not None:
        facts.append(("path within limits", f"{targets.within_limits_m / 1000.0:.2f} km"))
    return table, facts_table("What it is worth", facts)


def _dilution_facts(answer: PlacementSummary) -> list[tuple[str, str]]:
    """What the placed anchors' geometry is worth, whatever they were placed for."""
    told, goal = answer.dilution, answer.parameters["goal"]
    assert isinstance(goal, Mapping)
    name = told.measure.upper()
    return [
        (f"{name}, median", "no fix" if told.median is None else f"{told.median:.2f}"),
        (f"{name} below {goal['dop_limit']:g}", share_text(told.within_limit_share)),
        ("no fix", share_text(told.no_fix_share)),
    ]
