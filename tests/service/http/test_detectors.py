"""Detections and detector sessions over HTTP: answers, bad input, counted rejections, limits."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator
from typing import Any

import pytest

from detection import RangeEpoch, RangeMeasurement, RangingAnchor, detect_epoch
from service.live.answers import as_json, epoch_answer
from service.live.request import ANCHORS, RANGES
from tests.service.running import Server, running

JSON = {"Content-Type": "application/json"}


def lied(meters: float = 3.0, anchor: int = 3) -> list[dict[str, Any]]:
    return [{**r, "range_m": r["range_m"] + meters * (n == anchor)} for n, r in enumerate(RANGES)]


@pytest.fixture
def session(server: Server) -> Iterator[str]:
    answer = server.client.post("/detectors", json={"anchors": ANCHORS})
    assert answer.status_code == 201, answer.text
    yield answer.headers["Location"]
    server.client.delete(answer.headers["Location"])


def send(server: Server, session: str, *epochs: dict[str, Any]) -> list[Any]:
    # Python's json writes NaN and Infinity as many a sender does
    answer = server.client.post(f"{session}/epochs", content=json.dumps({"epochs": epochs}), headers=JSON)
    assert answer.status_code == 200, answer.text
    return list(answer.json()["answers"])


def test_a_detection_is_what_the_python_call_says(server: Server) -> None:
    told = server.client.post("/detections", json={"anchors": ANCHORS, "ranges": lied()})
    anchors = [RangingAnchor(a["id"], a["east_m"], a["north_m"], a["altitude_m"]) for a in ANCHORS]
    ranges = [RangeMeasurement(r["anchor_id"], r["range_m"], r.get("sigma_m"), r.get("p_sight")) for r in lied()]
    assert told.status_code == 200
    here = epoch_answer(detect_epoch(anchors, RangeEpoch(0.0, tuple(ranges))))
    assert told.json() == {**json.loads(as_json(here)), "warnings": []}
    assert told.json()["excluded"] == ["D4"]


def test_ranges_in_millimetres_are_asked_for_in_one_epoch_and_in_a_session(server: Server, session: str) -> None:
    ranges = [{**r, "range_m": 1000.0 * r["range_m"]} for r in RANGES]
    told = server.client.post("/detections", json={"anchors": ANCHORS, "ranges": ranges}).json()
    assert "millimetres" in told["warnings"][0]
    send(server, session, {"time_s": 1.0, "ranges": ranges})
    assert "millimetres" in server.client.get(session).json()["state"]["health"]["warnings"][0]


@pytest.mark.parametrize("count", [16, 28, 32])
def test_ranges_that_agree_with_nothing_are_answered_within_the_search_that_is_allowed(
    server: Server, session: str, count: int
) -> None:
    draw = random.Random(count)
    anchors = [
        {"id": str(n), "east_m": draw.uniform(0.0, 900.0), "north_m": draw.uniform(0.0, 900.0),
         "altitude_m": draw.uniform(40.0, 160.0)}
        for n in range(count)
    ]  # fmt: skip
    ranges = [{"anchor_id": str(n), "range_m": draw.uniform(300.0, 900.0)} for n in range(count)]
    told = server.client.post("/detections", json={"anchors": anchors, "ranges": ranges}).json()
    # three of them rule out so many others that all sets of 28 are searched; of 32 not
    assert told["search"]["complete"] is (count < 32)
    assert told["search"]["tried"] <= 1500 < told["search"]["sets"]
    assert told["excluded"] == []
    assert {verdict["sight"] for verdict in told["verdicts"]} == {"unknown"}


def test_a_range_that_is_too_short_is_excluded_and_not_called_occluded(server: Server) -> None:
    told = server.client.post("/detections", json={"anchors": ANCHORS, "ranges": lied(-3.0)}).json()
    assert (told["excluded"], told["classification"]) == (["D4"], "none")
    short = next(verdict for verdict in told["verdicts"] if verdict["anchor_id"] == "D4")
    assert (short["sight"], short["occluded"]) == ("too short", False)


BAD_RANGES = {
    "negative": (-1.0, "not positive"),
    "zero": (0.0, "not positive"),
    "NaN": (math.nan, "not finite"),
    "null": (None, "not finite"),
    "infinite": (math.inf, "not finite"),
    "enormous": (1e300, "longer than any range can be"),
}


@pytest.mark.parametrize("what", BAD_RANGES)
def test_a_range_that_cannot_be_is_named_and_the_others_are_judged(server: Server, session: str, what: str) -> None:
    range_m, reason = BAD_RANGES[what]
    spoilt = [{**RANGES[0], "range_m": range_m}, *RANGES[1:]]
    body = json.dumps({"anchors": ANCHORS, "ranges": spoilt})
    told = server.client.post("/detections", content=body, headers=JSON)
    assert told.status_code == 200, told.text
    assert told.json()["rejected"] == [{"anchor_id": "D1", "reason": reason}]
    assert [verdict["anchor_id"] for verdict in told.json()["verdicts"]] == ["D2", "D3", "D4", "D5", "D6"]
    first, second = send(server, session, {"time_s": 1.0, "ranges": spoilt}, {"time_s": 2.0, "ranges": RANGES})
    assert first["rejected"] == [{"anchor_id": "D1", "reason": reason}]
    assert second["rejected"] == []
    assert len(second["verdicts"]) == 6
    assert server.client.get(session).json()["state"]["rejections"] == {reason: 1}


def test_a_sequence_that_is_longer_than_64_bits_is_refused_and_changes_nothing(server: Server, session: str) -> None:
    epoch = {"time_s": 1.0, "sequence": 10**30, "ranges": RANGES}
    refused = server.client.post(f"{session}/epochs", json={"epochs": [epoch]})
    assert refused.status_code == 422, refused.text
    assert "sequence" in refused.json()["detail"]
    (answer,) = send(server, session, {**epoch, "sequence": 2**63 - 1})
    assert answer["sequence"] == 2**63 - 1


def test_unknown_anchors_and_anchors_twice_are_counted(server: Server, session: str) -> None:
    stranger = {"anchor_id": "Z", "range_m": 3.0}
    (answer,) = send(server, session, {"time_s": 1.0, "ranges": [*RANGES[1:], stranger, RANGES[1]]})
    assert {(one["anchor_id"], one["reason"]) for one in answer["rejected"]} == {
        ("Z", "unknown anchor"),
        ("D2", "anchor twice in one epoch"),
    }
    assert [verdict["anchor_id"] for verdict in answer["verdicts"]] == ["D3", "D4", "D5", "D6"]


@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_too_few_anchors_are_answered_with_what_is_missing(server: Server, number: int) -> None:
    told = server.client.post("/detections", json={"anchors": ANCHORS[:number], "ranges": RANGES[:number]})
    assert told.status_code == 200, told.text
    answer = told.json()
    assert answer["classification"] == "undetermined"
    assert answer["excluded"] == []
    assert answer["planning"] in ("no position", "unchecked")
    assert answer["summary"]


def test_late_repeated_and_timeless_epochs_are_told_counted_and_change_nothing(server: Server, session: str) -> None:
    good = [{"time_s": float(t), "sequence": t, "ranges": RANGES} for t in range(10, 18)]
    send(server, session, *good)
    before = server.client.get(session).json()["state"]
    answers = send(
        server, session, good[-1], {**good[-1], "sequence": 99}, {"time_s": 16.5, "ranges": RANGES},
        {"time_s": 1.0, "ranges": RANGES}, {"time_s": math.nan, "ranges": RANGES},
    )  # fmt: skip
    told = [answer["rejection"] for answer in answers]
    assert told == [
        "duplicate epoch", "duplicate epoch", "older than the epoch before it", "older than the window",
        "time not finite",
    ]  # fmt: skip
    after = server.client.get(session).json()["state"]
    assert after["rejections"] == {reason: told.count(reason) for reason in set(told)}
    assert {**after, "rejections": {}} == {**before, "rejections": {}}


def test_a_clock_that_was_set_back_is_believed_after_ten_epochs_in_order(server: Server, session: str) -> None:
    times_s = [1000.0, 1001.0, *(float(second) for second in range(12))]
    epochs = [{"time_s": time_s, "ranges": RANGES} for time_s in times_s]
    answers = server.client.post(f"{session}/epochs", json={"epochs": epochs}).json()["answers"]
    used = [answer["rejection"] is None for answer in answers]
    assert used == [True] * 2 + [False] * 9 + [True] * 3
    state = server.client.get(session).json()["state"]
    assert (state["time_s"], state["epochs"], sum(state["rejections"].values())) == (11.0, 5, 9)


def test_odometry_may_be_missing_or_useless(server: Server, session: str) -> None:
    moved = {"duration_s": 1.0, "wheel_m": [0.0, 0.0]}
    answers = send(
        server, session,
        {"time_s": 1.0, "ranges": RANGES},
        {"time_s": 2.0, "ranges": RANGES, "odometry": moved},
        {"time_s": 3.0, "ranges": RANGES, "odometry": {"duration_s": math.nan, "wheel_m": [0.0, 0.0]}},
        {"time_s": 4.0, "ranges": RANGES, "odometry": None},
    )  # fmt: skip
    assert [answer["rejected"] for answer in answers] == [
        [], [], [{"anchor_id": "", "reason": "odometry not finite or without duration"}], [],
    ]  # fmt: skip
    assert all(len(answer["verdicts"]) == 6 for answer in answers)


BAD_DETECTORS: dict[str, tuple[dict[str, Any], str, str]] = {
    "an anchor without height": ({"anchors": [{"id": "A", "east_m": 0.0, "north_m": 0.0}]}, "validation", "altitude_m"),
    "the same id twice": ({"anchors": [ANCHORS[0], ANCHORS[0]]}, "validation", "D1 comes twice"),
    "a place that is no number": ({"anchors": [{**ANCHORS[0], "east_m": None}]}, "validation", "anchors[0].east_m"),
    "a misspelt field": ({"anchors": [{**ANCHORS[0], "alt_m": 1.0}]}, "validation", "alt_m: this field is not known"),
    "33 anchors": ({"anchors": [{**ANCHORS[0], "id": str(n)} for n in range(33)]}, "limit", "may have 32 anchors"),
    "epsilon 0": ({"settings": {"geometric_tolerance_m": 0.0}}, "detection-input", "geometric_tolerance_m"),
    "epsilon < 0": ({"settings": {"odometry_tolerance_m": -0.1}}, "detection-input", "odometry_tolerance_m"),
    "sigma 0": ({"settings": {"range_sigma_m": 0}}, "detection-input", "range_sigma_m"),
    "a wrong dimension": ({"settings": {"dimension": 4}}, "validation", "settings.dimension"),
    "an endless search": ({"settings": {"search_limit": 10**9}}, "limit", "limit of 5000 subsets"),
    "an endless window": ({"settings": {"window": 10**9}}, "validation", "settings.window"),
}


@pytest.mark.parametrize("route", ["/detections", "/detectors"])
@pytest.mark.parametrize("what", BAD_DETECTORS)
def test_a_detector_that_makes_no_sense_is_refused(server: Server, route: str, what: str) -> None:
    fields, kind, named = BAD_DETECTORS[what]
    body = {"anchors": ANCHORS, **({"ranges": RANGES} if route == "/detections" else {}), **fields}
    answer = server.client.post(route, json=body)
    assert answer.status_code == 422, answer.text
    assert answer.json()["type"] == f"/problems/{kind}"
    assert named in answer.json()["detail"]


BAD_EPOCHS: dict[str, tuple[Any, str, str]] = {
    "none": ([], "validation", "epochs"),
    "without time": ([{"ranges": []}], "validation", "epochs[0].time_s"),
    "a range as text": ([{"time_s": 1.0, "ranges": [{"anchor_id": "D1", "range_m": "5"}]}], "validation", "range_m"),
    "too many": ([{"time_s": float(n), "ranges": []} for n in range(501)], "limit", "may have 500 epochs"),
    "33 ranges": ([{"time_s": 1.0, "ranges": RANGES * 6}], "limit", "may have 32 ranges"),
    "a stranger moves": ([{"time_s": 1.0, "ranges": [], "moved": [{**ANCHORS[0], "id": "Z"}]}], "request", "'Z'"),
}


@pytest.mark.parametrize("what", BAD_EPOCHS)
def test_a_request_that_is_refused_uses_none_of_its_epochs(server: Server, session: str, what: str) -> None:
    epochs, kind, named = BAD_EPOCHS[what]
    good = [] if what == "none" else [{"time_s": 0.5, "ranges": RANGES}]
    answer = server.client.post(f"{session}/epochs", json={"epochs": [*good, *epochs]})
    assert answer.status_code == 422, answer.text
    assert answer.json()["type"] == f"/problems/{kind}"
    assert named.replace("[0]", f"[{len(good)}]") in answer.json()["detail"]
    assert server.client.get(session).json()["state"]["epochs"] == 0


def test_moved_anchors_are_where_they_say_from_then_on(server: Server, session: str) -> None:
    shifted = [{**anchor, "east_m": anchor["east_m"] + 1000.0} for anchor in ANCHORS]
    here, there = send(
        server, session, {"time_s": 1.0, "ranges": RANGES}, {"time_s": 2000.0, "ranges": RANGES, "moved": shifted}
    )
    assert there["position"]["east_m"] - here["position"]["east_m"] == pytest.approx(1000.0, abs=0.5)


def test_sessions_are_listed_read_and_deleted(server: Server) -> None:
    opened = server.client.post("/detectors", json={"anchors": ANCHORS, "name": "rover 7", "idle_timeout_s": 60})
    path = opened.headers["Location"]
    listed = server.client.get("/detectors", params={"limit": 1}).json()
    assert listed["detectors"][0]["name"] == "rover 7"
    assert listed["total"] >= 1
    assert "state" not in listed["detectors"][0]
    assert server.client.get(path).json()["links"] == {
        "self": path, "epochs": f"{path}/epochs", "stream": f"{path}/stream",
    }  # fmt: skip
    assert server.client.delete(path).status_code == 204
    for answer in (
        server.client.get(path),
        server.client.delete(path),
        server.client.post(f"{path}/epochs", json={"epochs": [{"time_s": 1.0, "ranges": []}]}),
    ):
        assert answer.status_code == 410
        assert answer.json()["type"] == "/problems/gone"
        assert "was deleted" in answer.json()["detail"]


def test_an_unknown_session_is_not_found_and_an_expired_one_gone(server: Server) -> None:
    missing = server.client.get("/detectors/nobody")
    assert missing.status_code == 404
    assert "may have expired before the service" in missing.json()["detail"]
    path = server.client.post("/detectors", json={"anchors": ANCHORS, "idle_timeout_s": 1e-3}).headers["Location"]
    expired = server.client.get(path)
    assert expired.status_code == 410
    assert "expired after 0.001 s" in expired.json()["detail"]


def test_one_session_too_many_is_refused_with_503_until_one_ends(tmp_path: Any) -> None:
    with running(tmp_path / "data", max_detectors=1) as server:
        first = server.client.post("/detectors", json={"anchors": ANCHORS}).headers["Location"]
        refused = server.client.post("/detectors", json={"anchors": ANCHORS})
        assert refused.status_code == 503
        assert int(refused.headers["Retry-After"]) > 0
        assert "SIGHTLINE_MAX_DETECTORS" in refused.json()["detail"]
        server.client.delete(first)
        assert server.client.post("/detectors", json={"anchors": ANCHORS}).status_code == 201
