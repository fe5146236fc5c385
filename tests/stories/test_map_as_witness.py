"""A planner's map rides along: what it predicts of each drone's sight settles what five ranges cannot, over real HTTP.

Where the drones are hidden on the drive, and by how much the way over the ground is longer, the service itself tells.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import rasterio
from websockets.sync.client import connect

from dem_samples import sample_path
from detection import RangingAnchor
from detection.simulation import RangingNoise, SimulatedDrive, draw_epochs, drive_along
from terrain import height_at, read_dem
from tests.service.running import Server
from visibility.cover import Canopy
from visibility.signal import RADIOS, Foliage, signals, with_foliage

DRONES = [
    {"id": "D1", "east_m": 748920.0, "north_m": 4023535.5, "altitude_m": 754.8},
    {"id": "D2", "east_m": 751420.0, "north_m": 4021035.5, "altitude_m": 435.0},
    {"id": "D3", "east_m": 748920.0, "north_m": 4018535.5, "altitude_m": 802.9},
    {"id": "D4", "east_m": 747152.2, "north_m": 4019267.7, "altitude_m": 983.1},
    {"id": "D5", "east_m": 747152.2, "north_m": 4022803.2, "altitude_m": 866.8},
]
# 200 m down into a hollow: the ground hides D2 ever deeper, by 8 mm a step
WAY_M = [(750609.1, 4020739.0), (750410.6, 4020714.9)]
ANTENNA_M, SPEED_M_PER_S = 1.5, 1.0
SIGMA_M, HARMFUL_M = 0.1, 0.5
# how far a planner trusts the map: in sight where it says so, hidden where it says so
SURE = 0.95
SETTINGS = {"range_sigma_m": SIGMA_M, "harmful_m": HARMFUL_M, "max_speed_m_per_s": 2.0, "wheel_sigma_m": 0.02}


@dataclass(frozen=True)
class Drive:
    """The drive as it was, and as messages without and with what the map predicts."""

    truth: SimulatedDrive
    blind: list[dict[str, Any]]
    foretold: list[dict[str, Any]]


@pytest.fixture(scope="module")
def drive(server: Server) -> Drive:
    dem_id = server.sample("jacksboro")["id"]
    anchors = [RangingAnchor(**drone) for drone in DRONES]
    level = drive_along(anchors, [(*place_m, 0.0) for place_m in WAY_M], SPEED_M_PER_S)
    ground = read_dem(sample_path("jacksboro"))
    places_m = level.places_m.copy()
    places_m[:, 2] = height_at(ground, places_m[:, 0], places_m[:, 1]) + ANTENNA_M
    truth = SimulatedDrive(tuple(anchors), level.times_s, places_m, excess_over_ground(server, dem_id, places_m))
    epochs = draw_epochs(truth, RangingNoise(SIGMA_M), np.random.default_rng(2))
    p_sight = predicted(server, dem_id, places_m)
    blind = [
        {
            "time_s": epoch.time_s,
            "sequence": epoch.sequence,
            "ranges": [{"anchor_id": r.anchor_id, "range_m": r.range_m} for r in epoch.ranges],
            "odometry": epoch.odometry and {"duration_s": 1.0, "wheel_m": epoch.odometry.wheel_m},
        }
        for epoch in epochs
    ]
    foretold = [
        {**message, "ranges": [{**r, "p_sight": p} for r, p in zip(message["ranges"], row, strict=True)]}
        for message, row in zip(blind, p_sight.tolist(), strict=True)
    ]
    return Drive(truth, blind, foretold)


def excess_over_ground(server: Server, dem_id: str, places_m: Any) -> Any:
    drones_m = [[drone["east_m"], drone["north_m"], drone["altitude_m"]] for drone in DRONES]
    asked = {
        "dem_id": dem_id,
        "from_points_m": [place for place in places_m.tolist() for _ in drones_m],
        "to_points_m": drones_m * len(places_m),
    }
    answer = server.client.post("/lines-of-sight", json=asked, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    arrays = next(path for path in answer.json()["files"] if path.endswith(".npz"))
    with np.load(io.BytesIO(server.client.get(arrays).content)) as lines:
        return lines["excess_path_m"].reshape(len(places_m), len(DRONES))


def predicted(server: Server, dem_id: str, places_m: Any) -> Any:
    """The planner's map, made before the drive: who is in sight at the rover's places."""
    asked = {"dem_id": dem_id, "anchors": DRONES, "receiver_above_ground_m": ANTENNA_M}
    answer = server.client.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    layers = {layer["name"]: layer["href"] for layer in answer.json()["layers"]}
    with rasterio.open(io.BytesIO(server.client.get(layers["visible.tif"]).content)) as visible:
        bands = np.array(list(visible.sample(places_m[:, :2])))
    assert set(np.unique(bands)) <= {0, 1}
    return np.where(bands == 1, SURE, 1.0 - SURE)


def streamed(server: Server, messages: list[dict[str, Any]]) -> list[dict[str, Any]]:
    session = server.client.post("/detectors", json={"anchors": DRONES, "settings": SETTINGS}).headers["Location"]
    answers = []
    with connect(f"{server.url.replace('http', 'ws')}{session}/stream", proxy=None) as stream:
        for message in messages:
            stream.send(json.dumps(message))
            answers.append(json.loads(stream.recv(timeout=20)))
    server.client.delete(session)
    assert [answer["rejection"] for answer in answers] == [None] * len(messages)
    return answers


def looking(server: Server, dem_id: str, messages: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """The answers of a session that looks at the DEM by itself, and where its ranges contradict the map."""
    asked = {"anchors": DRONES, "settings": SETTINGS, "dem_id": dem_id, "antenna_above_ground_m": ANTENNA_M}
    answer = server.client.post("/detectors", json=asked)
    assert answer.status_code == 201, answer.text
    links = answer.json()["links"]
    sent = server.client.post(links["epochs"], json={"epochs": messages}).raise_for_status().json()["answers"]
    return sent, server.client.get(links["map_doubts"]).raise_for_status().json()


def alone(server: Server, ranges: list[dict[str, Any]]) -> dict[str, Any]:
    asked = {"anchors": DRONES, "settings": SETTINGS, "ranges": ranges}
    return dict(server.client.post("/detections", json=asked).raise_for_status().json())


def calls_of_d2(answers: list[dict[str, Any]]) -> Any:
    return np.array([answer["verdicts"][1]["occluded"] for answer in answers])


def level_errors_m(drive: Drive, answers: list[dict[str, Any]]) -> Any:
    places_m = np.array([[answer["position"][axis] for axis in ("east_m", "north_m")] for answer in answers])
    return np.linalg.norm(places_m - drive.truth.places_m[:, :2], axis=1)


def test_the_ground_hides_one_drone_and_its_ranges_grow_too_long(drive: Drive) -> None:
    excess_m = drive.truth.excess_m
    assert not (excess_m[:, [0, 2, 3, 4]] > 0.0).any()
    assert excess_m[0, 1] < 2.0 * SIGMA_M
    assert 2.0 < excess_m[-1, 1] < 2.5


def test_the_five_ranges_of_an_epoch_do_not_tell_which_lies_and_the_map_does(server: Server, drive: Drive) -> None:
    blind, foretold = (
        [alone(server, message["ranges"]) for message in messages[-12:]] for messages in (drive.blind, drive.foretold)
    )
    assert calls_of_d2(blind).mean() < 0.25
    assert any(answer["classification"] == "undetermined" and answer["needed"] for answer in blind)
    assert calls_of_d2(foretold).mean() > 0.5
    witness = next(answer for answer in foretold if answer["excluded"])["verdicts"][1]["says"][-1]
    assert (witness["witness"], witness["says"]) == ("prediction", "occluded")
    assert "5%" in witness["reason"]


def test_only_the_session_with_the_map_notices_what_grows_slowly(server: Server, drive: Drive) -> None:
    bad = drive.truth.excess_m[:, 1] > 2.0 * HARMFUL_M
    blind, foretold = (streamed(server, messages) for messages in (drive.blind, drive.foretold))
    assert calls_of_d2(blind)[bad].mean() < 0.75 < 0.9 < calls_of_d2(foretold)[bad].mean()
    wronged = [name for answer in foretold for name in answer["excluded"] if name != "D2"]
    assert len(wronged) <= 0.01 * 4 * len(foretold)
    assert foretold[-1]["planning"] == "degraded"
    assert np.median(level_errors_m(drive, foretold)[bad]) < 0.5 * np.median(level_errors_m(drive, blind)[bad])


def test_a_session_that_names_a_dem_foretells_by_itself(server: Server, drive: Drive) -> None:
    bad = drive.truth.excess_m[:, 1] > 2.0 * HARMFUL_M
    answers, doubts = looking(server, server.sample("jacksboro")["id"], drive.blind)
    foretold = {one["anchor_id"]: one["p_direct"] for one in answers[-1]["predicted"]}
    assert foretold["D2"] < 0.2 < 0.9 < foretold["D4"]
    assert calls_of_d2(answers)[bad].mean() > 0.9
    assert np.median(level_errors_m(drive, answers)[bad]) < 0.5
    assert answers[-1]["position"]["covariance_m2"]
    assert doubts == {**doubts, "type": "FeatureCollection", "features": []}


def test_a_dem_that_is_not_there_and_a_map_that_was_not_named_are_refused(server: Server) -> None:
    missing = server.client.post("/detectors", json={"anchors": DRONES, "dem_id": "nothing"})
    assert missing.status_code == 404, missing.text
    flat = {"anchors": DRONES, "dem_id": server.sample("jacksboro")["id"], "settings": {"dimension": 2}}
    told = server.client.post("/detectors", json=flat).json()
    assert told["detail"].startswith("A map is of use in three dimensions"), told
    blind = server.client.post("/detectors", json={"anchors": DRONES}).json()
    assert "map_doubts" not in blind["links"]
    refused = server.client.get(f"{blind['links']['self']}/map-doubts")
    assert refused.status_code == 422
    assert refused.json()["detail"] == "The detector looks at no map: open one with dem_id."


def test_a_map_that_is_wrong_does_not_outvote_what_is_measured(server: Server, drive: Drive) -> None:
    wrong = {"D4": 1.0 - SURE}
    begin = [
        {**message, "ranges": [{**r, "p_sight": wrong.get(r["anchor_id"], SURE)} for r in message["ranges"]]}
        for message in drive.blind[:12]
    ]
    assert [answer["excluded"] for answer in streamed(server, begin)] == [[]] * 12


def test_a_session_whose_drones_have_radios_hears_through_trees(server: Server, drive: Drive) -> None:
    radio = {"preset": "868MHz", "sensitivity_dbm": -108.0}
    trees = {"canopy": {"top_m": 12.0, "model": "density", "depth_per_m": 0.2}}
    asked = {
        "anchors": [{**drone, "radio": radio} for drone in DRONES], "dem_id": server.sample("jacksboro")["id"],
        "settings": SETTINGS, "antenna_above_ground_m": ANTENNA_M, "cover": trees,
    }  # fmt: skip
    made = server.client.post("/detectors", json=asked)
    assert made.status_code == 201, made.text
    links = made.json()["links"]
    with connect(f"{server.url.replace('http', 'ws')}{links['stream']}", proxy=None) as stream:
        stream.send(json.dumps(drive.blind[0]))
        told = json.loads(stream.recv(timeout=20))
    sent = server.client.post(links["epochs"], json={"epochs": drive.blind[1:2]}).raise_for_status().json()["answers"]
    heard = {one["anchor_id"]: one for one in told["predicted"]}
    ground = read_dem(sample_path("jacksboro"))
    canopy = Canopy(ground, np.full(ground.shape, 12.0, np.float32), np.zeros(ground.shape, np.float32))
    places_m, ends_m = np.tile(drive.truth.places_m[0], (5, 1)), [list(drone.values())[1:] for drone in DRONES]
    link = signals(
        with_foliage(ground, Foliage(canopy, "density", 0.2)), places_m, ends_m,
        replace(RADIOS["868MHz"], sensitivity_dbm=-108.0),
    )  # fmt: skip
    assert [one["margin_db"] for one in heard.values()] == pytest.approx(link.margin_db.tolist(), abs=3.0)
    assert {one["anchor_id"] for one in sent[0]["predicted"]} == set(heard)
    assert all(0.0 <= one["p_usable"] <= 1.0 for one in heard.values())
    weakest = min(heard.values(), key=lambda one: one["margin_db"])
    assert weakest["p_usable"] < 0.2
    assert weakest["p_direct"] < 0.5 < heard["D1"]["p_sight"]


@pytest.mark.parametrize(
    ("path", "more", "sentence"),
    [
        ("/detectors", {}, "a radio is heard over a DEM; give dem_id too, or leave it out"),
        ("/detections", {"ranges": []}, "a radio is heard over a DEM; an epoch by itself looks at none"),
    ],
)
def test_radios_that_nobody_would_listen_to_are_refused(
    server: Server, path: str, more: dict[str, Any], sentence: str
) -> None:
    asked = {"anchors": [{**DRONES[0], "radio": "uwb"}, *DRONES[1:]], **more}
    refused = server.client.post(path, json=asked)
    assert refused.status_code == 422, refused.text
    assert sentence in refused.json()["detail"]
