"""What a detector answers to an epoch and how a session stands, as JSON; its models are in ``answer_models``.

Of our dataclasses orjson would write them by itself, in 1.6 times the time (measured with six ranges).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import orjson

from detection import (
    AnchorVerdict,
    Calibrated,
    Calibration,
    DetectorState,
    EpochResult,
    PositionFix,
    SearchReport,
    Suspicion,
)
from navigation import RoverEstimate, bubble_radius_m
from planning.watching import Advice, WatchedEpoch
from service.live.drives import advice_answer

__all__ = ["as_json", "calibration_answer", "epoch_answer", "state_answer"]

SIGMAS = 3.0  # in the radius of a bubble


def as_json(answer: dict[str, object]) -> bytes:
    """The answer as JSON; NaN and infinities become null."""
    return orjson.dumps(answer)


def epoch_answer(
    result: EpochResult,
    sequence: int | None = None,
    watched: WatchedEpoch | None = None,
    advice: Advice | None = None,
    *,
    over_map: bool = False,
    imu: dict[str, object] | None = None,
) -> dict[str, object]:
    """The answer to one epoch, in the words of ``EpochOut``.

    watched, advice: with what else there is to it; over_map: also with what a map foretold; imu: what became of
    inertial readings, in the words of ``FeltOut``.
    """
    return {
        "time_s": result.time_s,
        "sequence": sequence,
        "rejection": result.rejection,
        "classification": result.classification,
        "verdicts": [_verdict(verdict) for verdict in result.verdicts],
        "excluded": result.excluded,
        "included": result.included,
        "position": None if result.position is None else _position(result.position),
        "planning": result.planning,
        "odometry": result.odometry,
        "search": _search(result.search),
        "rejected": [{"anchor_id": one.anchor_id, "reason": one.reason} for one in result.rejected],
        "needed": result.needed,
        "summary": result.summary,
        "advice": None if advice is None else advice_answer(advice),
        "predicted": _predicted(watched) if over_map and watched is not None else None,
        "imu": imu,
        "estimate": None if watched is None or watched.estimate is None else _estimate(watched.estimate),
    }


def _predicted(watched: WatchedEpoch) -> list[dict[str, object]]:
    """Of every anchor that the map knows something of."""
    forecast = watched.forecast
    if forecast is None:
        return []
    names = ("p_sight", "p_direct", "clearance_m", "p_usable", "margin_db")
    columns = [getattr(forecast, name).tolist() for name in names]
    rows = zip(watched.anchor_ids, *columns, strict=True)
    return [
        {"anchor_id": anchor_id, **dict(zip(names, row, strict=True))} for anchor_id, *row in rows if row[0] == row[0]
    ]


def _estimate(estimate: RoverEstimate) -> dict[str, object]:
    return {
        **_place(estimate.position_m),
        "velocity_m_per_s": estimate.velocity_m_per_s.tolist(),
        "covariance": estimate.covariance.tolist(),
        "bubble_m": estimate.bubble_m,
        "used": estimate.used,
        "reacquired": estimate.reacquired,
    }


def calibration_answer(what: Calibrated, found: Calibration | None) -> dict[str, object]:
    """In the words of ``CalibrationOut``."""
    if found is None:
        return {"of": what, "determined": False, "scale": None, "scale_sigma": None, "anchors": []}
    anchors = [
        {"anchor_id": anchor_id, "offset_m": offset_m, "sigma_m": found.offset_sigmas_m.get(anchor_id)}
        for anchor_id, offset_m in found.offsets_m.items()
    ]
    scaled = (found.scale, found.scale_sigma) if what == "scale" else (None, None)
    return {"of": what, "determined": True, "scale": scaled[0], "scale_sigma": scaled[1], "anchors": anchors}


def state_answer(state: DetectorState, suspicions: tuple[Suspicion, ...]) -> dict[str, object]:
    """What a detector remembers, in the words of ``DetectorStateOut``, and what all of it suffers from."""
    health = state.health
    return {
        "time_s": state.time_s,
        "epochs": state.epochs,
        "rejections": {str(reason): count for reason, count in state.rejections.items()},
        "anchors": [
            {
                "anchor_id": anchor.anchor_id,
                "sight": anchor.sight,
                "probability": anchor.probability,
                "time_s": anchor.time_s,
                "range_m": anchor.range_m,
                "ranges": anchor.ranges,
                "occluded_share": anchor.occluded_share,
            }
            for anchor in state.anchors
        ],
        "health": {
            "geometry_false_positives": health.geometry_false_positives,
            "odometry_false_positives": health.odometry_false_positives,
            "odometry_failures": health.odometry_failures,
            "warnings": [*(one.sentence for one in suspicions), *health.warnings],
        },
        "last": None if state.last is None else epoch_answer(state.last),
        "position_m": state.position_m,
        "velocity_m_per_s": state.velocity_m_per_s,
    }


def _verdict(verdict: AnchorVerdict) -> dict[str, object]:
    return {
        "anchor_id": verdict.anchor_id,
        "sight": verdict.sight,
        "occluded": verdict.occluded,
        "probability": verdict.probability,
        "confidence": verdict.confidence,
        "score": verdict.score,
        "range_m": verdict.range_m,
        "excess_m": verdict.excess_m,
        "says": [
            {
                "witness": say.witness,
                "says": say.says,
                "evidence": say.evidence,
                "weight": say.weight,
                "reason": say.reason,
                "probability": say.probability,
            }
            for say in verdict.says
        ],
        "reason": verdict.reason,
    }


def _search(report: SearchReport) -> dict[str, object]:
    return {"tried": report.tried, "complete": report.complete, "sets": report.sets}


def _position(fix: PositionFix) -> dict[str, object]:
    return {
        **_place(fix.position_m),
        "covariance_m2": fix.covariance_m2.tolist(),
        "bubble_m": float(bubble_radius_m(fix.covariance_m2, SIGMAS)) if len(fix.position_m) == 3 else None,
        "checked": fix.checked,
        "mirror": None if fix.mirror_m is None else _place(fix.mirror_m),
    }


def _place(place_m: npt.NDArray[np.float64]) -> dict[str, float | None]:
    east_m, north_m, *up_m = place_m.tolist()
    return {"east_m": east_m, "north_m": north_m, "altitude_m": up_m[0] if up_m else None}
