"""The mission as a document, field by field what the planner's page has in service/page/src/mission/mission.ts.

A mission holds all that a planner decides, and nothing that is calculated from it. Places are metres in the CRS of its
ground.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, AwareDatetime, ConfigDict, Field, JsonValue, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from service.parts.anchors import UNSEEN, AnchorId, Azimuth
from service.parts.points import Metres, NotNegative, NotNegativeMetres, Positive, StrictModel
from service.parts.radios import RadioName, Sight

__all__ = [
    "FORMAT",
    "GroundRef",
    "MissionAnchor",
    "MissionBuildings",
    "MissionFlight",
    "MissionIn",
    "MissionOrbits",
    "MissionPlace",
    "MissionPlacing",
    "MissionPositioning",
    "MissionRoute",
    "MissionRover",
    "MissionRules",
    "MissionStandOff",
    "MissionTimes",
    "MissionTrees",
    "PlainName",
]

FORMAT = "sightline-mission"
MOST_ANCHORS = 1000
MOST_PLACES = 10_000
MOST_RINGS = 1000
Slope = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0, le=90.0)]
Count = Annotated[int, Field(strict=True, ge=0, le=1000)]


def _plain(name: str) -> str:
    if re.search(f"[{UNSEEN}]", name):
        raise PydanticCustomError("name", "a name has no control characters and no line breaks")
    return name


# what people call things: it ends up in lists, pages and names of files
PlainName = Annotated[str, Field(json_schema_extra={"pattern": f"^[^{UNSEEN}]*$"}), AfterValidator(_plain)]


class MissionPlace(StrictModel):
    """A place on the mission's ground."""

    east_m: Metres = Field(description="East in the CRS of the ground, metres.")
    north_m: Metres = Field(description="North in the CRS of the ground, metres.")


Ring = Annotated[list[MissionPlace], Field(min_length=3, max_length=MOST_PLACES)]
Rings = Annotated[list[Ring], Field(max_length=MOST_RINGS)]


class GroundRef(StrictModel):
    """Which DEM the mission stands on: by its digest anywhere, by its id on one service."""

    dem_id: str = Field(max_length=80, description="Id of the DEM on the service that the mission was saved on.")
    name: PlainName = Field(max_length=255, description="Name of its file, for people.")
    sha256: str = Field(max_length=80, description="Digest of its heights, geometry and CRS, as DEMs tell it.")


class MissionAnchor(MissionPlace):
    """An anchor of the mission."""

    id: AnchorId = Field(description="Name of the anchor, unique in the mission, 1 to 64 characters.")
    kind: Literal["drone", "mast", "beacon"] = Field(description="What carries it.")
    height_m: Metres = Field(description="Its height above what height_from says, metres.")
    height_from: Literal["above_ground_m", "altitude_m"] = Field(
        description="Whether height_m counts from the ground below, or from the vertical datum of the DEM."
    )
    max_range_m: Positive | None = Field(None, description="Longest slant range it measures, metres; null = unlimited.")
    azimuth_from_deg: Azimuth | None = Field(
        None, description="Start of its sector, degrees clockwise from grid north; goes with azimuth_to_deg."
    )
    azimuth_to_deg: Azimuth | None = Field(
        None, description="End of its sector, degrees clockwise from grid north; goes with azimuth_from_deg."
    )
    ranging_sigma_m: NotNegativeMetres = Field(0.1, description="One-sigma error of its ranges, metres.")
    radio: RadioName | None = Field(None, description="Budget of its radio by name; null = only sight is known of it.")
    flies_to: list[MissionPlace] = Field(
        [], max_length=MOST_PLACES, description="Where it flies from its place, in order; none = it stands."
    )
    flies_m_per_s: Positive = Field(5.0, description="How fast it flies there, metres per second.")


class MissionRover(StrictModel):
    """What drives."""

    receiver_above_ground_m: NotNegativeMetres = Field(1.5, description="Height of its antenna, metres.")
    max_slope_deg: Slope = Field(25.0, description="Steepest ground it stands on, degrees.")
    footprint_radius_m: NotNegativeMetres = Field(0.8, description="Radius of what it covers, metres.")
    speed_m_per_s: Positive = Field(0.5, description="How fast it drives, metres per second.")


class MissionPositioning(StrictModel):
    """How it knows where it is."""

    kind: Literal["ranging", "pseudorange", "tdoa"] = Field("ranging", description="What is measured.")
    measure: Literal["gdop", "pdop", "hdop", "vdop"] = Field("hdop", description="Which dilution of precision.")
    dop_limit: Positive = Field(5.0, description="Good is a dilution below this, no unit.")
    on_surface: bool = Field(False, description="Whether the rover moves along the ground only.")
    sight: Sight = "visible"


class MissionRoute(StrictModel):
    """Where it goes, and what has to hold on the way."""

    start: MissionPlace | None = Field(None, description="Where it starts.")
    goal: MissionPlace | None = Field(None, description="Where it shall go.")
    way_points: list[MissionPlace] = Field([], max_length=MOST_PLACES, description="Where it passes, in order.")
    no_go: Rings = Field([], description="Areas that it keeps out of.")
    keep_in: Rings = Field([], description="Areas that it keeps within.")
    min_anchors: Count = Field(0, description="Number of anchors in sight all along; 0 = no limit.")
    keep_dop: bool = Field(False, description="Whether the dilution stays below its limit all along.")
    bubble_epsilon: NotNegative = Field(0.0, description="Sigmas of the safety bubble kept clear, no unit.")
    alternatives: Annotated[int, Field(strict=True, ge=0, le=8)] = Field(0, description="Number of other ways sought.")
    departure_s: NotNegative = Field(0.0, description="When the rover leaves, seconds on the clock of what flies.")
    leave_by_s: NotNegative | None = Field(None, description="It may leave until this, seconds; null = only then.")
    arrive_by_s: NotNegative | None = Field(
        None, description="With leave_by_s: it has to be there by this, seconds; null = whenever."
    )


class MissionPlacing(StrictModel):
    """What is asked for where more anchors are sought."""

    count: Annotated[int, Field(strict=True, ge=1, le=1000)] = Field(2, description="Number of anchors to find.")
    above_ground_m: NotNegativeMetres = Field(100.0, description="Height of theirs above the ground, metres.")
    objective: Literal["coverage", "dop", "mean_error"] = Field(
        "mean_error",
        description="What they are for; mean_error = the position error of a rover that moves along the surface.",
    )
    min_anchors: Count | None = Field(
        None, description="Number of anchors that are enough; null = as many as placements take for the objective."
    )
    spacing_m: Positive | None = Field(None, description="Distance of places that are tried, metres; null = chosen.")
    best_sites: Annotated[int, Field(strict=True, ge=1, le=20_000)] | None = Field(
        None, description="Number of places that are tried because they see most; null = a lattice of places."
    )
    where: Literal["area", "path"] = Field("area", description="Whether over the area or along the path.")


class MissionStandOff(StrictModel):
    """What anchors keep away from."""

    places: Annotated[list[MissionPlace], Field(min_length=1, max_length=MOST_PLACES)] = Field(
        description="One place is a point, several are a line."
    )
    distance_m: NotNegativeMetres = Field(description="Distance to keep, metres.")


class MissionRules(StrictModel):
    """Where anchors that are sought may be."""

    no_fly: Rings = Field([], description="Areas that no anchor is over.")
    stand_off: Annotated[list[MissionStandOff], Field(max_length=MOST_RINGS)] = Field(
        [], description="Distances that they keep."
    )
    max_above_ground_m: Positive | None = Field(None, description="Ceiling above ground, metres; null = none.")
    max_altitude_m: Metres | None = Field(
        None, description="Ceiling in the vertical datum of the DEM, metres; null = none."
    )
    max_range_m: Positive | None = Field(None, description="Longest range that they measure, metres; null = unlimited.")
    min_separation_m: NotNegativeMetres = Field(0.0, description="Least distance between two anchors, metres.")


class MissionFlight(StrictModel):
    """From where to where a drone flies through the air."""

    start: MissionPlace | None = Field(None, description="Where it begins.")
    goal: MissionPlace | None = Field(None, description="Where it ends.")
    above_ground_m: NotNegativeMetres = Field(120.0, description="Height above the ground at both ends, metres.")
    bubble_m: NotNegativeMetres = Field(20.0, description="Distance kept from ground and buildings, metres.")
    speed_m_per_s: Positive = Field(12.0, description="How fast it flies, metres per second.")


class MissionOrbits(StrictModel):
    """A file of satellites' orbits, whole, so that the mission tells all that it was calculated from."""

    name: PlainName = Field(max_length=255, description="Name of the file, for people.")
    what: Literal["almanac", "navigation"] = Field(description="SEM or YUMA almanac, or RINEX navigation file.")
    text: str = Field(min_length=1, description="What the file says.")


class MissionBuildings(StrictModel):
    """Buildings that stand on the ground, as every request takes them as the footprints of its cover."""

    name: PlainName = Field(max_length=255, description="Name of their file, for people.")
    geojson: Annotated[dict[str, JsonValue], WithJsonSchema({"type": "object"})] = Field(
        description="A FeatureCollection of footprints with heights."
    )
    level_m: Positive | None = Field(None, description="Height of each of building:levels, metres; null = none told.")
    default_height_m: Positive | None = Field(None, description="Height where none is told, metres; null = refused.")


class MissionTrees(StrictModel):
    """Trees over the ground, as requests take them as the canopy of their cover."""

    what: Literal["top", "heights", "surface"] = Field(
        description="One height everywhere, a raster of crown heights above the ground, or a surface model."
    )
    top_m: NotNegativeMetres | None = Field(None, description="The one height, metres; null = a raster tells.")
    name: Annotated[PlainName, Field(max_length=200)] | None = Field(
        None, description="Name of the raster's file; null = one height."
    )
    base64: str | None = Field(None, min_length=1, description="Its bytes in base64; null = one height.")
    base_m: NotNegativeMetres = Field(0.0, description="Height above the ground at which crowns begin, metres.")
    depth_per_m: NotNegative | None = Field(
        None, description="Optical depth per metre of way, 1/m; null = Weissberger's model."
    )

    @model_validator(mode="after")
    def _one_height_or_a_file(self) -> Self:
        given = (self.top_m is not None, self.name is not None, self.base64 is not None)
        if given != ((True, False, False) if self.what == "top" else (False, True, True)):
            raise ValueError("Trees of one height need top_m alone, those of a raster its name and base64 alone.")
        return self


class MissionTimes(StrictModel):
    """The times that are looked at."""

    begins_at: AwareDatetime | None = Field(None, description="Second 0 as an instant; needed with satellites.")
    lasts_s: NotNegative = Field(3600.0, description="How long is looked at, seconds.")
    step_s: Positive = Field(600.0, description="From frame to frame, seconds.")
    orbits: MissionOrbits | None = Field(None, description="Satellites that are ranged to; null = none.")


class MissionIn(StrictModel):
    """A whole mission."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "format": FORMAT,
                    "version": 1,
                    "name": "Valley crossing",
                    "ground": {"dem_id": "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11", "name": "valley.npz", "sha256": "0f3c2d"},
                    "anchors": [
                        {
                            "id": "D1",
                            "east_m": 646000.0,
                            "north_m": 5136500.0,
                            "kind": "drone",
                            "height_m": 120.0,
                            "height_from": "above_ground_m",
                        }
                    ],
                }
            ]
        }
    )

    format: Literal["sightline-mission"] = Field("sightline-mission", description="What the document is.")
    version: Literal[1] = Field(1, description="Number of the format that it is written in.")
    name: PlainName = Field("Mission", max_length=120, description="Name of the mission, for people.")
    ground: GroundRef | None = Field(None, description="What it stands on; null before one was chosen.")
    buildings: MissionBuildings | None = Field(None, description="What stands on the ground; null = bare ground.")
    trees: MissionTrees | None = Field(None, description="Trees over the ground; null = none.")
    area: Ring | None = Field(None, description="Where it takes place; null = the whole DEM.")
    anchors: list[MissionAnchor] = Field([], max_length=MOST_ANCHORS, description="Its anchors, with unique ids.")
    rover: MissionRover = Field(default_factory=lambda: MissionRover.model_validate({}))
    positioning: MissionPositioning = Field(default_factory=lambda: MissionPositioning.model_validate({}))
    route: MissionRoute = Field(default_factory=lambda: MissionRoute.model_validate({}))
    placing: MissionPlacing = Field(default_factory=lambda: MissionPlacing.model_validate({}))
    rules: MissionRules = Field(default_factory=lambda: MissionRules.model_validate({}))
    ceiling_above_ground_m: NotNegativeMetres = Field(300.0, description="Top of the air looked at, metres.")
    times: MissionTimes = Field(default_factory=lambda: MissionTimes.model_validate({}))
    flight: MissionFlight = Field(default_factory=lambda: MissionFlight.model_validate({}))

    @model_validator(mode="after")
    def _places_need_ground_and_ids_are_unique(self) -> Self:
        twice = sorted(id for id, times in Counter(anchor.id for anchor in self.anchors).items() if times > 1)
        if twice:
            raise ValueError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
        route, rules = self.route, self.rules
        placed = self.anchors or self.area or self.buildings or route.start or route.goal or route.way_points
        flown = self.flight.start or self.flight.goal
        shaped = route.no_go or route.keep_in or rules.no_fly or rules.stand_off
        if self.ground is None and (placed or flown or shaped):
            raise ValueError("A mission with places needs its ground, for they are metres in the CRS of it.")
        return self
