"""``sightline reposition``: anchors, verdicts and the way ahead in; moves, plans and a picture out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.products.repositionings.request import RepositioningParameters

from .maps import anchors_of
from .older_maps import MapFiles, make_map
from .output import facts_table, share_text
from .request_files import given, request_from_file
from .shape_files import path_fields, polygon_fields

__all__ = ["lasting_occlusions", "make_repositioning", "repositioning_request"]


def repositioning_request(
    file: Path | None,
    options: dict[str, Any],
    goal: dict[str, Any],
    rules: dict[str, Any],
    flight: dict[str, Any],
    rest: dict[str, Any],
) -> RepositioningParameters:
    """What the options ask for, or a file that holds the whole request. Raises RequestError."""
    if file is not None:
        return request_from_file(file, RepositioningParameters)
    anchors = anchors_of(options["anchor_texts"], options["anchor_files"], lonlat=options["lonlat"])
    occluded = list(options["occluded"])
    if options["verdicts"] is not None:
        ids = {anchor.id for anchor in anchors}
        lasting = lasting_occlusions(options["verdicts"], options["persistent_s"])
        occluded += [one for one in lasting if one in ids and one not in occluded]
    fields = {
        "anchors": anchors,
        "occluded": occluded,
        "path": None if options["path"] is None else path_fields(options["path"]),
        "rover": _rover(options),
        "goal": goal,
        "rules": {**given(rules), "no_fly": [one for path in options["no_fly"] for one in polygon_fields(path)]},
        "flight": given(flight),
        **rest,
    }
    return RepositioningParameters.model_validate(given(fields))


def make_repositioning(dem: str, asked: RepositioningParameters, **rest: Any) -> None:
    """Read, calculate, write and print; ``rest`` as for make_map."""
    from service.products.layers import LAYERS
    from service.products.repositionings.calculate import calculate_repositioning

    files = MapFiles("reposition.json", tuple(LAYERS["repositioning"]))
    make_map(dem, asked, calculate_repositioning, files, _tables, what="Repositioning", **rest)


def lasting_occlusions(path: Path, at_least_s: float) -> list[str]:
    """Anchors whose every range was occluded to the end of a replayed log, and for so long. Raises RequestError."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        last = {anchor["id"]: anchor["last_sight"] for anchor in told["anchors"]}
        latest = {episode["anchor_id"]: episode for episode in told["episodes"]}
        return [
            name
            for name, episode in latest.items()
            if last[name] != "clear" and episode["to_s"] - episode["from_s"] >= at_least_s
        ]
    except OSError as error:
        raise RequestError(f"The verdicts {str(path)!r} cannot be read: {error.strerror}.") from error
    except (ValueError, KeyError, TypeError) as error:
        raise RequestError(f"The file {path.name} is no detection.json of sightline detect.") from error


def _rover(options: dict[str, Any]) -> dict[str, Any] | None:
    if options["rover"] is None:
        if options["heading"] is not None or options["ahead"] is not None:
            raise RequestError("--heading and --ahead go with --rover EAST,NORTH.")
        return None
    pair = ("lon_deg", "lat_deg") if options["lonlat"] else ("east_m", "north_m")
    try:
        first, second = (float(part) for part in options["rover"].split(","))
    except ValueError as error:
        raise RequestError(f"--rover {options['rover']!r} is not of the form EAST,NORTH.") from error
    if options["heading"] is None:
        raise RequestError("--rover needs --heading.")
    place = {pair[0]: first, pair[1]: second}
    return given({"place": place, "heading_deg": options["heading"], "ahead_m": options["ahead"]})


def _tables(summary: dict[str, Any]) -> tuple[Table, ...]:
    table = Table(title=escape(summary["sentence"]), title_justify="left")
    table.add_column("moves", style="bold")
    for column in ("leaves s", "arrives s", "flies m", "to east m", "to north m", "altitude m", "above\nground m"):
        table.add_column(column, justify="right", no_wrap=True)
    for move in summary["moves"]:
        to = move["to"]
        above_m = to["above_ground_m"]
        table.add_row(
            escape(move["anchor_id"]),
            f"{move['start_s']:.0f}",
            f"{move['end_s']:.0f}",
            f"{move['flight_m']:.0f}",
            f"{to['east_m']:.0f}",
            f"{to['north_m']:.0f}",
            f"{to['altitude_m']:.1f}",
            "–" if above_m is None else f"{above_m:.1f}",
        )
    facts = [
        ("goal", summary["goal"]),
        ("occluded", ", ".join(summary["occluded"]) or "–"),
        ("of the path before", share_text(summary["before_share"])),
        ("of the path after", share_text(summary["after_share"])),
        ("restored everywhere", "yes" if summary["restored"] else "no"),
    ]
    if len(summary["stretches"]) > 1:
        facts.append(("stretches", str(len(summary["stretches"]))))
        facts.append(("the rover waits", f"{summary['waited_s']:.0f} s"))
    return table, facts_table("What it brings", facts)
