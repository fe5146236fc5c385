"""What a detector answers to an epoch and how a session stands, as models."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from detection import (
    Calibrated,
    Classification,
    OdometryCondition,
    PlanningStatus,
    Rejection,
    Say,
    Sight,
    Witness,
)
from service.live.drives import AdviceOut
from service.live.imu import FeltOut

__all__ = ["CalibrationOut", "DetectionOut", "DetectorOut", "DetectorStateful", "EpochOut", "EpochsOut"]


class Exact(BaseModel):
    """What is answered is exactly what is documented."""

    model_config = ConfigDict(extra="forbid")


class WitnessOut(Exact):
    """What one witness says about one anchor."""

    witness: Witness = Field(description="Who speaks.")
    says: Say = Field(description="What it says; silent where it has nothing to go by.")
    evidence: float | None = Field(description="The error it found over what it tolerates (no unit); null: none.")
    weight: float | None = Field(description="Its weight in the verdict, before all are normalised (no unit).")
    reason: str = Field(description="One sentence.")
    probability: float | None = Field(description="Probability that the range is off, 0..1; null: silent.")


class VerdictOut(Exact):
    """The verdict on one anchor."""

    anchor_id: str = Field(description="Which anchor.")
    sight: Sight = Field(description="What its range says of its line of sight; too short: what no occlusion explains.")
    occluded: bool = Field(description="The flag; an anchor that is unknown or too short is not flagged.")
    probability: float | None = Field(description="Probability that the range is off: occluded or too short, 0..1.")
    confidence: float | None = Field(description="Confidence in the verdict, 0..1.")
    score: float | None = Field(description="Ranks ranges from clear to occluded: excess over harmful_m (no unit).")
    range_m: float | None = Field(description="The measured range, metres.")
    excess_m: float | None = Field(description="Measured minus expected range, metres; null: nothing is expected.")
    says: list[WitnessOut] = Field(description="What each witness says.")
    reason: str = Field(description="Why, in a sentence.")


class PlaceOut(Exact):
    """A place."""

    east_m: float | None = Field(description="East, metres.")
    north_m: float | None = Field(description="North, metres.")
    altitude_m: float | None = Field(description="Height, metres; null in two dimensions.")


class PositionOut(PlaceOut):
    """The rover's position."""

    covariance_m2: list[list[float | None]] = Field(
        description="Covariance, square metres; rows and columns: east, north and, in three dimensions, up."
    )
    bubble_m: float | None = Field(
        description="Radius of the safety bubble about it, three sigmas (root of the covariance's trace), metres; null "
        "in two dimensions."
    )
    checked: bool = Field(description="Whether more ranges than unknowns confirm it.")
    mirror: PlaceOut | None = Field(description="The other solution where no hint settles which is the rover's.")


class SearchOut(Exact):
    """How subsets of anchors were searched."""

    tried: int = Field(description="Number of subsets tried.")
    complete: bool = Field(description="Whether all that could matter were tried.")
    sets: int = Field(description="How many sets are as large as the answer or larger; impossible pairs need no try.")


class RejectedOut(Exact):
    """A range, or odometry (empty anchor_id), that was not used."""

    anchor_id: str = Field(description="Whose range; empty for odometry.")
    reason: Rejection = Field(description="Why not.")


class PredictedOut(Exact):
    """What the map foretold of one anchor before the epoch's ranges were looked at."""

    anchor_id: str = Field(description="Which anchor.")
    p_sight: float = Field(description="Probability that it is in sight, over place and ground, 0..1.")
    p_direct: float = Field(
        description="Probability that its range is too long by harmful_m at most, 0..1: what the detector hears. Of an "
        "anchor with a radio, that a range which arrived came straight, not round by a reflection."
    )
    clearance_m: float | None = Field(
        description="Of the line from the foretold place, metres; negative = blocked by that; null: no ground there."
    )
    p_usable: float | None = Field(
        description="Probability that enough of its radio's signal arrives, over the place, 0..1; null: no radio."
    )
    margin_db: float | None = Field(
        description="What arrives at the foretold place beyond the receiver's need, dB; null: no radio."
    )


class EstimateOut(Exact):
    """What the session's own filter makes of all epochs so far: one state, one covariance."""

    east_m: float = Field(description="East, metres.")
    north_m: float = Field(description="North, metres.")
    altitude_m: float = Field(description="Height, metres.")
    velocity_m_per_s: list[float] = Field(description="East, north, up, metres per second.")
    covariance: list[list[float]] = Field(
        description="Six rows and columns: east, north, up in metres, then their rates in metres per second."
    )
    bubble_m: float = Field(description="Radius of the safety bubble, three sigmas, metres.")
    used: list[str] = Field(description="Anchors whose ranges of this epoch it leaned on.")
    reacquired: bool = Field(description="Whether it was found lost, and begun anew or widened.")


class EpochOut(Exact):
    """The answer to one epoch. What JSON has no number for is null."""

    time_s: float | None = Field(description="The epoch's time, seconds.")
    sequence: int | None = Field(description="The sender's number of the epoch.")
    rejection: Rejection | None = Field(description="Why the epoch as a whole was not used; null: it was.")
    classification: Classification = Field(description="How many anchors are occluded.")
    verdicts: list[VerdictOut] = Field(description="One per range used, in the epoch's order.")
    excluded: list[str] = Field(description="Anchors that a position must not lean on.")
    included: list[str] = Field(description="Anchors that it may lean on.")
    position: PositionOut | None = Field(description="From the ranges that are left; null where they allow none.")
    planning: PlanningStatus = Field(description="What a path planner may make of this epoch.")
    odometry: OdometryCondition = Field(description="What the check of the odometry found.")
    search: SearchOut
    rejected: list[RejectedOut] = Field(description="Ranges and odometry that were not used.")
    needed: str = Field(description="What would settle what stays open; empty when nothing is.")
    summary: str = Field(description="The answer in a sentence.")
    advice: AdviceOut | None = Field(
        None, description="What lies ahead on the session's path, about once a second; null: no path, or not now."
    )
    estimate: EstimateOut | None = Field(
        None, description="Of the session's estimator; null: it has none, or it has not begun."
    )
    imu: FeltOut | None = Field(None, description="What became of its inertial readings; null: none came.")
    predicted: list[PredictedOut] | None = Field(
        None, description="What the map foretold, of the anchors that it knows of; null: the session looks at no map."
    )


class DetectionOut(EpochOut):
    """The answer to one epoch by itself."""

    warnings: list[str] = Field(description="What its ranges as a whole suffer from, units above all; often nothing.")


class EpochsOut(Exact):
    """Answers in the order of the epochs."""

    answers: list[EpochOut]


class AnchorOffsetOut(Exact):
    """What the ranges of an anchor are off."""

    anchor_id: str = Field(description="Which anchor.")
    offset_m: float = Field(description="How much too long its ranges are, metres.")
    sigma_m: float | None = Field(description="One sigma of that, metres.")


class CalibrationOut(Exact):
    """What the latest epochs say that ranges are off; nothing of it is applied."""

    of: Calibrated = Field(description="What was estimated: one offset of all, one scale, or an offset of each anchor.")
    determined: bool = Field(description="Whether the epochs tell it at all.")
    scale: float | None = Field(description="How many times too long ranges are (no unit); null: not told.")
    scale_sigma: float | None = Field(description="One sigma of that (no unit).")
    anchors: list[AnchorOffsetOut] = Field(description="Offsets; all the same where one offset was asked for.")


class AnchorStateOut(Exact):
    """The last word on one anchor."""

    anchor_id: str = Field(description="Which anchor.")
    sight: Sight = Field(description="Its line of sight at its last range.")
    probability: float | None = Field(description="Probability that it is occluded, 0..1.")
    time_s: float | None = Field(description="When its last range came, seconds; null before the first.")
    range_m: float | None = Field(description="Its last range, metres.")
    ranges: int = Field(description="Number of ranges used.")
    occluded_share: float | None = Field(description="Part of them that was occluded, 0..1.")


class HealthOut(Exact):
    """How the witnesses have done so far."""

    geometry_false_positives: float | None = Field(
        description="Part of the ranges that geometry alone flagged and the verdict cleared, 0..1."
    )
    odometry_false_positives: float | None = Field(
        description="Part of the ranges that odometry alone flagged and the verdict cleared, 0..1."
    )
    odometry_failures: float | None = Field(description="Part of the odometry that was not reliable, 0..1.")
    warnings: list[str] = Field(description="What to know, in sentences.")


class DetectorStateOut(Exact):
    """What the detector remembers."""

    time_s: float | None = Field(description="Time of the last epoch that was used, seconds.")
    epochs: int = Field(description="Number of epochs used.")
    rejections: dict[Rejection, int] = Field(description="How many ranges and epochs were not used, by reason.")
    anchors: list[AnchorStateOut]
    health: HealthOut
    last: EpochOut | None = Field(description="The last answer; null before the first.")
    position_m: list[float] | None = Field(description="Where the track is, east, north, up, metres; null without one.")
    velocity_m_per_s: list[float] | None = Field(description="How it moves, the same axes, metres per second.")


class AcknowledgedOut(Exact):
    """The last epoch that was used."""

    time_s: float = Field(description="Its time, seconds.")
    sequence: int | None = Field(description="The sender's number of it.")


class DetectorOut(Exact):
    """A session."""

    id: str = Field(description="Name of the session.")
    name: str | None = Field(description="The name that was given.")
    created_at: str = Field(description="When it was made, ISO 8601, UTC.")
    restored_at: str | None = Field(description="When a service took it over from the one before; null: never.")
    kept: bool = Field(description="Whether it outlives the service; false: the disk refused, or nothing is kept.")
    acknowledged: AcknowledgedOut | None = Field(description="The last epoch that was used: go on after it.")
    idle_timeout_s: float = Field(description="Seconds without a request after which it expires.")
    expires_in_s: float | None = Field(description="Seconds until then; null while a stream is open.")
    streams: int = Field(description="How many streams are open.")
    malformed_messages: int = Field(description="How many messages on streams could not be read.")
    anchors: list[str] = Field(description="Ids of the anchors.")
    settings: dict[str, object] = Field(description="What the detector was told, in the words of the request.")
    dem_id: str | None = Field(description="The DEM that it looks at; null: none.")
    map_warnings: list[str] = Field(description="What to know of the anchors over that DEM.")
    links: dict[Literal["self", "epochs", "stream", "map_doubts", "advice", "drive"], str] = Field(
        description="Paths: the session, epochs, stream and, with a DEM, where ranges contradict it, what lies ahead, "
        "and the path."
    )


class DetectorStateful(DetectorOut):
    """A session with what its detector remembers."""

    state: DetectorStateOut
