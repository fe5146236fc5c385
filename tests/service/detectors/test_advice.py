"""A session over a map that knows its path is told what lies ahead: in answers, when asked, and after a restart."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.watching import Drive
from service.errors import RequestError
from service.live.answer_models import EpochOut
from service.live.drives import DriveIn, FullAdviceOut
from service.live.registry import Detectors
from service.live.request import DetectorIn, EpochIn
from service.settings import Settings
from terrain import ElevationGrid
from tests.planning.watching.test_advice import ANCHORS, PATH, wall

PATH_M = PATH.tolist()
SESSION = {
    "anchors": [
        {"id": a.id, "east_m": a.east_m, "north_m": a.north_m, "altitude_m": 2000.0 if n > 1 else a.altitude_m}
        for n, a in enumerate(ANCHORS)
    ],
    "dem_id": "wall",
}
DRIVE = {"path_m": PATH_M, "horizon_m": 1000.0, "movable": ["A1"]}


def epoch(second: int) -> EpochIn:
    """The rover at 1 m/s along the path, from its beginning."""
    rover_m = (300.0, 780.0 - second, 1.5)
    rng = np.random.default_rng(second)
    ranges = [
        {
            "anchor_id": one["id"],
            "range_m": math.dist((one["east_m"], one["north_m"], one["altitude_m"]), rover_m) + rng.normal(0.0, 0.05),
        }
        for one in SESSION["anchors"]  # type: ignore[attr-defined] # a list of dictionaries
    ]
    return EpochIn.model_validate({"time_s": float(second), "ranges": ranges})


def opened(detectors: Detectors, **more: Any) -> Any:
    return detectors.open(DetectorIn.model_validate({**SESSION, **more}), wall())


@pytest.mark.anyio
async def test_answers_carry_advice_about_once_a_second() -> None:
    session = opened(Detectors(Settings()), drive=DRIVE)
    told = [json.loads(await session.answer_in_turn(epoch(second))) for second in range(8)]
    for answer in told:
        EpochOut.model_validate(answer)
    advised = [answer["advice"] for answer in told if answer["advice"] is not None]
    assert len(advised) >= 6
    assert advised[-1]["at_m"] == pytest.approx(7.0, abs=1.0)
    (stretch,) = advised[-1]["stretches"]
    assert stretch["hidden"] == ["A1", "A2"]
    between = epoch(7).model_copy(update={"time_s": 7.4})
    assert json.loads(await session.answer_in_turn(between))["advice"] is None


@pytest.mark.anyio
async def test_the_whole_advice_names_a_drone_to_move() -> None:
    session = opened(Detectors(Settings()))
    with pytest.raises(RequestError, match="has no path"):
        await session.advise()
    assert session.drive is None
    await session.follow(DriveIn.model_validate(DRIVE))
    assert session.drive == DriveIn.model_validate(DRIVE)
    with pytest.raises(RequestError, match="no place yet"):
        await session.advise()
    for second in range(4):
        await session.answer_in_turn(epoch(second))
    told = FullAdviceOut.model_validate(await session.advise())
    assert told.move is not None
    assert (told.move.anchor_id, told.move.restored) == ("A1", True)
    assert told.move.flight_m is not None
    assert told.move.flight_m > 0.0
    assert told.path is not None
    assert told.path.sentence
    assert (told.path.path_m is None) == (told.path.longer_m is None)


@pytest.mark.anyio
async def test_a_path_that_was_taken_later_is_kept(tmp_path: Path) -> None:
    detectors = Detectors(Settings(), folder=tmp_path)
    session = opened(detectors)
    await session.follow(DriveIn.model_validate(DRIVE))
    for second in range(4):
        await session.answer_in_turn(epoch(second))
    expected = await session.advise()

    def grid_of(dem_id: str) -> ElevationGrid:
        assert dem_id == "wall"
        return wall()

    later = Detectors(Settings(), folder=tmp_path)
    later.restore(grid_of)
    assert await later.get(session.id).advise() == expected


def test_a_path_needs_a_map_and_anchors_that_there_are() -> None:
    detectors = Detectors(Settings())
    with pytest.raises(RequestError, match="looks at no map"):
        detectors.open(DetectorIn.model_validate({**SESSION, "dem_id": None, "drive": DRIVE}))
    with pytest.raises(RequestError, match="no anchor 'Z'"):
        opened(detectors, drive={**DRIVE, "movable": ["Z"]})
    assert isinstance(DriveIn.model_validate(DRIVE).drive(), Drive)
