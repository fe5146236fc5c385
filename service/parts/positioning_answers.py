"""DOP maps and morphing maps as the service tells about them."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from service.parts.map_answers import DEM_ID, DemId, MapOut, MapSummary, running_example
from service.parts.older_results import OrOlder
from service.parts.pages import Page
from service.parts.positioning import DopMapParameters, MorphingMapParameters

__all__ = [
    "DopMapIn",
    "DopMapList",
    "DopMapOut",
    "MorphingMapIn",
    "MorphingMapList",
    "MorphingMapOut",
]

ANCHORS: list[Any] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 120.0},
    {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "above_ground_m": 200.0},
    {"id": "D3", "east_m": 405100.0, "north_m": 3801700.0, "altitude_m": 1612.0},
]
COMMON: dict[str, Any] = {"dem_id": DEM_ID, "anchors": ANCHORS, "kind": "ranging", "measure": "pdop"}
DOP_REQUEST = {**COMMON, "dop_limit": 2.5, "receiver_above_ground_m": 1.5, "on_surface": True}
MORPHING_REQUEST = {**COMMON, "dop_limit": 5.0, "ceiling_altitude_m": 2500.0}


class DopMapIn(DopMapParameters):
    """A DEM, anchors or satellites, and how good positioning must be for a rover on the ground."""

    model_config = ConfigDict(json_schema_extra={"examples": [DOP_REQUEST]})

    dem_id: DemId


class MorphingMapIn(MorphingMapParameters):
    """A DEM, anchors or satellites, and how good positioning must be up to which ceiling."""

    model_config = ConfigDict(json_schema_extra={"examples": [MORPHING_REQUEST]})

    dem_id: DemId


class PlacedAnchor(BaseModel):
    """An anchor in the DEM's frame."""

    id: str = Field(description="Name of the anchor.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    above_ground_m: float | None = Field(description="Height above known ground, metres.")


class PlacedSatellite(BaseModel):
    """A satellite as the middle of the DEM sees it."""

    id: str = Field(description="Name of the satellite.")
    grid_azimuth_deg: float = Field(description="Clockwise from grid north, degrees.")
    elevation_deg: float = Field(description="Above the horizontal, degrees.")
    range_m: float = Field(description="Distance, metres.")


class PositioningSummary(MapSummary):
    """What maps of positioning have in common."""

    kind: str = Field(description="What is measured: ranging, pseudorange or tdoa.")
    measure: str = Field(description="Which dilution of precision.")
    dop_limit: float = Field(description="From this dilution on positioning is not good enough, no unit.")
    anchors: list[PlacedAnchor]
    satellites: list[PlacedSatellite]
    unhealthy_satellites: list[str] = Field([], description="Ids of satellites that were left out as unhealthy.")


class VolumeFacts(BaseModel):
    """How large a control volume is."""

    layers: int = Field(description="Number of layers.")
    rows: int = Field(description="Number of rows of posts.")
    cols: int = Field(description="Number of columns of posts.")
    voxels: int = Field(description="Number of voxels: layers times rows times columns.")
    lowest_layer_m: float = Field(description="Altitude of the lowest layer, or its height above ground, metres.")
    highest_layer_m: float = Field(description="The same of the highest layer, metres.")
    layers_above_ground: bool = Field(description="Whether layers count from the ground of each post.")


class DopMapSummary(PositioningSummary):
    """What a DOP map says in numbers, and how far to trust it."""

    receiver_above_ground_m: float = Field(description="Height of the antenna above ground, metres.")
    on_surface: bool = Field(description="Whether only motion along the surface is unknown.")
    share_within_limit: float | None = Field(description="Part of the known posts within the limit, 0..1.")
    share_no_go: float | None = Field(description="Part of the known posts beyond it or with too few anchors, 0..1.")
    share_unknown: float | None = Field(description="Part of the known posts where that is unknown, 0..1.")
    dop_quantiles: dict[str, float | None] = Field(
        description="p05, p50 and p95 of the dilution over the posts where it is known, no unit; null is no fix."
    )
    one_dop_per_set: bool = Field(False, description="Whether all posts of a visible set share one dilution.")
    position_error_quantiles_m: dict[str, dict[str, float | None]] = Field(
        {}, description="p05, p50 and p95 of the horizontal, vertical and position error, one sigma, metres."
    )
    path_points: int = Field(0, description="Number of points along the path.")
    volume: VolumeFacts | None = Field(None, description="The control volume, where one was asked for.")
    posts_by_reason: dict[str, int] = Field(
        description="Known posts with a fix (ok), too_few anchors, a singular geometry, or unknown sight."
    )


class StateShare(BaseModel):
    """How many columns of air are in a state."""

    state: str = Field(description="nowhere, everywhere, above, closed_at_ceiling, outside or unknown.")
    posts: int = Field(description="Posts with such air.")
    share: float | None = Field(description="The same as part of all posts, 0..1.")


class FrameFacts(BaseModel):
    """One frame of a morphing map over time."""

    time_s: float = Field(description="When, seconds on the clock of the frames.")
    time: str | None = Field(description="The same as an instant, where satellites give it.")
    anchors: int = Field(description="Number of anchors then.")
    satellites: int = Field(description="Number of satellites in view then.")
    surfaces_computed: int = Field(
        description="Number of anchors and satellites that had moved, so that their sight lines were calculated anew."
    )
    share_flyable: float | None = Field(description="Part of the known posts flyable up to the ceiling, 0..1.")


class TimeFacts(BaseModel):
    """What a morphing map says about time."""

    frames: list[FrameFacts]
    available_at: dict[str, float] = Field(
        description="Height of which availability is told: altitude_m or above_ground_m, metres."
    )
    share_always_available: float | None = Field(
        description="Part of the known posts in flyable air at that height in all frames, 0..1."
    )
    share_sometimes_available: float | None = Field(description="The same in some frames, 0..1.")
    share_never_available: float | None = Field(description="The same in none, 0..1.")


class MorphingMapSummary(PositioningSummary):
    """What a morphing map says in numbers, and how far to trust it."""

    ceiling: dict[str, float | None] = Field(description="Top of the air: altitude_m or above_ground_m, metres.")
    states: list[StateShare]
    receiver_above_ground_m: float = Field(1.5, description="Height of a ground rover's antenna, metres.")
    posts_no_go_for_the_rover: int = Field(0, description="Posts where that antenna is in no-flight air.")
    posts_with_several_intervals: int = Field(description="Posts with no-flight air in more than one piece.")
    above_ground_m: dict[str, float | None] = Field(
        description="p05, p50 and p95 of the height above ground from which one may fly, metres; null where nobody may."
    )
    over_time: TimeFacts | None = Field(None, description="Frames and availability, where frames were asked for.")


class DopMapOut(MapOut):
    """A DOP map: how its calculation stands, and its result when it has one."""

    model_config = ConfigDict(json_schema_extra={"examples": [running_example("/dop-maps", DOP_REQUEST)]})

    result: OrOlder[DopMapSummary] = Field(description="What the map says; null until it succeeded.")


class MorphingMapOut(MapOut):
    """A morphing map: how its calculation stands, and its result when it has one."""

    model_config = ConfigDict(json_schema_extra={"examples": [running_example("/morphing-maps", MORPHING_REQUEST)]})

    result: OrOlder[MorphingMapSummary] = Field(description="What the map says; null until it succeeded.")


class DopMapList(Page):
    """One page of DOP maps, newest first."""

    dop_maps: list[DopMapOut]


class MorphingMapList(Page):
    """One page of morphing maps, newest first."""

    morphing_maps: list[MorphingMapOut]
