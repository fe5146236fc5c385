"""Sessions of detectors: bounded in number and size, ended when idle, answering in the documented words."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import pytest

from detection import (
    AnchorVerdict,
    Classification,
    DetectionInputError,
    Detector,
    DetectorSettings,
    EpochResult,
    OdometryCondition,
    OdometryIncrement,
    PlanningStatus,
    RangeMeasurement,
    RangingAnchor,
    RejectedRange,
    Rejection,
    Say,
    SearchReport,
    Sight,
    Witness,
    WitnessSay,
)
from service.errors import BusyError, GoneError, LimitError, NotFoundError, RequestError, TooManyError
from service.live.answer_models import DetectorStateful, EpochOut
from service.live.answers import as_json, epoch_answer
from service.live.registry import Detectors
from service.live.replay import rehearse
from service.live.request import ANCHORS, RANGES, DetectorIn, EpochIn, RangingAnchorIn
from service.live.settings import DetectorSettingsIn
from service.settings import Settings


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def asked(**more: Any) -> DetectorIn:
    return DetectorIn.model_validate({"anchors": ANCHORS, **more})


def epoch(time_s: float, ranges: Any = RANGES, **more: Any) -> EpochIn:
    return EpochIn.model_validate({"time_s": time_s, "ranges": ranges, **more})


def test_requests_have_every_setting_of_the_detector_with_its_default() -> None:
    assert DetectorSettingsIn.model_validate({}).settings() == DetectorSettings()
    in_degrees = [field.name.replace("_rad", "_deg") for field in dataclasses.fields(DetectorSettings)]
    assert list(DetectorSettingsIn.model_fields) == in_degrees


def test_a_request_becomes_what_the_detector_takes() -> None:
    taken = epoch(
        3.0,
        [{"anchor_id": "D1", "range_m": 5, "sigma_m": 0.2, "p_sight": 0.3, "time_s": 2.5}],
        odometry={"duration_s": 1.0, "wheel_m": [1.0, 2.0], "accelerometer_m": [1.0, 2.0, 3.0], "heading_deg": 90.0},
        sequence=7,
        moved=[{"id": "D2", "east_m": 1.0, "north_m": 2.0, "altitude_m": 3.0, "sigma_m": 0.5}],
    ).epoch()
    assert taken.ranges == (RangeMeasurement("D1", 5.0, 0.2, 0.3, 2.5),)
    assert taken.odometry == OdometryIncrement(1.0, (1.0, 2.0), (1.0, 2.0, 3.0), math.pi / 2)
    assert (taken.time_s, taken.sequence, taken.moved) == (3.0, 7, (RangingAnchor("D2", 1.0, 2.0, 3.0, 0.5),))


def test_null_is_a_range_that_was_measured_and_is_not_a_number() -> None:
    assert math.isnan(epoch(0.0, [{"anchor_id": "D1", "range_m": None}]).epoch().ranges[0].range_m)


def test_answers_are_those_of_the_detector_in_the_documented_words() -> None:
    session = Detectors(Settings()).open(asked())
    detector = Detector([RangingAnchorIn.model_validate(anchor).anchor() for anchor in ANCHORS])
    for time_s in (1.0, 2.0, 1.5):
        told = EpochOut.model_validate_json(session.answer(epoch(time_s, sequence=int(10 * time_s))))
        here = detector.process(epoch(time_s, sequence=int(10 * time_s)).epoch())
        assert told.model_dump(mode="json") == json.loads(as_json(epoch_answer(here, int(10 * time_s))))
        if told.position is not None:
            # three sigmas of the place in space (De Vivo et al., eq. 27)
            trace_m2 = sum(told.position.covariance_m2[axis][axis] or 0.0 for axis in range(3))
            assert told.position.bubble_m == pytest.approx(3.0 * math.sqrt(trace_m2))
    assert told.rejection is Rejection.OUT_OF_ORDER
    state = DetectorStateful.model_validate_json(as_json(session.state())).state
    assert state.epochs == 2
    assert state.rejections == {Rejection.OUT_OF_ORDER: 1}
    assert state.last is not None
    assert state.last.time_s == 2.0


def test_what_json_has_no_number_for_is_null() -> None:
    say = WitnessSay(Witness.MOTION, Say.SILENT, math.nan, 0.0, "Nothing yet.")
    verdict = AnchorVerdict("D1", Sight.UNKNOWN, 0.5, 0.0, math.inf, 3.0, math.nan, (say,), "Nothing yet.")
    result = EpochResult(
        math.nan, None, Classification.UNDETERMINED, (verdict,), (), ("D1",), None, PlanningStatus.NO_POSITION,
        OdometryCondition.MISSING, SearchReport(0, True, 0), (RejectedRange("D2", Rejection.NOT_FINITE),), "More.",
        "Open.",
    )  # fmt: skip
    told = EpochOut.model_validate_json(as_json(epoch_answer(result)))
    assert told.time_s is None
    assert (told.verdicts[0].score, told.verdicts[0].excess_m, told.verdicts[0].says[0].evidence) == (None, None, None)
    assert told.rejected[0].reason is Rejection.NOT_FINITE


def test_a_session_that_nobody_uses_expires_and_says_so() -> None:
    clock = Clock()
    detectors = Detectors(Settings(), clock)
    session = detectors.open(asked(idle_timeout_s=30.0))
    clock.now_s += 29.0
    assert detectors.get(session.id) is session  # which begins its idle time anew
    clock.now_s += 29.0
    session.answer(epoch(1.0))
    clock.now_s += 30.0
    with pytest.raises(GoneError, match="expired after 30 s without a request; make a new one"):
        detectors.get(session.id)
    assert len(detectors) == 0
    assert session.closed.is_set()


def test_an_open_stream_keeps_a_session() -> None:
    clock = Clock()
    detectors = Detectors(Settings(), clock)
    session = detectors.open(asked(idle_timeout_s=30.0))
    session.open_stream()
    clock.now_s += 1000.0
    detectors.sweep()
    assert session.idle_left_s is None
    assert len(detectors) == 1
    session.close_stream()
    clock.now_s += 31.0
    detectors.sweep()
    assert len(detectors) == 0


def test_sessions_are_bounded_in_number_and_an_expired_one_makes_room() -> None:
    clock = Clock()
    detectors = Detectors(Settings(max_detectors=2), clock)
    detectors.open(asked(idle_timeout_s=5.0))
    second = detectors.open(asked())
    with pytest.raises(BusyError, match=r"2 detectors are open.*SIGHTLINE_MAX_DETECTORS"):
        detectors.open(asked())
    clock.now_s += 6.0
    third = detectors.open(asked())
    assert {one.id for one in detectors.newest_first()} == {second.id, third.id}


def test_a_deleted_session_is_gone_and_an_unknown_one_was_never_there() -> None:
    detectors = Detectors(Settings())
    session = detectors.open(asked())
    detectors.delete(session.id)
    with pytest.raises(GoneError, match="was deleted"):
        detectors.get(session.id)
    with pytest.raises(NotFoundError, match="may have expired before the service"):
        detectors.get("never")


@pytest.mark.parametrize(
    ("settings", "request_", "sentence"),
    [
        ({"max_detector_anchors": 5}, {}, "may have 5 anchors, not 6.*SIGHTLINE_MAX_DETECTOR_ANCHORS"),
        ({"max_detector_search": 9}, {}, "limit of 9 subsets.*SIGHTLINE_MAX_DETECTOR_SEARCH"),
        ({"max_detector_idle_s": 9.0}, {"idle_timeout_s": 10.0}, "limit of 9 s.*SIGHTLINE_MAX_DETECTOR_IDLE_S"),
    ],
)
def test_a_session_beyond_a_limit_is_refused(settings: Any, request_: Any, sentence: str) -> None:
    detectors = Detectors(Settings(**settings))
    with pytest.raises(LimitError, match=sentence):
        detectors.open(asked(**request_))
    assert len(detectors) == 0


def test_settings_that_make_no_sense_open_no_session() -> None:
    detectors = Detectors(Settings())
    with pytest.raises(DetectionInputError, match="geometric_tolerance_m must be a number > 0"):
        detectors.open(asked(settings={"geometric_tolerance_m": 0.0}))
    assert len(detectors) == 0


def test_an_epoch_beyond_the_limits_is_refused() -> None:
    session = Detectors(Settings(max_detector_anchors=6, max_detector_streams=1)).open(asked())
    with pytest.raises(LimitError, match="may have 6 ranges, not 7"):
        session.check(epoch(1.0, [*RANGES, {"anchor_id": "D9", "range_m": 1.0}]))
    with pytest.raises(LimitError, match="may have 6 moved anchors, not 7"):
        session.check(epoch(1.0, moved=[ANCHORS[0]] * 7))
    with pytest.raises(RequestError, match="no anchor 'D9'"):
        session.check(epoch(1.0, moved=[{**ANCHORS[0], "id": "D9"}]))
    session.check(epoch(1.0, moved=[ANCHORS[0]]))
    session.open_stream()
    with pytest.raises(TooManyError, match=r"has 1 streams.*SIGHTLINE_MAX_DETECTOR_STREAMS"):
        session.open_stream()


def test_a_watcher_gets_every_answer_until_it_falls_too_far_behind() -> None:
    session = Detectors(Settings()).open(asked())
    watcher = session.watch()
    answer = session.answer(epoch(1.0))
    assert watcher.answers.get_nowait() == answer
    for time_s in range(2, 258):
        session.answer(epoch(float(time_s), []))
    assert not watcher.lost.is_set()
    session.answer(epoch(300.0, []))
    assert watcher.lost.is_set()
    session.forget(watcher)


def test_the_rehearsal_runs() -> None:
    rehearse()
