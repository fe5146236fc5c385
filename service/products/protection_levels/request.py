"""What protection levels are asked for: anchors, what may be missed, how the ground is used, and a path."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import ConfigDict, Field, JsonValue, model_validator

from navigation import MeasurementError
from navigation.monitor import ProtectionRisk
from service.parts.anchors import AnchorIn, CurvatureChoice
from service.parts.map_area import AreaParameters, map_area, refuse_outside
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import NotNegativeMetres, PointIn, Positive
from service.parts.positioning import EXAMPLE_ANCHORS
from service.parts.radios import SightChoice
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import points_in_grid, resolve_anchor
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import check_anchors

__all__ = ["REQUEST", "ProtectionLevelsIn", "ProtectionParameters", "anchors_of", "check_protection", "path_of"]

MOST_PATH_POINTS = 100_000
Probability = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, lt=1.0)]
REQUEST: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "anchors": EXAMPLE_ANCHORS,
    "height_sigma_m": 3.0,
    "spacing_m": 240.0,
}


class ProtectionParameters(AreaParameters, SightChoice):
    """Anchors, what may be missed, how the ground is used, and a path."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{name: value for name, value in REQUEST.items() if name != "dem_id"}]}
    )
    sight_alone = "protection levels weigh ranges by the probability of sight."

    anchors: Annotated[list[AnchorIn], Field(min_length=1, max_length=62)] = Field(
        description="What is ranged to, with unique ids; each with its ranging_sigma_m."
    )
    kind: Literal["ranging", "pseudorange"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock."
    )
    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5, description="Height of the antenna over the ground of each post, metres."
    )
    spacing_m: Positive | None = Field(
        None, description="Distance between the posts of the map, metres; left out = every post of the DEM."
    )
    path: Annotated[list[PointIn], Field(max_length=MOST_PATH_POINTS)] = Field(
        [], description="Points along a route before it is driven; what is promised there goes into path.csv."
    )
    height_sigma_m: Positive | None = Field(
        None,
        description="One sigma of the antenna's height as the DEM tells it, metres; left out = the DEM's height is "
        "not used.",
    )
    dem_sigma_m: Positive = Field(
        3.0, description="One-sigma error of the DEM's heights behind the probabilities of sight, metres."
    )
    missed: Probability = Field(
        1e-4, description="Probability that a position is off by more than a level and no alarm says so, 0..1."
    )
    false_alarm: Probability = Field(1e-3, description="Rate at which right ranges alarm, 0..1.")
    unwatched: Probability = Field(
        1e-6, description="Sets of wrong ranges that together are less likely get no hypothesis, 0..1."
    )
    most_faults: Annotated[int, Field(strict=True, ge=0, le=6)] = Field(
        3, description="The largest set of ranges that are wrong at once, a number."
    )
    fault: Probability = Field(1e-3, description="Probability that the range of an anchor in sight is wrong, 0..1.")
    least_sight: Probability = Field(
        0.5, description="A range of less probability of sight is left out before any test, 0..1."
    )
    horizontal_alert_m: Positive = Field(10.0, description="Alert limit of the horizontal level, metres.")
    vertical_alert_m: Positive = Field(10.0, description="Alert limit of the vertical level, metres.")
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    @model_validator(mode="after")
    def _whole_question(self) -> Self:
        ids = [anchor.id for anchor in self.anchors]
        if len(set(ids)) < len(ids):
            raise ValueError("Anchor ids must be unique.")
        if not self.unwatched < self.missed:
            raise ValueError("unwatched must be below missed.")
        return self

    def near_sources(self) -> tuple[AnchorIn, ...]:
        """Its anchors."""
        return tuple(self.anchors)

    def risk(self) -> ProtectionRisk:
        """The same for the monitor."""
        return ProtectionRisk(self.missed, self.false_alarm, self.unwatched, self.most_faults)

    @property
    def height_m(self) -> float:
        """Sigma of the height, inf where it is not used."""
        return math.inf if self.height_sigma_m is None else self.height_sigma_m


class ProtectionLevelsIn(ProtectionParameters):
    """The same on a DEM of the service."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId


def anchors_of(grid: ElevationGrid, parameters: ProtectionParameters) -> tuple[Anchor, ...]:
    """The anchors in the grid's frame. Raises AnchorError, FrameError, MeasurementError."""
    anchors = tuple(resolve_anchor(grid, anchor) for anchor in parameters.anchors)
    check_anchors(grid, anchors)
    for anchor in anchors:
        if not math.hypot(anchor.ranging_sigma_m, anchor.pose_sigma_m) > 0.0:
            raise MeasurementError(f"Anchor {anchor.id} needs a ranging_sigma_m above zero.")
    return anchors


def path_of(grid: ElevationGrid, parameters: ProtectionParameters) -> npt.NDArray[np.float64]:
    """(n, 3) the path in the grid's frame. Raises FrameError, VisibilityInputError, AreaError."""
    if not parameters.path:
        return np.empty((0, 3))
    points_m = points_in_grid(grid, parameters.path, "path[{}]")
    refuse_outside(grid, parameters.area, points_m, "path[{}]")
    return points_m


@told_as_asked
def check_protection(grid: ElevationGrid, parameters: ProtectionParameters) -> None:
    """Refuses what cannot be answered. Raises what the others here raise, and AreaError."""
    map_area(grid, parameters.area)
    anchors_of(grid, parameters)
    path_of(grid, parameters)
