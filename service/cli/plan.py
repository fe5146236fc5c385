"""``sightline plan``: a path for a rover on which the anchors stay in sight, or what blocks every path."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .asking.doubts import TRUSTING, DoubtOptions
from .asking.ground import AreaOptions, Margin
from .asking.options import (
    GROUP,
    WHOLE,
    Curvature,
    DemPath,
    HeardOptions,
    Kind,
    Measure,
    Mode,
    Output,
    PlacesAndAnchors,
    RangeSigma,
    Reading,
    RequestFile,
    TerrainFrame,
    Unknown,
    option,
    told,
)
from .asking.satellites import SatelliteOptions
from .output import facts_table

if TYPE_CHECKING:
    from service.products.paths.answer import PathSummary

__all__ = ["plan"]

PLACE = "EAST,NORTH"


@GROUP
@dataclass(frozen=True, slots=True)
class WayOptions:
    """From where to where, as typed."""

    start: Annotated[str | None, option("Where the rover is, metres in the DEM's CRS. Required.", PLACE)] = None
    goal: Annotated[
        tuple[str, ...],
        option("Where to: a place, or GeoJSON polygons. Required; repeatable: any will do.", f"{PLACE}|FILE"),
    ] = ()
    via: Annotated[tuple[str, ...], option("A place to pass; in order. Repeatable.", PLACE)] = ()
    no_go: Annotated[tuple[Path, ...], option("GeoJSON polygons to stay out of.", "FILE")] = ()
    keep_in: Annotated[tuple[Path, ...], option("GeoJSON polygons to stay within.", "FILE")] = ()

    def part(self, *, lonlat: bool) -> dict[str, object]:
        """As the request has them. Raises RequestError."""
        from .asking.path_files import polygon_fields
        from .asking.texts import place_fields

        def place(option: str, text: str) -> dict[str, float]:
            form = f"{option} {text!r} is not of the form EAST,NORTH, or LON,LAT with --lonlat."
            return place_fields(text, lonlat=lonlat, complaint=form)

        if self.start is None or not self.goal:
            raise RequestError(
                "A path needs --start EAST,NORTH and --goal EAST,NORTH (or a polygon file), or --request."
            )
        goals: list[object] = []
        for text in self.goal:
            of_file = Path(text).suffix.lower() in (".geojson", ".json")
            goals += polygon_fields(Path(text)) if of_file else [place("--goal", text)]
        return {
            "start": place("--start", self.start),
            "goals": goals,
            "way_points": [place("--via", text) for text in self.via],
            "no_go": [polygon for file in self.no_go for polygon in polygon_fields(file)],
            "keep_in": [polygon for file in self.keep_in for polygon in polygon_fields(file)],
        }


@GROUP
@dataclass(frozen=True, slots=True)
class RoverOptions:
    """The ``rover`` of a request."""

    max_slope_deg: Annotated[float | None, option("Steepest ground. (default 25)", "DEG", "--max-slope")] = None
    max_pitch_deg: Annotated[float | None, option("Steepest along the way.", "DEG", "--max-pitch")] = None
    max_roll_deg: Annotated[float | None, option("Steepest across the way.", "DEG", "--max-roll")] = None
    max_step_m: Annotated[float | None, option("Highest step under the rover.", "M", "--max-step")] = None
    footprint_radius_m: Annotated[float | None, option("Radius of the rover. (default 0.5)", "M", "--footprint")] = None
    receiver_above_ground_m: Annotated[
        float | None, option("Of its antenna over the ground. (default 1.5)", "M", "--receiver-height")
    ] = None
    min_turning_radius_m: Annotated[
        float | None, option("Tightest arc; 0 = turns on the spot. (default 0)", "M", "--turning-radius")
    ] = None
    can_reverse: Annotated[bool | None, option("It also drives backwards.", name="--reverse")] = None
    speed_m_per_s: Annotated[float | None, option("On level ground. (default 1)", "M/S", "--speed")] = None


@GROUP
@dataclass(frozen=True, slots=True)
class LimitOptions:
    """The ``limits`` of a request."""

    min_anchors: Annotated[int | None, WHOLE, option("At least so many in sight everywhere.", "K")] = None
    dop_limit: Annotated[float | None, option("The dilution of precision stays below it.", "NUMBER")] = None
    kind: Annotated[Kind | None, option("What is measured. (default ranging)")] = None
    measure: Annotated[Measure | None, option("Which dilution of precision. (default pdop)")] = None
    on_surface: Annotated[bool | None, option("Only motion along the ground is unknown.", name="--surface")] = None
    bubble_epsilon: Annotated[
        float | None, option("Safety bubble of so many sigmas, kept clear everywhere.", "EPSILON", "--bubble")
    ] = None
    dem_sigma_m: Annotated[float | None, option("Uncertainty of the ground, added to it.", "M", "--dem-sigma")] = None


@GROUP
@dataclass(frozen=True, slots=True)
class BudgetOptions:
    """The ``budget`` of a request."""

    iterations: Annotated[int | None, WHOLE, option("Of the sampling planner, which betters the grid's way.", "N")] = (
        None
    )
    no_sampling: Annotated[bool, option("Take the grid's way: sooner, and a little dearer.")] = False
    seconds: Annotated[float | None, option("Time-out of the plan. (default 60)", "S", "--time-limit")] = None

    def part(self) -> dict[str, object]:
        """As the request has it."""
        found = told(self)
        del found["no_sampling"]
        return {**found, "sampling": False} if self.no_sampling else found


@GROUP
@dataclass(frozen=True, slots=True)
class RestOptions:
    """Fields of the request itself."""

    start_heading_deg: Annotated[
        float | None, option("Where the rover looks at the start, from grid north.", "DEG", "--heading")
    ] = None
    departure_s: Annotated[
        float | None, option("When the rover leaves, on the clock of the tracks. (default 0)", "S", "--departure")
    ] = None
    seed: Annotated[int | None, WHOLE, option("The same seed gives the same path. (default 0)", "N")] = None
    mode: Annotated[Mode | None, option("How maps of sight are made. (default exact)")] = None
    unknown: Annotated[Unknown | None, option("What a line over unknown ground is.")] = None
    curvature: Annotated[Curvature | None, option("auto: as the DEM's CRS implies; flat: none.")] = None


def plan(
    dem: DemPath,
    /,
    *,
    way: WayOptions = WayOptions(),
    rover: RoverOptions = RoverOptions(),
    limits: LimitOptions = LimitOptions(),
    weight: Annotated[
        tuple[str, ...], option("Of length, climb, time, dop, out-of-sight, position-error. Repeatable.", "NAME=NUMBER")
    ] = (),
    anchors: PlacesAndAnchors = PlacesAndAnchors(),
    track: Annotated[tuple[Path, ...], option("Anchors that move, as .json or .csv. Repeatable.", "FILE")] = (),
    map: Annotated[
        Path | None, option("visibility.json, dop.json or morph.json: its anchors and limits.", "FILE")
    ] = None,
    terrain_frame: TerrainFrame = False,
    satellites: SatelliteOptions = SatelliteOptions(),
    range_sigma: RangeSigma = None,
    budget: BudgetOptions = BudgetOptions(),
    heard: HeardOptions = HeardOptions(),
    rest: RestOptions = RestOptions(),
    doubts: DoubtOptions = TRUSTING,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Plan a path on which the anchors stay in sight, or tell what blocks every path and the least that would open one.

    Writes path.json, path.geojson, map.png and, of a path, path.csv, path.gpx,
    path.plan, path.kml and profile.png into --out.
    """
    from service.products.paths import PATH
    from service.products.paths.request import PathQuestion

    from .asking.anchor_files import tracks_from_file
    from .asking.products import ask, completed, given_map, request_from_file, request_of_fields

    on = None if map is None else given_map(map)
    if request is not None:
        asked = request_from_file(request, PATH, on)
    else:
        if map is not None and range_sigma is not None:
            raise RequestError(
                "A map brings its anchors along, with the error of their ranges; give --map or --range-sigma."
            )
        sigma = {} if range_sigma is None else {"ranging_sigma_m": range_sigma}
        moving = [one for file in track for one in tracks_from_file(file)]
        tracks = [{**one.model_dump(exclude_none=True), **sigma} for one in moving]
        fields = {
            **way.part(lonlat=anchors.lonlat),
            **heard.part(anchors.part(range_sigma)),
            "satellites": satellites.part(range_sigma),
            **told(rest),
            **doubts.part(),
            "tracks": heard.heard(tracks),
            "rover": told(rover),
            "limits": told(limits),
            "budget": budget.part(),
            "weights": _weights(weight),
            "area": area.part(in_degrees=anchors.lonlat),
        }
        asked = completed(PATH, request_of_fields(fields, PathQuestion), on, map)
    ask(
        PATH,
        dem,
        asked,
        _tables,
        summary="path.json",
        what="Planning",
        changes={"plan_altitudes": "ground"} if terrain_frame else {},
        reading=reading,
        output=output,
        margin_m=margin_m,
        on=on,
    )


def _weights(texts: tuple[str, ...]) -> dict[str, float]:
    """NAME=VALUE options as weights. Raises RequestError."""
    from service.products.paths.request import WeightsIn

    names, found = tuple(WeightsIn.model_fields), {}
    for text in texts:
        option, _, value = text.partition("=")
        name = option.strip().replace("-", "_")
        try:
            found[name] = float(value)
        except ValueError as error:
            raise RequestError(f"--weight {text!r} is not of the form NAME=NUMBER.") from error
        if name not in names:
            raise RequestError(f"--weight {text!r} is not one of {', '.join(names)}, such as climb=2.")
    return found


def _tables(answer: PathSummary) -> tuple[Table, ...]:
    from service.parts.plan_answers import time_words

    facts = [("outcome", answer.status.replace("_", " ")), ("in words", answer.sentence)]
    totals, validation = answer.totals, answer.validation
    if totals is None or validation is None or answer.cost_split is None:
        return (facts_table(f"Path over {answer.dem.name}", facts), *_cuts(answer))
    facts += [
        ("length", f"{totals.length_m / 1000.0:.3f} km"),
        ("up, down", f"{totals.climb_m:.0f} m, {totals.descent_m:.0f} m"),
        ("steepest ground", f"{totals.steepest_deg:.1f}°"),
        ("time", time_words(totals.time_s)),
    ]
    if answer.ranged_to:
        no_fix, got = "no fix somewhere", "usable" if answer.parameters.get("sight") == "usable" else "in sight"
        facts += [
            (f"with fewer than {answer.needed_in_sight} {got}", time_words(totals.out_of_sight_s)),
            ("  longest at a stretch", time_words(totals.longest_out_of_sight_s)),
            (f"fewest {got}", str(totals.fewest_anchors)),
            (f"worst {_measure(answer)}", no_fix if totals.worst_dop is None else f"{totals.worst_dop:.2f}"),
            ("position error, mean", f"{totals.mean_position_sigma_m:.2f} m, one sigma, predicted"),
            ("  one sigma of a range", answer.sigmas),
        ]
    split = ", ".join(f"{name.replace('_', ' ')} {value:,.0f}" for name, value in answer.cost_split.items() if value)
    facts.append(("cost", f"{answer.cost:,.0f} ({split})"))
    if answer.ratio is not None:
        facts.append(("  of the reference", f"{answer.ratio:.4f}"))
    facts += [("planned by", answer.planner), ("validator", validation.sentence)]
    return (facts_table(f"Path over {answer.dem.name}", facts),)


def _measure(answer: PathSummary) -> str:
    limits = answer.parameters["limits"]
    assert isinstance(limits, dict), "as PathParameters has them"
    return str(limits["measure"]).upper()


def _cuts(answer: PathSummary) -> tuple[Table, ...]:
    cut = answer.unreachable
    if cut is None:
        return ()
    table = Table(title="What would let a path through, one by itself", title_justify="left")
    for column in ("limit", "asked", "needed", "in words", "path found"):
        table.add_column(column, justify="right" if column in ("asked", "needed") else "left")
    for one in cut.relaxations:
        numbers = ("–" if value is None else f"{value:.4g} {one.unit}".rstrip() for value in (one.asked, one.needed))
        table.add_row(one.reason, *numbers, escape(one.sentence), "yes" if one.shown else "not shown")
    return (table,) if cut.relaxations else ()
