"""What a path is asked for: from where to where, with which rover, under which limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from planning.paths import NavigationModel, PlanBudget
from service.parts.anchors import TrackIn
from service.parts.areas import Areas, GoalIn, StandingPlace
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import NotNegative, NotNegativeMetres, PlanAltitudes, Positive, StrictModel
from service.parts.positioning import AREA_BESIDE, EXAMPLE_ANCHORS, MorphingMapParameters, RangingParameters
from service.parts.sentences import WithOlderNames

__all__ = [
    "REQUEST",
    "BudgetIn",
    "NavigationIn",
    "PathIn",
    "PathLimitsIn",
    "PathParameters",
    "PathQuestion",
    "RoverIn",
    "SpeedIn",
    "WeightsIn",
]

SteepestDeg = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, le=90.0)]
SlopeDeg = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=-90.0, lt=90.0)]
Seconds = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-1e10, le=1e10)]
NAVIGATION = NavigationModel()
REQUEST: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "start": {"east_m": 403000.0, "north_m": 3796000.0},
    "goals": [{"type": "Point", "coordinates": [-117.95, 34.33]}],
    "anchors": EXAMPLE_ANCHORS,
    "rover": {"max_slope_deg": 25.0, "footprint_radius_m": 0.8, "speed_m_per_s": 0.5},
    "limits": {"min_anchors": 2},
    "weights": {"climb": 2.0, "out_of_sight": 3.0},
}
HeadingDeg = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-360.0, le=360.0)]


class SpeedIn(StrictModel):
    """How fast it drives on ground that rises by so much along the way."""

    slope_deg: SlopeDeg = Field(description="Slope along the way, degrees, uphill positive.")
    speed_m_per_s: Positive = Field(description="Speed there, metres per second.")


class RoverIn(WithOlderNames):
    """What the rover can do."""

    older_names: ClassVar[Mapping[str, str]] = {"antenna_height_m": "receiver_above_ground_m"}

    footprint_radius_m: NotNegativeMetres = Field(0.5, description="Radius of the disc that it covers, metres.")
    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5, description="Height of its antenna above the ground, metres."
    )
    max_slope_deg: SteepestDeg = Field(25.0, description="Steepest ground that it stands on, degrees.")
    max_pitch_deg: SteepestDeg = Field(90.0, description="Steepest ground along its way, degrees; 90 = no limit.")
    max_roll_deg: SteepestDeg = Field(90.0, description="Steepest ground across its way, degrees; 90 = no limit.")
    max_step_m: Positive | None = Field(
        None, description="How far ground under it may depart from the plane it stands on, metres; none = no limit."
    )
    min_turning_radius_m: NotNegativeMetres = Field(
        0.0, description="Tightest arc that it drives, metres; 0 = it turns on the spot."
    )
    can_reverse: bool = Field(
        False, strict=True, description="Whether a rover that cannot turn on the spot also drives backwards."
    )
    speed_m_per_s: Positive = Field(1.0, description="Speed on level ground, metres per second.")
    speed_over_slope: Annotated[list[SpeedIn], Field(max_length=64)] = Field(
        [], description="Speeds over ascending slopes, linear between; left out = the same speed everywhere."
    )


class PathLimitsIn(WithOlderNames):
    """What positioning has to be like at every point of the path."""

    older_names: ClassVar[Mapping[str, str]] = {"max_dop": "dop_limit"}

    min_anchors: Annotated[int, Field(strict=True, ge=0, le=1024)] = Field(
        0, description="At least so many anchors in sight; 0 = no limit."
    )
    dop_limit: Positive | None = Field(
        None, description="The dilution of precision stays below it, no unit; none = no limit."
    )
    kind: Literal["ranging", "pseudorange", "tdoa"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock; differences of arrival."
    )
    measure: Literal["gdop", "pdop", "hdop", "vdop", "tdop"] = Field("pdop", description="Which dilution of precision.")
    on_surface: bool = Field(
        False, strict=True, description="Only motion along the ground is unknown, for the rover is on it."
    )
    in_sight_from: Annotated[int, Field(strict=True, ge=1, le=1024)] | None = Field(
        None, description="So many anchors make a place count as in sight; none = as many as a fix needs."
    )
    bubble_epsilon: NotNegative = Field(
        0.0,
        description="How many sigmas the safety bubble is wide, no unit; what may not be driven stays further away. "
        "0 = no bubble.",
    )
    dem_sigma_m: NotNegativeMetres = Field(0.0, description="Uncertainty of the ground, added to its radius, metres.")


class NavigationIn(StrictModel):
    """How the rover will estimate where it is: a filter of ranges, its height known from the DEM."""

    interval_s: Positive = Field(NAVIGATION.interval_s, description="Between ranges to each anchor in sight, seconds.")
    initial_sigma_m: Positive = Field(
        NAVIGATION.initial_sigma_m, description="One sigma of each coordinate at the start, metres."
    )
    ground_sigma_m: Positive = Field(
        NAVIGATION.ground_sigma_m, description="One sigma of the DEM's height under the rover, metres."
    )
    initial_velocity_sigma_m_per_s: Positive = Field(
        NAVIGATION.initial_velocity_sigma_m_per_s,
        description="One sigma of each coordinate of its velocity at the start, metres per second.",
    )
    motion_m2_per_s3: Positive = Field(
        NAVIGATION.motion.east_m2_per_s3,
        description="White acceleration noise of its motion on each axis, metres² per second³.",
    )


class WeightsIn(StrictModel):
    """What a path costs, in units of a metre on level ground."""

    length: NotNegative = Field(1.0, description="Of a metre along the ground, no unit.")
    climb: NotNegative = Field(2.0, description="Of a metre climbed, no unit.")
    time: NotNegative = Field(0.0, description="Of a second on the way, metres per second.")
    dop: NotNegative = Field(0.0, description="Of a metre for each unit of dilution, no unit.")
    out_of_sight: NotNegative = Field(
        2.0, description="Of a second with fewer anchors in sight than a fix needs, metres per second."
    )
    position_error: NotNegative = Field(
        0.0, description="Of a metre for each metre of predicted one-sigma position error, no unit."
    )


class BudgetIn(StrictModel):
    """How much planning is paid for."""

    iterations: Annotated[int, Field(strict=True, ge=1, le=10_000_000)] = Field(
        PlanBudget().iterations, description="Of the sampling planner, a number: with one seed it makes one path."
    )
    seconds: Positive = Field(60.0, description="Time-out of the whole plan, seconds.")
    sampling: bool = Field(
        True, strict=True, description="Whether the sampling planner betters the grid's way; it takes seconds longer."
    )


class PathQuestion(RangingParameters):
    """From where to where, with which rover, under which limits; ``anchors`` are what the rover ranges to."""

    mode: Literal["fast", "exact"] = Field(
        "exact", description="How maps of sight are made; every path is checked with exact sight lines in the end."
    )
    start: StandingPlace = Field(description="Where the rover is.")
    goals: Annotated[list[GoalIn], Field(min_length=1, max_length=256)] = Field(
        description="Places or areas, any of which will do."
    )
    way_points: Annotated[list[StandingPlace], Field(max_length=256)] = Field(
        [], description="Places to pass, in order."
    )
    start_heading_deg: HeadingDeg | None = Field(
        None, description="Where a rover that cannot turn on the spot looks, degrees clockwise from grid north."
    )
    rover: RoverIn = Field(default_factory=lambda: RoverIn.model_validate({}))
    limits: PathLimitsIn = Field(default_factory=lambda: PathLimitsIn.model_validate({}))
    weights: WeightsIn = Field(default_factory=lambda: WeightsIn.model_validate({}))
    budget: BudgetIn = Field(default_factory=lambda: BudgetIn.model_validate({}))
    no_go: Areas = Field([], description="Areas to stay out of, with the whole footprint.")
    keep_in: Areas = Field([], description="Areas to stay within, with the whole footprint; none = the whole DEM.")
    tracks: Annotated[list[TrackIn], Field(max_length=64)] = Field(
        [], description="Anchors that move; a place has the map of the time at which the rover gets there."
    )
    departure_s: Seconds = Field(0.0, description="When the rover leaves, seconds on the clock of the tracks.")
    leave_by_s: Seconds | None = Field(
        None, description="With tracks: it may leave at any of five times until then, seconds; the cheapest is taken."
    )
    arrive_by_s: Seconds | None = Field(
        None, description="With leave_by_s: it has to be there by then, seconds on the clock of the tracks."
    )
    frame_s: Positive = Field(60.0, description="How closely in time moving anchors are looked at, seconds.")
    navigation: NavigationIn = Field(default_factory=lambda: NavigationIn.model_validate({}))
    morphing_map: MorphingMapParameters | None = Field(
        None, description="Stay where the antenna is above this morphing map, which then takes the place of anchors."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**32)] = Field(
        0, description="A number; the same seed and iterations give the same path."
    )
    plan_altitudes: PlanAltitudes = "sea level"
    alternatives: Annotated[int, Field(strict=True, ge=1, le=8)] | None = Field(
        None, description="A number of other ways besides that differ, with what each is worth; none = the path alone."
    )

    @model_validator(mode="after")
    def _windows_are_of_tracks(self) -> Self:
        if self.leave_by_s is None:
            if self.arrive_by_s is not None:
                raise ValueError("arrive_by_s goes with leave_by_s.")
            return self
        if not self.tracks:
            raise ValueError("leave_by_s goes with tracks: anchors that stand are the same at any time.")
        for name, until_s in (("leave_by_s", self.leave_by_s), ("arrive_by_s", self.arrive_by_s)):
            if until_s is not None and until_s <= self.departure_s:
                raise ValueError(f"{name} has to be after departure_s.")
        return self

    @model_validator(mode="after")
    def _alternatives_turn_on_the_spot(self) -> Self:
        if self.alternatives is not None and self.rover.min_turning_radius_m > 0.0:
            raise ValueError("alternatives are looked for only for a rover that turns on the spot.")
        return self

    def without_radio(self) -> list[str]:
        """Ids of anchors and tracks without a radio."""
        return [one.id for one in (*self.anchors, *self.tracks) if one.radio is None]


class PathParameters(PathQuestion):
    """The same, with everything that it ranges to in it."""

    @model_validator(mode="after")
    def _unique_among_tracks(self) -> Self:
        ids = [one.id for one in (*self.anchors, *self.tracks)]
        if len(set(ids)) < len(ids):
            raise ValueError("Anchors and tracks need ids that are unique among all of them.")
        return self

    @model_validator(mode="after")
    def _limits_need_anchors(self) -> Self:
        _check_limits_have_anchors(self)
        return self


class PathIn(PathQuestion):
    """A DEM, a rover, from where to where, and the anchors that it ranges to, or a finished map of them."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
    map_id: Annotated[str, Field(min_length=1, max_length=64)] | None = Field(
        None,
        description="A finished visibility, DOP or morphing map of the same DEM: its anchors, its sight settings, "
        "and the limits of a DOP map; the antenna stays above a morphing map. What the request says itself wins.",
    )

    @model_validator(mode="after")
    def _limits_need_anchors(self) -> Self:
        if self.map_id is None:
            _check_limits_have_anchors(self)
        return self


def _check_limits_have_anchors(asked: PathQuestion) -> None:
    """Raises ValueError for limits on anchors without any, and for anchors beside a morphing map."""
    ranged, limits = bool(asked.anchors or asked.tracks) or asked.satellites is not None, asked.limits
    if (limits.min_anchors > 0 or limits.dop_limit is not None or limits.bubble_epsilon > 0.0) and not ranged:
        raise ValueError("Limits on anchors in sight, dilution or bubble need anchors, satellites, or a map of them.")
    if asked.morphing_map is not None and asked.morphing_map.area is not None:
        raise ValueError(AREA_BESIDE)
    if asked.tracks and (asked.unknown, asked.curvature) != ("unknown", "auto"):
        raise ValueError("With anchors on tracks, unknown and curvature keep their defaults.")
    if asked.usable and asked.morphing_map is not None:
        raise ValueError("Above a morphing map the map says what is usable: its own sight, in morphing_map.")
    if ranged and asked.morphing_map is not None:
        raise ValueError("Give anchors and satellites, or a morphing map with its own, not both.")
