"""Sessions that look at a DEM: one message with position, covariance, verdicts and what the map foretold."""

from __future__ import annotations

import asyncio
import json
import math
from typing import Any

import pytest

from navigation import StateError
from planning import WatchError
from service.errors import RequestError
from service.live.answer_models import DetectorStateful, EpochOut
from service.live.registry import Detectors
from service.live.request import DetectorIn, EpochIn
from service.live.sessions import DetectorSession
from service.live.snapshots import freeze, thaw
from service.settings import Settings
from terrain import ElevationGrid, height_at
from tests.planning.watching.grounds import anchors, ridge

ANCHORS = [{"id": a.id, "east_m": a.east_m, "north_m": a.north_m, "altitude_m": a.altitude_m} for a in anchors()]


def opened(grid: ElevationGrid | None, **more: Any) -> DetectorSession:
    asked = {"anchors": ANCHORS, "settings": {"harmful_m": 0.5}, "dem_sigma_m": 1.0, **more}
    return Detectors(Settings()).open(DetectorIn.model_validate(asked), grid)


def epoch(second: int, too_long_m: dict[str, float]) -> EpochIn:
    east_m, north_m = 430.0, 300.0 + second
    place_m = (east_m, north_m, float(height_at(ridge(ridge_m=45.0), east_m, north_m)) + 1.5)
    ranges = [
        {
            "anchor_id": a.id,
            "range_m": math.dist((a.east_m, a.north_m, a.altitude_m), place_m) + too_long_m.get(a.id, 0.0),
        }
        for a in anchors()
    ]
    return EpochIn.model_validate({"time_s": float(second), "sequence": second, "ranges": ranges})


def test_an_answer_holds_what_the_map_foretold() -> None:
    session = opened(ridge(ridge_m=45.0), dem_id="ridge")
    hidden = {"A1": 4.0, "A2": 4.0, "A3": 4.0}
    for second in range(8):
        answer = json.loads(session.answer(epoch(second, hidden)))
    EpochOut.model_validate(answer)
    assert answer["excluded"] == ["A1", "A2", "A3"]
    assert len(answer["position"]["covariance_m2"]) == 3
    foretold = {one["anchor_id"]: one for one in answer["predicted"]}
    assert list(foretold) == [a.id for a in anchors()]
    assert foretold["A2"]["p_sight"] < 0.05 < 0.95 < foretold["A8"]["p_sight"]
    assert foretold["A2"]["clearance_m"] < 0.0 < foretold["A8"]["clearance_m"]
    told = session.state()
    DetectorStateful.model_validate_json(json.dumps(told))
    assert told["dem_id"] == "ridge"


def test_where_ranges_contradict_the_map_is_geojson() -> None:
    session = opened(ridge(ridge_m=0.0), dem_id="ridge")
    for second in range(40):
        session.answer(epoch(second, {"A5": 6.0}))
    collection = json.loads(asyncio.run(session.map_doubts()))
    assert collection["type"] == "FeatureCollection"
    assert {one["properties"]["anchor_id"] for one in collection["features"]} == {"A5"}
    (doubt,) = collection["features"]
    assert doubt["geometry"]["type"] == "LineString"
    assert doubt["properties"]["expected"] == "in sight"
    assert doubt["properties"]["excess_m"] == pytest.approx(6.0, abs=1.0)


def test_a_session_without_a_map_foretells_nothing() -> None:
    session = opened(None)
    answer = json.loads(session.answer(epoch(0, {})))
    EpochOut.model_validate(answer)
    assert answer["predicted"] is None
    assert "map_doubts" not in session.description()["links"]  # type: ignore[operator] # links are a mapping
    with pytest.raises(RequestError, match="no map"):
        asyncio.run(session.map_doubts())


def test_a_map_of_two_dimensions_is_refused() -> None:
    with pytest.raises(WatchError, match="three dimensions"):
        opened(ridge(), dem_id="ridge", settings={"dimension": 2})


@pytest.mark.parametrize("estimator", ["constant_velocity", "hypotheses"])
@pytest.mark.parametrize("dem_id", ["ridge", None])
def test_position_bubble_and_verdicts_of_a_filter_come_in_one_message(dem_id: str | None, estimator: str) -> None:
    grid = ridge(ridge_m=45.0)
    session = opened(None if dem_id is None else grid, dem_id=dem_id, estimator=estimator)
    for second in range(12):
        answer = json.loads(session.answer(epoch(second, {"A1": 4.0})))
    told = EpochOut.model_validate(answer).estimate
    assert told is not None
    assert told.used == ["A2", "A3", "A4", "A5", "A6", "A7", "A8"]
    north_m = 311.0
    off_m = math.dist(
        (told.east_m, told.north_m, told.altitude_m), (430.0, north_m, float(height_at(grid, 430.0, north_m)) + 1.5)
    )
    assert off_m < 0.3 < told.bubble_m < 3.0
    assert told.velocity_m_per_s[1] == pytest.approx(1.0, abs=0.2)
    assert [len(row) for row in told.covariance] == [6] * 6
    assert (answer["predicted"] is None) == (dem_id is None)


@pytest.mark.parametrize("estimator", ["constant_velocity", "hypotheses"])
def test_a_filter_outlives_the_service_with_its_session(estimator: str) -> None:
    grid = ridge(ridge_m=45.0)
    session = opened(grid, dem_id="ridge", estimator=estimator)
    for second in range(6):
        session.answer(epoch(second, {}))
    again = thaw(freeze(session.memory), grid)
    going_on, gone_on = session.memory.process(epoch(6, {})).estimate, again.process(epoch(6, {})).estimate
    assert going_on is not None
    assert gone_on is not None
    assert gone_on.covariance.tolist() == going_on.covariance.tolist()
    assert gone_on.position_m.tolist() == going_on.position_m.tolist()


def test_a_filter_in_the_plane_is_refused() -> None:
    with pytest.raises(StateError, match="three dimensions"):
        opened(None, settings={"dimension": 2}, estimator="constant_velocity")
