"""Sessions with an inertial unit: rates and increments in their units, what is told of them, and a restart between."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from service.live.answer_models import EpochOut
from service.live.registry import Detectors
from service.live.request import DetectorIn, EpochIn
from service.live.sessions import DetectorSession
from service.live.snapshots import freeze, thaw
from service.settings import Settings
from tests.navigation.drives.test_riding import ANCHORS, HZ, place_m, readings

OF_SESSION = [{"id": a.id, "east_m": a.east_m, "north_m": a.north_m, "altitude_m": a.altitude_m} for a in ANCHORS]


def opened(**more: Any) -> DetectorSession:
    asked = {"anchors": OF_SESSION, "settings": {"max_speed_m_per_s": 3.0}, "estimator": "inertial", **more}
    return Detectors(Settings()).open(DetectorIn.model_validate(asked))


def imu(time_s: int, form: str) -> dict[str, Any]:
    """The same second of readings in one of three forms."""
    times_s, forces, rates = readings(time_s, np.random.default_rng(time_s))
    if form == "increments":
        deltas = {"delta_velocities": (forces / HZ).tolist(), "delta_angles": np.degrees(rates / HZ).tolist()}
        return {"times_s": times_s.tolist(), **deltas, "angle_unit": "deg"}
    if form == "g":
        told = {"forces": (forces / 9.80665).tolist(), "rates": np.degrees(rates).tolist()}
        return {"times_s": times_s.tolist(), **told, "force_unit": "g", "angle_unit": "deg"}
    return {"times_s": times_s.tolist(), "forces": forces.tolist(), "rates": rates.tolist()}


def epoch(time_s: int, form: str | None = "rates") -> EpochIn:
    ranges = [
        {"anchor_id": a.id, "range_m": math.dist((a.east_m, a.north_m, a.altitude_m), place_m(time_s))} for a in ANCHORS
    ]
    body = {"time_s": float(time_s), "ranges": ranges, "imu": None if form is None else imu(time_s, form)}
    return EpochIn.model_validate(body)


@pytest.mark.parametrize("form", ["increments", "g"])
def test_rates_and_increments_in_their_units_are_one(form: str) -> None:
    ends = []
    for one in ("rates", form):
        session = opened(imu={"heading_deg": 0.0})
        for time_s in range(1, 15):
            answer = EpochOut.model_validate_json(session.answer(epoch(time_s, one)))
        assert answer.imu is not None
        assert (answer.imu.readings, answer.imu.used, answer.imu.riding) == (HZ, HZ, True)
        assert answer.estimate is not None
        ends.append((answer.estimate.east_m, answer.estimate.north_m, answer.estimate.altitude_m))
    assert ends[0] == pytest.approx(ends[1], abs=0.02)
    assert math.dist(ends[0], place_m(14)) < 0.3


def test_what_is_wrong_is_told_in_the_answer_and_the_session_goes_on() -> None:
    session = opened()
    body = {"time_s": 1.0, "ranges": [], "imu": {**imu(1, "rates"), "force_unit": "g"}}
    told = json.loads(session.answer(EpochIn.model_validate(body)))["imu"]
    assert (told["used"], told["readings"]) == (0, HZ)
    assert "m/s² in the median are no driving" in told["warnings"][0]
    assert json.loads(session.answer(epoch(2)))["imu"]["used"] == HZ
    again = json.loads(session.answer(epoch(3, None)))
    assert again["imu"] is None
    plain = opened(estimator="constant_velocity")
    assert json.loads(plain.answer(epoch(1)))["imu"] == {
        "readings": HZ, "used": 0, "riding": False, "warnings": ["Not used: the session has no estimator inertial."],
    }  # fmt: skip


def test_it_outlives_the_service() -> None:
    session = opened(imu={"unit": "tactical", "heading_deg": 0.0})
    for time_s in range(1, 10):
        session.answer(epoch(time_s))
    again = thaw(freeze(session.memory), None)
    going_on, gone_on = session.memory.process(epoch(10)).estimate, again.process(epoch(10)).estimate
    assert again.inertial is not None
    assert again.inertial.riding
    assert going_on is not None
    assert gone_on is not None
    assert gone_on.position_m.tolist() == going_on.position_m.tolist()
    assert gone_on.covariance.tolist() == going_on.covariance.tolist()


@pytest.mark.parametrize(
    ("imu", "sentence"),
    [
        ({"times_s": [1.0], "forces": [[0, 0, 9.8]]}, "forces and rates, or delta_velocities and delta_angles"),
        ({"times_s": [1.0, 2.0], "forces": [[0, 0, 9.8]], "rates": [[0, 0, 0]]}, "as many as times_s, 2"),
        ({"times_s": [1.0], "forces": [[0, 0, 9.8]], "rates": [[0, 0, 0]], "force_unit": "ft"}, "force_unit"),
    ],
)
def test_readings_of_no_form_are_refused(imu: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        EpochIn.model_validate({"time_s": 1.0, "ranges": [], "imu": imu})


def test_one_increment_an_epoch_is_used_from_the_second_on() -> None:
    session, used = opened(), []
    for time_s in (1.0, 1.1, 1.2):
        one = {"times_s": [time_s], "delta_velocities": [[0.0, 0.0, 0.981]], "delta_angles": [[0.0, 0.0, 0.0]]}
        used.append(json.loads(session.answer(EpochIn.model_validate({"time_s": time_s, "ranges": [], "imu": one}))))
    assert [answer["imu"]["used"] for answer in used] == [0, 1, 1]
    assert used[1]["imu"]["warnings"] == used[2]["imu"]["warnings"] == []


@pytest.mark.parametrize("form", ["rates", "increments"])
def test_a_reading_of_another_clock_does_not_make_all_later_ones_late(form: str) -> None:
    session = opened()
    told = json.loads(session.answer(epoch(1, form)))["imu"]
    strange = epoch(2, form)
    assert strange.imu is not None
    strange.imu.times_s[-1] = 1.8e9
    told = json.loads(session.answer(strange))["imu"]
    assert told["used"] == HZ - 1
    assert told["warnings"] == ["Readings over an hour later than their epoch, not used: 1."]
    assert json.loads(session.answer(epoch(3, form)))["imu"]["used"] == HZ


@pytest.mark.parametrize("axes", ["fru", "xyz", "f"])
def test_axes_of_no_unit_are_refused_when_a_session_begins(axes: str) -> None:
    with pytest.raises(ValidationError, match=f"right-handed: flu, frd, rfu …, not '{axes}'"):
        opened(imu={"axes": axes})


def test_a_unit_without_its_estimator_is_refused() -> None:
    with pytest.raises(ValidationError, match="imu is of the estimator inertial"):
        opened(estimator=None, imu={"unit": "lower"})
