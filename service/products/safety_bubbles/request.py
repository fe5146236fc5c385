"""Safety bubbles: a path or a history of poses in; per point radius, clearance, margin and verdict out."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import Metres, NotNegative, NotNegativeMetres, Number, PointIn, Positive, StrictModel
from service.parts.positioning import RangingParameters
from service.products.safety_bubbles.request import BuildingsIn

__all__ = ["PATH", "BubbleParameters", "MotionIn", "SafetyBubblesIn"]

ANCHORS: list[JsonValue] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0, "ranging_sigma_m": 0.5},
    {"id": "D2", "east_m": 398100.0, "north_m": 3791700.0, "above_ground_m": 80.0, "ranging_sigma_m": 0.5},
    {"id": "D3", "east_m": 400700.0, "north_m": 3790100.0, "above_ground_m": 80.0, "ranging_sigma_m": 0.5},
]
PATH: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "anchors": ANCHORS,
    "points_m": [[400100.0, 3792900.0, 1450.0], [400200.0, 3792950.0, 1452.0]],
    "speed_m_per_s": 5.0,
}
HISTORY: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "points_m": [[400100.0, 3792900.0, 1450.0]],
    "times_s": [0.0],
    "covariances_m2": [[4.0, 0.0, 0.0, 4.0, 0.0, 9.0]],
    "under_ground": "violated",
}
Point3 = tuple[Metres, Metres, Metres]
Covariance = tuple[Number, Number, Number, Number, Number, Number]


class MotionIn(StrictModel):
    """How unsteadily the vehicle moves: power of its acceleration, and of its clock's drift."""

    horizontal_m2_per_s3: NotNegative = Field(0.1, description="Of the acceleration east and north each, metres²/s³.")
    up_m2_per_s3: NotNegative = Field(0.1, description="Of the acceleration upwards, metres²/s³.")
    clock_m2_per_s3: NotNegative = Field(0.1, description="Of the receiver's clock, metres²/s³; for pseudoranges.")


class BubbleParameters(RangingParameters):
    """A path, or a history of poses with covariances, what is ranged to, and how large the bubble shall be."""

    points: list[PointIn] | None = Field(None, description="The points as objects; or give points_m.")
    points_m: list[Point3] | None = Field(
        None, description="The points as [east, north, altitude] in metres; or give points."
    )
    times_s: list[Number] | None = Field(None, description="When, seconds, never backwards; or give speed_m_per_s.")
    speed_m_per_s: Positive | None = Field(None, description="Speed along the path, m/s; 1 without times_s.")
    covariances_m2: list[Covariance] | None = Field(
        None,
        description="A history of poses: the covariance of each as [ee, en, eu, nn, nu, uu], m². Nothing is predicted "
        "then, and no anchors are needed.",
    )
    kind: Literal["ranging", "pseudorange"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock."
    )
    epsilon: Positive = Field(3.0, description="How many sigmas the bubble's radius is, no unit.")
    dem_sigma_m: NotNegativeMetres = Field(0.0, description="Uncertainty of the DEM, added to the radius, metres.")
    dop_scaled: bool = Field(
        False,
        strict=True,
        description="Whether each variance is multiplied by the PDOP of the anchors in sight (eq. 26).",
    )
    ranging_interval_s: Positive | None = Field(
        None, description="Seconds between ranges; left out: once at each point."
    )
    motion: MotionIn = Field(
        default_factory=lambda: MotionIn.model_validate({}), description="How unsteadily the vehicle moves."
    )
    initial_position_sigma_m: Positive = Field(10.0, description="Per axis, before the first ranges, metres.")
    initial_velocity_sigma_m_per_s: Positive = Field(1.0, description="Per axis, before the first ranges, m/s.")
    on_ground: bool = Field(False, strict=True, description="The vehicle is on the ground, whose height the DEM tells.")
    ground_sigma_m: Positive = Field(0.5, description="One-sigma error of that height, metres.")
    under_ground: Literal["refuse", "violated"] = Field(
        "refuse",
        description="What a point below the ground or inside a building is: a mistake to be refused, or a violated "
        "bubble.",
    )
    buildings: BuildingsIn | None = Field(
        None, description="What stands on the ground: it hides anchors, and the bubble must be clear of it too."
    )

    @model_validator(mode="after")
    def _whole_question(self) -> Self:
        if (self.points is None) == (self.points_m is None):
            raise ValueError("Give either points or points_m.")
        count = len(self.points if self.points is not None else self.points_m or [])
        if count == 0:
            raise ValueError("At least one point is needed.")
        if self.times_s is not None and self.speed_m_per_s is not None:
            raise ValueError("Give times_s or speed_m_per_s, not both.")
        for name in ("times_s", "covariances_m2"):
            given = getattr(self, name)
            if given is not None and len(given) != count:
                raise ValueError(f"{name} must have one entry for each of the {count} points, not {len(given)}.")
        if self.covariances_m2 is None and not self.anchors and self.satellites is None:
            raise ValueError("Give anchors or satellites to range to, or covariances_m2.")
        return self

    @property
    def count(self) -> int:
        """How many points there are."""
        return len(self.points if self.points is not None else self.points_m or [])


class SafetyBubblesIn(BubbleParameters):
    """The same on a DEM of the service."""

    model_config = ConfigDict(json_schema_extra={"examples": [PATH, HISTORY]})

    dem_id: DemId
