"""Groups of options of the commands that place and move anchors, as parts of their requests."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from service.errors import RequestError

from .options import GROUP, Kind, Measure, RadioName, ReceiverHeight, option, told

__all__ = [
    "CandidateOptions",
    "HoldingGoal",
    "LinkOptions",
    "MoveRules",
    "PlacementGoal",
    "PlacementRules",
    "TargetOptions",
]


@GROUP
@dataclass(frozen=True, slots=True)
class GoalOptions:
    """The ``goal`` of a request that places or moves anchors, besides its objective."""

    min_anchors: Annotated[
        int | None,
        option("So many anchors must be in sight. (default what a fix needs; for coverage 4)", "K"),
    ] = None
    dop_limit: Annotated[float, option("A dilution below this is good enough.", "NUMBER")] = 5.0
    measure: Annotated[Measure, option("Which dilution of precision.")] = "pdop"
    kind: Annotated[Kind, option("Ranges; ranges with an unknown clock; differences of arrival.")] = "ranging"
    on_surface: Annotated[
        bool, option("The rover is on the ground: only its motion along it is unknown.", name="--surface")
    ] = False


@GROUP
@dataclass(frozen=True, slots=True)
class RuleOptions:
    """The ``rules`` of a request: where anchors may be."""

    no_fly: Annotated[tuple[Path, ...], option("GeoJSON polygons without anchors. Repeatable.", "FILE")] = ()
    max_above_ground_m: Annotated[float | None, option("Ceiling above ground.", "M", "--max-agl")] = None
    max_altitude_m: Annotated[float | None, option("Ceiling as an altitude.", "M", "--max-altitude")] = None
    max_range_m: Annotated[float | None, option("Longest range that is measured.", "M", "--max-range")] = None
    min_separation_m: Annotated[float | None, option("Least distance between anchors.", "M", "--separation")] = None

    def part(self) -> dict[str, object]:
        """As the request has them. Raises RequestError."""
        from .path_files import polygon_fields

        return {**told(self), "no_fly": [polygon for file in self.no_fly for polygon in polygon_fields(file)]}


@GROUP
@dataclass(frozen=True, slots=True)
class CandidateOptions:
    """The ``candidates`` of a request: a lattice, masts and sites."""

    spacing_m: Annotated[float | None, option("Candidates on a lattice of this spacing, metres.", "M", "--spacing")] = (
        None
    )
    height: Annotated[
        tuple[str, ...], option("Of lattice and best sites: 120agl or 900msl. Repeatable.", "HEIGHT")
    ] = ()
    best_sites: Annotated[
        int | None, option("So many posts that see most of the targets, for each --height above ground.", "N")
    ] = None
    where: Annotated[
        Path | None, option("GeoJSON polygon of the lattice or the best sites; default the area, or the DEM.", "FILE")
    ] = None
    mast: Annotated[
        tuple[str, ...], option("Places of masts in a GeoJSON file, and their height. Repeatable.", "FILE,HEIGHT")
    ] = ()
    site: Annotated[
        tuple[str, ...], option("Road or landing sites, and a drone's height there. Repeatable.", "FILE,HEIGHT")
    ] = ()

    def part(self) -> list[dict[str, object]]:
        """As the request has them. Raises RequestError."""
        from .path_files import place_fields, polygon_fields

        found: list[dict[str, object]] = []
        spread = {"spacing_m": self.spacing_m, "best_sites": self.best_sites}
        wanted = {name: number for name, number in spread.items() if number is not None}
        for name, number in wanted.items():
            if not self.height:
                typed, such = ("--spacing", "120agl or 900msl") if name == "spacing_m" else ("--best-sites", "120agl")
                raise RequestError(f"{typed} needs at least one --height, such as {such}.")
            areas = [None] if self.where is None else polygon_fields(self.where)
            found += [{name: number, **_heights(self.height), "area": area} for area in areas]
        if not wanted and (self.height or self.where is not None):
            raise RequestError("--height and --where need --spacing or --best-sites.")
        for what, texts in (("mast", self.mast), ("site", self.site)):
            for text in texts:
                name, comma, height = text.rpartition(",")
                if not comma:
                    raise RequestError(f"--{what} {text!r} is not of the form FILE,HEIGHT such as roads.geojson,10agl.")
                found.append({"what": what, "places": place_fields(Path(name)), **_heights((height,))})
        if not found:
            raise RequestError(
                "No candidates: give --spacing or --best-sites with --height, --mast, --site or --request."
            )
        return found


@GROUP
@dataclass(frozen=True, slots=True)
class PlacementGoal(GoalOptions):
    """The ``goal`` of a request."""

    objective: Annotated[
        Literal["coverage", "dop", "mean-error", "worst-error"] | None,
        option(
            "What is good. Coverage counts anchors in sight, even where they stand in a row. (default mean-error with "
            "--surface; with --reach coverage)"
        ),
    ] = None
    spare: Annotated[int, option("So many anchors may be lost, 0 or 1.", "N")] = 0
    ranging_sigma_m: Annotated[
        float | None,
        option(
            "One-sigma error of every range, for errors. (default 0.1; of those there already what they say)",
            "M",
            "--range-sigma",
        ),
    ] = None

    def part(self) -> dict[str, object]:
        """As the request has it."""
        said = told(self)
        if not self.on_surface:  # not asked for, which is not asked against
            del said["on_surface"]
        return said if self.objective is None else {**said, "objective": self.objective.replace("-", "_")}


@GROUP
@dataclass(frozen=True, slots=True)
class TargetOptions:
    """The ``targets`` of a request: where the rover has to see anchors."""

    area: Annotated[
        Path | None, option("GeoJSON polygon to serve; default the area, or the DEM.", "FILE", "--serve")
    ] = None
    path: Annotated[Path | None, option("GeoJSON LineString, or path.csv of a plan, to serve instead.", "FILE")] = None
    corridor_width_m: Annotated[
        float | None, option("Serve the ground within half this width of --path.", "M", "--corridor")
    ] = None
    weights: Annotated[Path | None, option("GeoJSON polygons whose property weight is what ground counts.", "FILE")] = (
        None
    )
    receiver_above_ground_m: ReceiverHeight = None

    def part(self) -> dict[str, object]:
        """As the request has them. Raises RequestError."""
        from .path_files import path_fields, polygon_fields, weight_fields

        found = told(self)
        if self.area is not None:
            polygons = polygon_fields(self.area)
            if len(polygons) > 1:
                raise RequestError(f"The file {self.area.name} holds {len(polygons)} polygons; --serve takes one.")
            found["area"] = polygons[0]
        if self.weights is not None:
            found["weights"] = weight_fields(self.weights)
        if self.path is not None:
            found["path"] = path_fields(self.path)
        return found


@GROUP
@dataclass(frozen=True, slots=True)
class PlacementRules(RuleOptions):
    """The ``rules`` of a request, besides its link."""

    stand_off: Annotated[tuple[str, ...], option("GeoJSON shapes to keep so far from. Repeatable.", "FILE,M")] = ()
    min_above_ground_m: Annotated[float | None, option("Lowest height above ground.", "M", "--min-agl")] = None

    def part(self) -> dict[str, object]:
        """As the request has them. Raises RequestError."""
        from .path_files import stand_off_fields

        shapes = [shape for text in self.stand_off for shape in stand_off_fields(text)]
        return {**RuleOptions.part(self), "stand_off": shapes}


@GROUP
@dataclass(frozen=True, slots=True)
class LinkOptions:
    """The ``link`` among the rules of a request."""

    base: Annotated[tuple[str, ...], option("Base that every anchor must see. Repeatable.", "EAST,NORTH,HEIGHT")] = ()
    max_range_m: Annotated[float | None, option("Longest link to a base or relay.", "M", "--link-range")] = None
    relays: Annotated[int, option("So many other anchors may relay the link.", "N")] = 0
    radio: Annotated[
        RadioName | None, option("The link's radio: its signal decides, in place of sight.", "NAME", "--link-radio")
    ] = None

    def part(self, *, lonlat: bool) -> dict[str, object] | None:
        """As the request has it; None without a base. Raises RequestError."""
        from .texts import position_fields

        if not self.base:
            if self.max_range_m is not None or self.relays or self.radio is not None:
                raise RequestError("--link-range, --link-radio and --relays need --base EAST,NORTH,HEIGHT.")
            return None
        form = "--base {!r} is not of the form EAST,NORTH,HEIGHT with HEIGHT like 10agl or 612msl."
        bases = [position_fields(text, lonlat=lonlat, complaint=form.format(text)) for text in self.base]
        return {"bases": bases, **{name: value for name, value in told(self).items() if name != "base"}}


@GROUP
@dataclass(frozen=True, slots=True)
class HoldingGoal(GoalOptions):
    """The ``goal`` of a request: what shall hold."""

    objective: Annotated[Literal["coverage", "dop"], option("What shall hold.")] = "coverage"


@GROUP
@dataclass(frozen=True, slots=True)
class MoveRules(RuleOptions):
    """The ``rules`` of a request."""

    no_fly: Annotated[tuple[Path, ...], option("GeoJSON polygons not to fly over. Repeatable.", "FILE")] = ()


def _heights(texts: tuple[str, ...]) -> dict[str, object]:
    from .texts import height_field

    form = "The height {!r} is not of the form 120agl (above ground) or 900msl (altitude)."
    heights = [height_field(text, form.format(text)) for text in texts]
    datums = {height["altitude_datum"] for height in heights if "altitude_datum" in height}
    if len(datums) > 1:
        raise RequestError("The heights of one set of places count from one datum: all as msl, or all as hae.")
    found: dict[str, object] = {
        name: [height[name] for height in heights if name in height] for name in ("above_ground_m", "altitude_m")
    }
    return found | ({"altitude_datum": datums.pop()} if datums else {})
