"""``sightline place``: candidates, targets, rules and a goal in; placed anchors, files and maps out."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.products.placements.request import PlacementParameters

from .anchor_texts import height_field, position_fields
from .maps import anchors_of
from .older_maps import MapFiles, make_map
from .output import facts_table, share_text
from .request_files import given, request_from_file
from .shape_files import path_fields, place_fields, polygon_fields, stand_off_fields, weight_fields

__all__ = ["make_placement", "request_of"]

BASE_FORM = "--base {} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 10agl or 612msl."


def request_of(
    file: Path | None, options: dict[str, Any], goal: dict[str, Any], rules: dict[str, Any], rest: dict[str, Any]
) -> PlacementParameters:
    """What the options ask for, or a file that holds the whole request. Raises RequestError."""
    if file is not None:
        return request_from_file(file, PlacementParameters)
    candidates = _candidates(options)
    if not candidates:
        raise RequestError("No candidates: give --spacing with --height, --mast, --site or --request.")
    targets = {"corridor_width_m": options["corridor"], "receiver_above_ground_m": options["receiver_height"]}
    if options["area"] is not None:
        polygons = polygon_fields(options["area"])
        if len(polygons) > 1:
            raise RequestError(f"The file {options['area'].name} holds {len(polygons)} polygons; --area takes one.")
        targets["area"] = polygons[0]
    if options["weights"] is not None:
        targets["weights"] = weight_fields(options["weights"])
    if options["path"] is not None:
        targets["path"] = path_fields(options["path"])
    fields = {
        "anchors": anchors_of(options["anchor_texts"], options["anchor_files"], lonlat=options["lonlat"]),
        "candidates": candidates,
        "targets": given(targets),
        "goal": goal,
        "rules": {**given(rules), **_shapes(options), **_link(options)},
        "count": options["count"],
        "reach": options["reach"],
        **rest,
    }
    return PlacementParameters.model_validate(given(fields))


def make_placement(dem: str, asked: PlacementParameters, scheduler: str | None, *, or_local: bool, **rest: Any) -> None:
    """Read, calculate, write and print; ``rest`` as for make_map. Ctrl-C ends the search with the best so far.

    scheduler: address of a Dask scheduler to work on. Raises RequestError.
    """
    if or_local and scheduler is None:
        raise RequestError("--or-local goes with --scheduler.")
    from service.products.layers import LAYERS
    from service.products.placements.calculate import calculate_placement

    if scheduler is not None:
        asked = asked.model_copy(update={"run_on": "cluster_or_here" if or_local else "cluster"})
    with _interrupt_as_stop() as stop:
        calculate = partial(calculate_placement, stop=stop, scheduler=scheduler)
        files = MapFiles("place.json", tuple(LAYERS["placement"]))
        make_map(dem, asked, calculate, files, _tables, what="Placing anchors", **rest)


@contextmanager
def _interrupt_as_stop() -> Iterator[Any]:
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


def _candidates(options: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    if options["spacing"] is not None:
        if not options["heights"]:
            raise RequestError("--spacing needs at least one --height, such as 120agl or 900msl.")
        lattice = {"spacing_m": options["spacing"], **_heights(options["heights"])}
        areas = [None] if options["where"] is None else polygon_fields(options["where"])
        found += [given({**lattice, "area": area}) for area in areas]
    elif options["heights"] or options["where"] is not None:
        raise RequestError("--height and --where need --spacing.")
    for what, texts in (("mast", options["masts"]), ("site", options["sites"])):
        for text in texts:
            name, comma, height = text.rpartition(",")
            if not comma:
                raise RequestError(f"--{what} {text!r} is not of the form FILE,HEIGHT such as roads.geojson,10agl.")
            found.append({"what": what, "places": place_fields(Path(name)), **_heights([height])})
    return found


def _heights(texts: list[str]) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {"above_ground_m": [], "altitude_m": []}
    for text in texts:
        form = f"The height {text!r} is not of the form 120agl (above ground) or 900msl (altitude)."
        for field, metres in height_field(text, form).items():
            found[field].append(metres)
    return found


def _shapes(options: dict[str, Any]) -> dict[str, Any]:
    return {
        "no_fly": [polygon for file in options["no_fly"] for polygon in polygon_fields(file)],
        "stand_off": [shape for text in options["stand_off"] for shape in stand_off_fields(text)],
    }


def _link(options: dict[str, Any]) -> dict[str, Any]:
    if not options["bases"]:
        if options["link_range"] is not None or options["relays"]:
            raise RequestError("--link-range and --relays need --base EAST,NORTH,HEIGHT.")
        return {}
    bases = [
        position_fields(text, lonlat=options["lonlat"], complaint=BASE_FORM.format(repr(text)))
        for text in options["bases"]
    ]
    return {"link": given({"bases": bases, "max_range_m": options["link_range"], "relays": options["relays"]})}


def _tables(summary: dict[str, Any]) -> tuple[Table, ...]:
    unit = "share" if "value_share" in summary else "m"
    told = share_text if unit == "share" else lambda value: f"{value:.3f} m"
    table = Table(title=escape(summary["goal"]), title_justify="left")
    table.add_column("placed", style="bold")
    for column in ("east m", "north m", "altitude m", "above\nground m", "adds", "left when\nit is lost"):
        table.add_column(column, justify="right", no_wrap=True)
    for placed in summary["placed"]:
        above_m = placed["above_ground_m"]
        table.add_row(
            escape(placed["id"]),
            f"{placed['east_m']:.0f}",
            f"{placed['north_m']:.0f}",
            f"{placed['altitude_m']:.1f}",
            "–" if above_m is None else f"{above_m:.1f}",
            told(placed[f"marginal_{unit}"]),
            told(placed[f"after_loss_{unit}"]),
        )
    hover, removed = summary["hover"], summary["candidates"]["removed"]
    facts = [
        ("before", told(summary[f"before_{unit}"])),
        ("with the placed anchors", told(summary[f"value_{unit}"])),
        ("the same, mode exact", told(summary[f"exact_{unit}"])),
        ("no choice exceeds", told(summary[f"bound_{unit}"])),
        ("greedy alone", told(summary[f"greedy_{unit}"])),
        *_dilution_facts(summary),
        (f"hovering ±{hover['hover_m']:g} m off, worst of {hover['draws']}", told(hover[f"worst_{unit}"])),
        ("found by", summary["method"] + (", proved best" if summary["proved"] else "")),
        ("candidates", f"{summary['candidates']['left']:,}"),
        *((f"  removed, {name}", f"{number:,}") for name, number in removed.items()),
    ]
    if summary["fewest_possible"] is not None:
        facts.insert(0, ("anchors needed at least", str(summary["fewest_possible"])))
    if summary["stopped"]:
        facts.insert(0, ("stopped early", "this is the best so far"))
    if summary["targets"]["within_limits_m"] is not None:
        facts.append(("path within limits", f"{summary['targets']['within_limits_m'] / 1000.0:.2f} km"))
    return table, facts_table("What it is worth", facts)


def _dilution_facts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """What the placed anchors' geometry is worth, whatever they were placed for."""
    told, limit = summary["dilution"], summary["parameters"]["goal"]["dop_limit"]
    name = told["measure"].upper()
    return [
        (f"{name}, median", "no fix" if told["median"] is None else f"{told['median']:.2f}"),
        (f"{name} at most {limit:g}", share_text(told["within_limit_share"])),
        ("no fix", share_text(told["no_fix_share"])),
    ]
