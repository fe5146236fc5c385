"""Groups of options of ``sightline plan``, as parts of its request."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from service.errors import RequestError

from .options import GROUP, Curvature, Kind, Measure, Mode, Unknown, option, told

__all__ = ["BudgetOptions", "LimitOptions", "RestOptions", "RoverOptions", "WayOptions"]

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
        from .path_files import polygon_fields
        from .texts import place_fields

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

    min_anchors: Annotated[int | None, option("At least so many in sight everywhere.", "K")] = None
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

    iterations: Annotated[int | None, option("Of the sampling planner, which betters the grid's way.", "N")] = None
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
    leave_by_s: Annotated[
        float | None, option("It may leave until then, too; of five times the cheapest is taken.", "S", "--leave-by")
    ] = None
    arrive_by_s: Annotated[float | None, option("With --leave-by: it has to be there.", "S", "--arrive-by")] = None
    alternatives: Annotated[
        int | None, option("So many other ways besides that differ, with what each is worth; 1 to 8.", "K")
    ] = None
    seed: Annotated[int | None, option("The same seed gives the same path. (default 0)", "N")] = None
    mode: Annotated[Mode | None, option("How maps of sight are made. (default exact)")] = None
    unknown: Annotated[Unknown | None, option("What a line over unknown ground is.")] = None
    curvature: Annotated[Curvature | None, option("auto: as the DEM's CRS implies; flat: none.")] = None
