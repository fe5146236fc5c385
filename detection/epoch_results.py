"""From verdicts to the answer for one epoch: classification, lists, position, what a planner may make of it, words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .epochs import RangeEpoch, RangeMeasurement
from .fusion import fuse
from .settings import DetectorSettings
from .verdicts import (
    AnchorVerdict,
    Classification,
    EpochResult,
    OdometryCondition,
    PlanningStatus,
    PositionFix,
    RejectedRange,
    Rejection,
    Say,
    SearchReport,
    Sight,
    Witness,
    WitnessSay,
)

__all__ = ["epoch_result", "rejected_epoch", "verdict_on"]

OCCLUDED, TOO_SHORT, UNKNOWN = Sight.OCCLUDED, Sight.TOO_SHORT, Sight.UNKNOWN
SILENT, GEOMETRY = Say.SILENT, Witness.GEOMETRY

SPOKEN = {
    Witness.GEOMETRY: "geometry",
    Witness.ODOMETRY: "odometry",
    Witness.MOTION: "the track",
    Witness.PREDICTION: "the prediction",
}


def verdict_on(
    measured: RangeMeasurement,
    excess_m: float,
    harmful_m: float,
    says: Sequence[WitnessSay],
    settings: DetectorSettings,
) -> AnchorVerdict:
    """The fused verdict on one range. Where no witness speaks, sight is unknown, with the predicted probability."""
    sight, fused, agree = fuse(says, settings)
    if sight is OCCLUDED and _is_short(excess_m, harmful_m, says):
        sight = TOO_SHORT
    probability = fused
    if probability is None:
        probability = 0.5 if measured.p_sight is None else 1.0 - measured.p_sight
    confidence = abs(2.0 * probability - 1.0) if sight is not UNKNOWN else 0.0
    score = abs(excess_m) / harmful_m if math.isfinite(excess_m) else probability
    return AnchorVerdict(
        measured.anchor_id, sight, probability, confidence, score, measured.range_m, excess_m, tuple(says),
        _reason(measured.anchor_id, sight, says, agree) + _too_short(sight, excess_m),
    )  # fmt: skip


def _reason(anchor_id: str, sight: Sight, says: Sequence[WitnessSay], agree: bool) -> str:
    spoken = [say for say in says if say.says is not SILENT]
    if not spoken:
        spoken = [say for say in says if say.witness is GEOMETRY]
    words = "; ".join([f"{SPOKEN[say.witness]}: {say.reason}" for say in spoken])
    doubt = "" if agree else ", though the witnesses differ"
    return f"{anchor_id} is {sight}{doubt}. {words[:1].upper()}{words[1:]}."


def _is_short(excess_m: float, harmful_m: float, says: Sequence[WitnessSay]) -> bool:
    """Whether a range that is off is so because it is short: clearly, or as a witness says."""
    return excess_m < -harmful_m or (excess_m < 0.0 and any(say.says is Say.TOO_SHORT for say in says))


def _too_short(sight: Sight, excess_m: float) -> str:
    """An occlusion makes ranges long, never short; whoever reads of one that is short shall look elsewhere."""
    if sight is not TOO_SHORT:
        return ""
    return (
        f" Its range is {-excess_m:.2f} m too short, which no occlusion explains: suspect where the anchor stands, or "
        "the ranging itself."
    )


def epoch_result(
    time_s: float,
    verdicts: tuple[AnchorVerdict, ...],
    position: PositionFix | None,
    odometry: OdometryCondition,
    search: SearchReport,
    rejected: tuple[RejectedRange, ...],
    needed: str,
) -> EpochResult:
    """The answer to an epoch that was used."""
    excluded = tuple([verdict.anchor_id for verdict in verdicts if verdict.off])
    included = tuple([verdict.anchor_id for verdict in verdicts if not verdict.off])
    occluded = [verdict.anchor_id for verdict in verdicts if verdict.sight is OCCLUDED]
    short = [verdict.anchor_id for verdict in verdicts if verdict.sight is TOO_SHORT]
    unknown = sum([verdict.sight is UNKNOWN for verdict in verdicts])
    classification = (Classification.NONE, Classification.SINGLE, Classification.MULTIPLE)[min(len(occluded), 2)]
    if unknown or not verdicts:
        classification = Classification.UNDETERMINED
    planning = PlanningStatus.NO_POSITION
    if position is not None:
        confirmed = PlanningStatus.DEGRADED if excluded or unknown else PlanningStatus.CHECKED
        planning = confirmed if position.checked else PlanningStatus.UNCHECKED
    return EpochResult(
        time_s, None, classification, verdicts, excluded, included, position, planning, odometry, search, rejected,
        needed if classification is Classification.UNDETERMINED or position is None or position.mirror_m is not None
        else "",
        _summary(len(verdicts), occluded, short, unknown, planning),
    )  # fmt: skip


def _summary(count: int, occluded: Sequence[str], short: Sequence[str], unknown: int, planning: PlanningStatus) -> str:
    if count == 0:
        return f"No usable range; position: {planning}."
    hidden = f"occluded: {', '.join(occluded)}" if occluded else "none occluded"
    too_short = f"; too short: {', '.join(short)}" if short else ""
    untold = f"; {unknown} not to be told" if unknown else ""
    return f"{count} ranges, {hidden}{too_short}{untold}; position: {planning}."


def rejected_epoch(epoch: RangeEpoch, time_s: float, rejection: Rejection) -> EpochResult:
    """The answer to an epoch that was not used."""
    return EpochResult(
        time_s, rejection, Classification.UNDETERMINED, (), (), (), None, PlanningStatus.NO_POSITION,
        OdometryCondition.MISSING, SearchReport(0, True, 0), (), "", f"The epoch was not used: {rejection}.",
    )  # fmt: skip
