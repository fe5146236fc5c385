"""``sightline reposition``: anchors, verdicts and the way ahead in; moves, plans and a picture out."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.products.repositionings.calculate import RepositioningSummary
from service.products.repositionings.request import RepositioningParameters

from .maps import make_map
from .output import facts_table, share_text
from .request_files import given

__all__ = ["RoverOptions", "lasting_occlusions", "make_repositioning"]


@dataclass(frozen=True, slots=True)
class RoverOptions:
    """Where the rover is and where it is heading."""

    place: str | None
    heading_deg: float | None
    ahead_m: float | None

    def fields(self, *, lonlat: bool) -> dict[str, object] | None:
        """As the request has them; None without a rover. Raises RequestError."""
        if self.place is None:
            if self.heading_deg is not None or self.ahead_m is not None:
                raise RequestError("--heading and --ahead go with --rover EAST,NORTH.")
            return None
        try:
            first, second = (float(part) for part in self.place.split(","))
        except ValueError as error:
            raise RequestError(f"--rover {self.place!r} is not of the form EAST,NORTH.") from error
        if self.heading_deg is None:
            raise RequestError("--rover needs --heading.")
        place = {"lon_deg": first, "lat_deg": second} if lonlat else {"east_m": first, "north_m": second}
        return given({"place": place, "heading_deg": self.heading_deg, "ahead_m": self.ahead_m})


def make_repositioning(dem: str, asked: RepositioningParameters, **rest: Any) -> None:
    """Read, calculate, write and print; ``rest`` as for make_map."""
    from service.products.repositionings import REPOSITIONING

    make_map(dem, REPOSITIONING, asked, _tables, summary="reposition.json", what="Repositioning", **rest)


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


def _tables(answer: RepositioningSummary) -> tuple[Table, ...]:
    table = Table(title=escape(answer.sentence), title_justify="left")
    table.add_column("moves", style="bold")
    for column in ("leaves s", "arrives s", "flies m", "to east m", "to north m", "altitude m", "above\nground m"):
        table.add_column(column, justify="right", no_wrap=True)
    for move in answer.moves:
        to = move.to
        table.add_row(
            escape(move.anchor_id),
            f"{move.start_s:.0f}",
            f"{move.end_s:.0f}",
            f"{move.flight_m:.0f}",
            f"{to.east_m:.0f}",
            f"{to.north_m:.0f}",
            f"{to.altitude_m:.1f}",
            "–" if to.above_ground_m is None else f"{to.above_ground_m:.1f}",
        )
    facts = [
        ("goal", answer.goal),
        ("occluded", ", ".join(answer.occluded) or "–"),
        ("of the path before", share_text(answer.before_share)),
        ("of the path after", share_text(answer.after_share)),
        ("restored everywhere", "yes" if answer.restored else "no"),
    ]
    if len(answer.stretches) > 1:
        facts.append(("stretches", str(len(answer.stretches))))
        facts.append(("the rover waits", f"{answer.waited_s:.0f} s"))
    return table, facts_table("What it brings", facts)
