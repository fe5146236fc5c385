"""``sightline reposition``: which drone should move where, so that what is asked for holds along the way ahead."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .asking.doubts import TRUSTING, DoubtOptions
from .asking.ground import AreaOptions, Margin
from .asking.options import (
    GROUP,
    AnchorOptions,
    DemPath,
    Output,
    Reading,
    ReceiverHeight,
    RequestFile,
    SignalOptions,
    option,
    told,
)
from .asking.placing import HoldingGoal, MoveRules
from .output import facts_table, share_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.products.repositionings.calculate import RepositioningSummary

__all__ = ["reposition"]


@GROUP
@dataclass(frozen=True, slots=True)
class OcclusionOptions:
    """Which anchors are hidden, and which may move."""

    occluded: Annotated[
        tuple[str, ...], option("An anchor that is hidden, whatever the map says. Repeatable.", "ID")
    ] = ()
    verdicts: Annotated[
        Path | None, option("detection.json of sightline detect: anchors occluded to its end join them.", "FILE")
    ] = None
    persistent_s: Annotated[
        float, option("How long they must have been occluded in --verdicts, seconds.", "S", "--persistent")
    ] = 10.0
    movable: Annotated[tuple[str, ...], option("May move; default all. Repeatable.", "ID")] = ()

    def part(self, among: set[str]) -> dict[str, object]:
        """As the request has them. among: the anchors that there are. Raises RequestError."""
        if not (math.isfinite(self.persistent_s) and self.persistent_s >= 0.0):
            raise RequestError(f"--persistent must be a number of seconds >= 0, not {self.persistent_s}.")
        lasting = [] if self.verdicts is None else _lasting_occlusions(self.verdicts, self.persistent_s)
        hidden = list(dict.fromkeys((*self.occluded, *(one for one in lasting if one in among))))
        return {"occluded": hidden, **({"movable": list(self.movable)} if self.movable else {})}


@GROUP
@dataclass(frozen=True, slots=True)
class AheadOptions:
    """The ``path`` ahead of the rover, or the ``rover`` of a request."""

    path: Annotated[Path | None, option("GeoJSON LineString, or path.csv of a plan: the path ahead.", "FILE")] = None
    rover: Annotated[str | None, option("Where the rover is, in place of --path.", "EAST,NORTH")] = None
    heading_deg: Annotated[
        float | None, option("Its heading, clockwise from grid north, degrees.", "DEG", "--heading")
    ] = None
    ahead_m: Annotated[float | None, option("So far ahead along it. (default 500)", "M", "--ahead")] = None

    def part(self, *, lonlat: bool) -> dict[str, object]:
        """As the request has them. Raises RequestError."""
        from .asking.path_files import path_fields
        from .asking.texts import place_fields

        found: dict[str, object] = {} if self.path is None else {"path": path_fields(self.path)}
        if self.rover is None:
            if self.heading_deg is not None or self.ahead_m is not None:
                raise RequestError("--heading and --ahead go with --rover EAST,NORTH.")
            return found
        form = f"--rover {self.rover!r} is not of the form EAST,NORTH."
        place = place_fields(self.rover, lonlat=lonlat, complaint=form)
        if self.heading_deg is None:
            raise RequestError("--rover needs --heading.")
        ahead = {} if self.ahead_m is None else {"ahead_m": self.ahead_m}
        return {**found, "rover": {"place": place, "heading_deg": self.heading_deg, **ahead}}


@GROUP
@dataclass(frozen=True, slots=True)
class MoveOptions:
    """What moves are looked for: fields of the request itself."""

    receiver_above_ground_m: ReceiverHeight = None
    share: Annotated[float, option("Of the path along which it shall hold, 0..1.", "SHARE")] = 1.0
    heights_above_ground_m: Annotated[
        tuple[float, ...],
        option(
            "Height above ground to move to; these and no others. Repeatable. (default 60, 120, own altitude)",
            "M",
            "--height",
        ),
    ] = ()
    cheapest: Annotated[Literal["distance", "time"], option("Of which the cheapest move is taken.")] = "distance"
    stretch_m: Annotated[
        float | None, option("Plan moves stretch by stretch of so many metres: leapfrog.", "M", "--stretch")
    ] = None
    rover_m_per_s: Annotated[float | None, option("Of the rover. (default 1)", "M/S", "--rover-speed")] = None


@GROUP
@dataclass(frozen=True, slots=True)
class DroneOptions:
    """The ``flight`` of a request: how drones fly."""

    max_flight_m: Annotated[float | None, option("Longest flight of one move.", "M", "--max-flight")] = None
    speed_m_per_s: Annotated[float | None, option("Of drones, level. (default 12)", "M/S", "--speed")] = None
    climb_m_per_s: Annotated[float | None, option("Of drones, upwards. (default 3)", "M/S", "--climb")] = None
    descent_m_per_s: Annotated[float | None, option("Of drones, downwards. (default 2)", "M/S", "--descent")] = None
    clearance_m: Annotated[float | None, option("Kept above the ground. (default 20)", "M", "--clearance")] = None


def reposition(
    dem: DemPath,
    /,
    *,
    anchors: AnchorOptions = AnchorOptions(),
    occlusions: OcclusionOptions = OcclusionOptions(),
    ahead: AheadOptions = AheadOptions(),
    goal: HoldingGoal = HoldingGoal(),
    moves: MoveOptions = MoveOptions(),
    flight: DroneOptions = DroneOptions(),
    rules: MoveRules = MoveRules(),
    sight: SignalOptions = SignalOptions(),
    doubts: DoubtOptions = TRUSTING,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Find which drone should move where, at the least flight, so that what is asked for holds along the way ahead.

    Writes reposition.json, moves.geojson, moves.kml, schedule.csv, anchors.csv,
    plans.zip with a .plan for each drone that moves, and map.png into --out.
    """
    from service.products.repositionings.request import RepositioningParameters

    from .asking.products import ask, request_of_fields

    asked: BaseModel | Path | None = request
    if asked is None:
        standing = anchors.read()
        fields = {
            **occlusions.part({one.id for one in standing}),
            **ahead.part(lonlat=anchors.lonlat),
            "goal": told(goal),
            **told(moves),
            "flight": told(flight),
            "rules": rules.part(),
            **sight.part([one.model_dump(exclude_none=True, exclude_unset=True) for one in standing]),
            **doubts.part(),
            "area": area.part(in_degrees=anchors.lonlat),
        }
        asked = request_of_fields(fields, RepositioningParameters)
    from service.products.repositionings import REPOSITIONING

    ask(
        REPOSITIONING,
        dem,
        asked,
        _tables,
        summary="reposition.json",
        what="Repositioning",
        reading=reading,
        output=output,
        margin_m=margin_m,
    )


def _lasting_occlusions(path: Path, at_least_s: float) -> list[str]:
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
    from planning.words import time_words

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
        ("heights looked at", answer.heights),
        ("of the path before", share_text(answer.before_share)),
        ("of the path after", share_text(answer.after_share)),
        ("restored everywhere", "yes" if answer.restored else "no"),
    ]
    if len(answer.stretches) > 1:
        facts.append(("stretches", str(len(answer.stretches))))
        facts.append(("the rover waits", time_words(answer.waited_s)))
    return table, facts_table("What it brings", facts)
